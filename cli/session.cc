#include "cli/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/identity_folder.h"
#include "cli/tls_failure.h"
#include "services/runtime/call.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

constexpr double kRestartPatience_s = 20;

}  // namespace

absl::Status Session::MakeCredentials() {
  if (credentials != nullptr) return absl::OkStatus();
  const absl::StatusOr<std::filesystem::path> folder = IdentityFolder(identity, data);
  if (!folder.ok()) return folder.status();
  auto made = runtime::ChannelCredentialsOf(*folder);
  if (made.ok()) credentials = *std::move(made);
  return made.status();
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> Session::ChannelTo(const std::string& area) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (absl::Status status = MakeCredentials(); !status.ok()) return status;
  auto& plant_channel = channels_["plant"];
  if (plant_channel == nullptr) plant_channel = runtime::ConnectTo(server, credentials);
  if (area == "plant") return plant_channel;
  if (const auto found = channels_.find(area); found != channels_.end()) return found->second;
  if (addresses_.empty()) {
    plant::v1::ListEndpointsResponse endpoints;
    const grpc::Status answered =
        plant::v1::PlantService::NewStub(plant_channel)->ListEndpoints(runtime::ContextFor(10).get(), {}, &endpoints);
    if (!answered.ok()) return runtime::FromGrpc(answered);
    reached_ = true;
    for (const auto& endpoint : endpoints.endpoints()) addresses_[endpoint.area()] = endpoint.address();
  }
  const auto address = addresses_.find(area);
  if (address == addresses_.end()) {
    return runtime::Failure(errors::v1::SERVICE_MISSING, "the plant at " + server + " names no service for " + area,
                            {{"resource", area}});
  }
  return channels_[area] = runtime::ConnectTo(address->second, credentials);
}

runtime::RetryLimits Session::Limits() const {
  runtime::RetryLimits limits;
  limits.away_s = kRestartPatience_s;
  limits.full_s = deadline_s;
  limits.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(std::llround(1e3 * deadline_s));
  return limits;
}

absl::Status Session::Retrying(const std::string& area,
                               const std::function<absl::Status(const std::shared_ptr<grpc::Channel>&,
                                                                std::unique_ptr<grpc::ClientContext>)>& attempt) {
  const runtime::RetryLimits limits = Limits();
  runtime::Retry retry(area, limits);
  while (true) {
    const auto channel = ChannelTo(area);
    absl::Status status = channel.status();
    if (channel.ok()) {
      const double left_s = std::chrono::duration<double>(limits.deadline - std::chrono::steady_clock::now()).count();
      status = attempt(*channel, runtime::ContextFor(std::max(left_s, 0.001)));
    }
    // A service that is being restarted is back within seconds; a plant that nobody started should not be waited for.
    if (!absl::IsUnavailable(status)) reached_ = true;
    if (!reached_ || !retry.TryAgain(status, channel.ok() ? *channel : nullptr)) return status;
  }
}

absl::Status Session::Following(
    const std::string& area,
    const std::function<absl::Status(const std::shared_ptr<grpc::Channel>&, std::unique_ptr<grpc::ClientContext>,
                                     const std::function<void()>&)>& attempt) {
  runtime::RetryLimits limits;
  limits.away_s = limits.full_s = std::numeric_limits<double>::infinity();
  limits.say = [](const std::string& text) { std::cerr << text << "\n"; };
  runtime::Retry retry(area, limits);
  const auto progressed = [&] {
    reached_ = true;
    retry.Progressed();
  };
  while (true) {
    const auto channel = ChannelTo(area);
    absl::Status status = channel.status();
    if (channel.ok()) status = attempt(*channel, runtime::ContextWithoutDeadline(), progressed);
    // Who was too slow to read is cut off, and may call again.
    if (absl::IsCancelled(status)) status = absl::UnavailableError(status.message());
    if (!absl::IsUnavailable(status)) reached_ = true;
    if (!reached_ || !retry.TryAgain(status, channel.ok() ? *channel : nullptr)) return status;
  }
}

void Session::OnCommand(Command* command, std::function<absl::Status()> action) {
  command->OnChosen([this, action = std::move(action)] { action_ = action; });
}

int Session::Run() {
  const std::string trace_id = runtime::BeginOwnTrace();
  absl::Status status = action_();
  // Done is what was read: a full disk or a reader that went away is no success.
  if (status.ok() && !std::cout.flush())
    status = absl::DataLossError("standard output: what was printed did not arrive");
  if (status.ok()) return exit_code_;
  if (json) {
    nlohmann::json failure = FailureToJson(status, server);
    if (reached_) failure["error"]["trace_id"] = trace_id;
    std::cout << failure.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  } else {
    std::cerr << FailureToText(status, server);
    // By which who runs the plant finds it: `sixpoint logs --trace`.
    if (reached_) std::cerr << "trace: " << trace_id << "\n";
  }
  return absl::IsUnavailable(status) ? kUnreachable : kFailed;
}

namespace {

// gRPC says of an end that it does not believe no more than that it is not there.
std::string NextStepUnreachable(const absl::Status& status, const std::string& server) {
  const std::string message(status.message());
  switch (runtime::ReasonOf(status).empty() ? TlsFailureOf(message) : TlsFailure::kNone) {
    case TlsFailure::kNone:
      break;
    case TlsFailure::kNotTrusted:
      return "by this computer's clock the plant's certificate does not hold (see `date`: it may be the clock), or "
             "another "
             "authority made it than yours: `sixpoint certs renew` on the plant's computer, or name the folder of your "
             "certificate for that plant by --identity";
    case TlsFailure::kOtherHost:
      return "the plant's certificate is for other hosts than it was called by: call it as it announces itself, or "
             "have it announced by that host with `sixpoint up --announce HOST`";
    case TlsFailure::kNoTls:
      return "what listens there speaks no TLS: another program, or a plant of an older release; see `sixpoint status`";
    case TlsFailure::kOther:
      return "TLS failed: look at your own certificate, `sixpoint certs show`, and at the plant's, `sixpoint status`";
  }
  return "no plant answers at " + server +
         "; see `sixpoint status`, start one by `sixpoint up`, or name another by --server";
}

// What the plant said of the certificate that it was shown, or of whom it names (docs/errors.md).
std::string NextStepRefused(const absl::Status& status) {
  if (absl::IsUnauthenticated(status))
    return "look at the certificate that you show: sixpoint certs show; who runs the plant makes a new one: sixpoint "
           "certs issue, and his own: sixpoint certs renew";
  if (runtime::HasReason(status, errors::v1::MACHINE_DIFFERS))
    return "show that machine's own certificate by --identity; whose yours is: sixpoint certs show";
  if (runtime::HasReason(status, errors::v1::ROLE_MISSING))
    return "ask who runs the plant for a certificate with the role; which roles yours has: sixpoint certs show";
  if (runtime::HasReason(status, errors::v1::CLEARANCE_MISSING))
    return "look at the name; where it is right, ask who runs the plant to clear you: sixpoint clearance grant";
  if (runtime::HasReason(status, errors::v1::CODE_NOT_VALID))
    return "ask who runs the plant for another code: sixpoint certs offer";
  return "ask for the right to do this";
}

}  // namespace

std::string NextStep(const absl::Status& status, const std::string& server) {
  const std::string message(status.message());
  const auto about = [&](const char* noun) { return message.find(noun) != std::string::npos; };
  if (runtime::HasReason(status, errors::v1::CALIBRATION_MISSING) ||
      runtime::HasReason(status, errors::v1::CALIBRATION_EXPIRED)) {
    return "calibrate the machine: sixpoint calibrate sensor ..., rotation ..., probe ... or axis ...";
  }
  if (runtime::HasReason(status, errors::v1::POINTS_DELETED))
    return "its values and results are still there: sixpoint scan show ID";
  if (runtime::HasReason(status, errors::v1::ACCOUNT_NOT_FOUND) ||
      runtime::HasReason(status, errors::v1::ACCOUNT_EXISTS))
    return "see which there are: sixpoint accounts list";
  if (runtime::HasReason(status, errors::v1::RENEWAL_NOT_OFFERED))
    return "`sixpoint certs renew` on the plant's computer makes one, once it is due; until when yours holds: sixpoint "
           "certs show";
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
      return NextStepUnreachable(status, server);
    case absl::StatusCode::kNotFound:
      if (about("authority: none"))
        return "start a plant by `sixpoint up`, or name the authority's folder by --authority";
      if (about("serial")) return "see which there are: sixpoint certs list --all";
      if (about("machine")) return "see which there are: sixpoint machine list";
      if (about("artefact")) return "see which there are: sixpoint artefact list";
      if (about("machining_model")) return "see which there are: sixpoint model list";
      if (about("drawing")) return "see which there are: sixpoint drawing list";
      if (about("part")) return "see which there are: sixpoint part list";
      if (about("blade")) return "see which there are: sixpoint blade list";
      if (about("scan")) return "see which there are: sixpoint scan list";
      if (about("calibration")) return "see which there are: sixpoint calibration list";
      return "check the name";
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return "correct what is named above and run the command again";
    case absl::StatusCode::kAlreadyExists:
      return "choose another id, or look at the one that is there";
    case absl::StatusCode::kResourceExhausted:
      return "the service is full; run the command again in a while";
    case absl::StatusCode::kDeadlineExceeded:
      return "the service did not answer in time; run the command again with a longer --deadline-s";
    case absl::StatusCode::kFailedPrecondition:
      if (about("does not serve")) return "cure what it says; it serves by itself then, and `sixpoint status` tells";
      if (about("no certificate to show"))
        return "have one made, and name its folder by --identity or SIXPOINT_IDENTITY";
      if (about("newer release")) return "run `sixpoint up` of the release that made it, or of a newer one";
      return "do what is missing first; `sixpoint blade show SN` and `sixpoint calibration list` show what there is";
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return NextStepRefused(status);
    default:
      return "see the service's log; `sixpoint status` tells which services run";
  }
}

nlohmann::json FailureToJson(const absl::Status& status, const std::string& server) {
  return {{"error",
           {{"code", absl::StatusCodeToString(status.code())},
            {"message", std::string(status.message())},
            {"reason", runtime::ReasonOf(status)},
            {"next", NextStep(status, server)}}}};
}

std::string FailureToText(const absl::Status& status, const std::string& server) {
  const std::string reason = runtime::ReasonOf(status);
  return "error: " + absl::StatusCodeToString(status.code()) + (reason.empty() ? "" : " (" + reason + ")") + "\n" +
         std::string(status.message()) + "\nnext: " + NextStep(status, server) + "\n";
}

}  // namespace sixpoint::cli
