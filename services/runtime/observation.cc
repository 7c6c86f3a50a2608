#include "services/runtime/observation.h"

#include <algorithm>
#include <string>
#include <utility>

#include "services/runtime/call_log.h"
#include "services/runtime/call_metrics.h"
#include "services/runtime/errors.h"
#include "services/runtime/metrics.h"

namespace sixpoint::runtime {
namespace {

using Seconds = std::chrono::duration<double>;

}  // namespace

Observation::Observation(const ServerOptions& options, storage::Database* database, storage::Database* own_database,
                         const Access* access, Denials* denials)
    : options_(options),
      database_(database),
      access_(*access),
      denials_(*denials),
      process_(options.area, options.certificates) {
  const auto add = [this](const char* name, const char* help, std::vector<std::string> labels, Computed::Ask ask) {
    own_.push_back(std::make_unique<Computed>(name, help, std::move(labels), std::move(ask)));
  };
  const auto add_one = [&](const char* name, const char* help, std::function<double()> ask) {
    add(name, help, {}, [ask = std::move(ask)] { return std::vector<Reading>{{{}, ask()}}; });
  };
  add_one("sixpoint_ready", "1 while the database is there and its schema is right.",
          [this] { return is_ready_ ? 1.0 : 0.0; });
  add_one("sixpoint_calls_in_flight", "Calls that have begun and not ended.",
          [] { return static_cast<double>(CallsInFlight()); });
  add_one("sixpoint_database_pool_connections", "Most connections to the database that are held at once.",
          [this] { return static_cast<double>(database_->use().size); });
  add_one("sixpoint_database_pool_in_use", "Connections to the database that are in use.",
          [this] { return static_cast<double>(database_->use().in_use); });
  add("sixpoint_database_silence_seconds", "Time since the database last answered.", {}, [this, own_database] {
    const auto answered = std::max(database_->use().answered, own_database->use().answered);
    if (!answered) return std::vector<Reading>();
    return std::vector<Reading>{{{}, Seconds(std::chrono::steady_clock::now() - *answered).count()}};
  });
  Histogram waits("sixpoint_database_pool_wait_seconds", "Time that work waited for a connection to the database.",
                  UsualSeconds());
  Counter refused("sixpoint_database_pool_refused_total", "Work whose time ended while it waited for a connection.");
  database_->Watch([waits, refused](std::chrono::duration<double> waited, bool got_one) mutable {
    waits.Observe(waited.count());
    if (!got_one) refused.Add();
  });
}

absl::Status Observation::Begin(std::vector<ServedService>* services) {
  std::vector<std::unique_ptr<Sampled>> sampled;
  for (ServedService& each : *services) {
    CountCallsOf(each.full_name);
    if (each.sampled != nullptr) sampled.push_back(std::move(each.sampled));
  }
  if (options_.metrics_address.empty()) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<MetricsListener>> listener =
      MetricsListener::Open(options_.metrics_address, options_.certificates,
                            {[this](const std::string& certificate_pem) { return access_.Believe(certificate_pem); },
                             [this] { return is_ready_.load(); },
                             [this](const HttpRequest& request, const std::string& caller, const absl::Status& why) {
                               AddDenial(request, caller, why);
                             }});
  if (!listener.ok()) return listener.status();
  sampler_ = std::make_unique<Sampler>(database_, std::move(sampled));
  listener_ = *std::move(listener);
  return absl::OkStatus();
}

void Observation::End() {
  listener_.reset();
  sampler_.reset();
}

void Observation::AddDenial(const HttpRequest& request, const std::string& caller, const absl::Status& why) {
  denials_.Add("GET " + request.path, caller, request.peer, ReasonOf(why), std::string(why.message()));
}

}  // namespace sixpoint::runtime
