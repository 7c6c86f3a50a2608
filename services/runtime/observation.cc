#include "services/runtime/observation.h"

#include <algorithm>
#include <string>
#include <utility>

#include "identity/credentials.h"
#include "services/runtime/call_log.h"
#include "services/runtime/call_metrics.h"
#include "services/runtime/errors.h"
#include "services/runtime/metrics.h"

namespace sixpoint::runtime {
namespace {

using identity::Role;
using Seconds = std::chrono::duration<double>;

constexpr char kMetricsPath[] = "/metrics";
constexpr char kExposition[] = "text/plain; version=0.0.4; charset=utf-8";

// What a machine and a service may not: each sees what all of the plant does.
bool MayRead(const identity::Identity& caller) {
  return std::any_of(caller.roles.begin(), caller.roles.end(), [](Role role) {
    return role == Role::kMesReader || role == Role::kEngineer || role == Role::kQuality || role == Role::kAdmin;
  });
}

absl::Status CheckRole(const identity::Identity& caller) {
  if (MayRead(caller)) return absl::OkStatus();
  return Failure(errors::v1::ROLE_MISSING,
                 std::string(kMetricsPath) + ": " + caller.Text() + " is " + caller.RolesText() + ", want " +
                     identity::RoleText(Role::kMesReader) + " or " + identity::RoleText(Role::kEngineer) + " or " +
                     identity::RoleText(Role::kQuality) + " or " + identity::RoleText(Role::kAdmin),
                 {{"resource", caller.Text()}});
}

std::vector<Reading> SecondsLeft(const std::vector<std::pair<std::string, std::filesystem::path>>& files) {
  std::vector<Reading> readings;
  for (const auto& [whose, file] : files)
    if (const auto end = CertificateEnd(file))
      readings.push_back({{whose}, Seconds(*end - std::chrono::system_clock::now()).count()});
  return readings;
}

}  // namespace

Observation::Observation(const ServerOptions& options, storage::Database* database, storage::Database* own_database,
                         const Access* access, Denials* denials)
    : options_(options), database_(database), access_(*access), denials_(*denials), process_(options.area) {
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
  const std::filesystem::path folder = options.certificates;
  add("sixpoint_certificate_expiry_seconds", "Time until a certificate ends; below 0 after it.", {"certificate"},
      [folder] {
        return SecondsLeft(
            {{"service", folder / identity::kIdentityFile}, {"authority", folder / identity::kAuthorityFile}});
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
  absl::StatusOr<std::unique_ptr<TlsServer>> tls =
      TlsServer::Open(std::filesystem::path(options_.certificates) / identity::kIdentityFile);
  if (!tls.ok()) return tls.status();
  absl::StatusOr<std::vector<Descriptor>> sockets = ListenAt(options_.metrics_address);
  if (!sockets.ok()) return sockets.status();
  sampler_ = std::make_unique<Sampler>(database_, std::move(sampled));
  listener_ = std::make_unique<HttpsListener>(*std::move(sockets), *std::move(tls),
                                              [this](const HttpRequest& request) { return AnswerOf(request); });
  return absl::OkStatus();
}

void Observation::End() {
  listener_.reset();
  sampler_.reset();
}

HttpAnswer Observation::AnswerOf(const HttpRequest& request) const {
  if (request.path == kMetricsPath) return Metrics(request);
  if (request.path == "/health/live") return {200, "live\n"};
  // Why not is said to whoever calls, and in the log: here anybody listens.
  if (request.path == "/health/ready") return is_ready_ ? HttpAnswer{200, "ready\n"} : HttpAnswer{503, "not ready\n"};
  return {404, "path: unknown, want /metrics, /health/live or /health/ready\n"};
}

HttpAnswer Observation::Metrics(const HttpRequest& request) const {
  const absl::StatusOr<identity::Identity> caller = access_.Believe(request.certificate_pem);
  const absl::Status may = caller.ok() ? CheckRole(*caller) : caller.status();
  if (may.ok()) return {200, ExpositionText(), kExposition};
  const std::string reason = ReasonOf(may);
  // Where nobody can be judged, nobody is denied.
  const int code = absl::IsPermissionDenied(may) ? 403 : absl::IsUnauthenticated(may) ? 401 : 503;
  if (code != 503) {
    // Whom another authority names is nobody here.
    const auto named = identity::CertificateOf(request.certificate_pem);
    const bool is_ours = named.ok() && !HasReason(may, errors::v1::CERTIFICATE_FOREIGN);
    denials_.Add(std::string("GET ") + kMetricsPath, is_ours ? named->identity.Text() : "", request.peer, reason,
                 std::string(may.message()));
  }
  return {code, reason + ": " + std::string(may.message()) + "\n"};
}

}  // namespace sixpoint::runtime
