// What the kernel says of this process, by the names that Prometheus' own clients give it, what it was built from, and until when its
// certificates hold.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "services/runtime/metrics.h"

namespace sixpoint::runtime {

class ProcessMetrics {
 public:
  // certificates: the folder of its own (identity/credentials.h).
  ProcessMetrics(const std::string& area, const std::filesystem::path& certificates);

 private:
  std::vector<std::unique_ptr<Computed>> all_;
};

}  // namespace sixpoint::runtime
