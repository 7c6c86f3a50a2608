#include "services/runtime/metrics_listener.h"

#include <algorithm>
#include <utility>

#include "identity/credentials.h"
#include "services/runtime/errors.h"
#include "services/runtime/metrics.h"

namespace sixpoint::runtime {
namespace {

using identity::Role;

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

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsListener>> MetricsListener::Open(const std::string& address,
                                                                       const std::filesystem::path& certificates,
                                                                       Ask ask) {
  absl::StatusOr<std::unique_ptr<TlsServer>> tls = TlsServer::Open(certificates / identity::kIdentityFile);
  if (!tls.ok()) return tls.status();
  absl::StatusOr<std::vector<Descriptor>> sockets = ListenAt(address);
  if (!sockets.ok()) return sockets.status();
  std::unique_ptr<MetricsListener> opened(new MetricsListener(std::move(ask)));
  opened->listener_ = std::make_unique<HttpsListener>(
      *std::move(sockets), *std::move(tls),
      [self = opened.get()](const HttpRequest& request) { return self->AnswerOf(request); });
  return opened;
}

HttpAnswer MetricsListener::AnswerOf(const HttpRequest& request) const {
  if (request.path == kMetricsPath) return Metrics(request);
  if (request.path == "/health/live") return {200, "live\n"};
  // Why not is said to whoever calls, and in the log: here anybody listens.
  if (request.path == "/health/ready")
    return ask_.is_ready() ? HttpAnswer{200, "ready\n"} : HttpAnswer{503, "not ready\n"};
  return {404, "path: unknown, want /metrics, /health/live or /health/ready\n"};
}

HttpAnswer MetricsListener::Metrics(const HttpRequest& request) const {
  const absl::StatusOr<identity::Identity> caller = ask_.believe(request.certificate_pem);
  const absl::Status may = caller.ok() ? CheckRole(*caller) : caller.status();
  if (may.ok()) return {200, ExpositionText(), kExposition};
  // Where nobody can be judged, nobody is denied.
  const int code = absl::IsPermissionDenied(may) ? 403 : absl::IsUnauthenticated(may) ? 401 : 503;
  if (code != 503) {
    // Whom another authority names is nobody here.
    const auto named = identity::CertificateOf(request.certificate_pem);
    const bool is_ours = named.ok() && !HasReason(may, errors::v1::CERTIFICATE_FOREIGN);
    ask_.denied(request, is_ours ? named->identity.Text() : "", may);
  }
  return {code, ReasonOf(may) + ": " + std::string(may.message()) + "\n"};
}

}  // namespace sixpoint::runtime
