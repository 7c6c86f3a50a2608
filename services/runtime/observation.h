// How a service is seen from outside, at --metrics (metrics_listener.h): what is told of its calls, its database and itself. Private to
// runtime.
#pragma once

#include <absl/status/status.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "services/runtime/access.h"
#include "services/runtime/denials.h"
#include "services/runtime/metrics_listener.h"
#include "services/runtime/process_metrics.h"
#include "services/runtime/sampler.h"
#include "services/runtime/server.h"
#include "storage/database.h"

namespace sixpoint::runtime {

class Observation {
 public:
  // All live longer. database: of the calls; own_database: which is asked each second, calls or not.
  Observation(const ServerOptions& options, storage::Database* database, storage::Database* own_database,
              const Access* access, Denials* denials);

  // From now on it is answered, where the options say at which address: of these services' calls, and of what is sampled of them,
  // which it takes. Before calls come.
  absl::Status Begin(std::vector<ServedService>* services);
  void SetReady(bool ready) { is_ready_ = ready; }
  // Nobody is answered any more.
  void End();

 private:
  void AddDenial(const HttpRequest& request, const std::string& caller, const absl::Status& why);

  const ServerOptions& options_;
  storage::Database* const database_;
  const Access& access_;
  Denials& denials_;
  std::atomic<bool> is_ready_{false};
  const ProcessMetrics process_;
  std::vector<std::unique_ptr<Computed>> own_;
  std::unique_ptr<Sampler> sampler_;
  std::unique_ptr<MetricsListener> listener_;
};

}  // namespace sixpoint::runtime
