#include "cli/session.h"

#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

constexpr auto kRestartPatience = std::chrono::seconds(20);

std::string LoginName() {
  const passwd* user = getpwuid(geteuid());
  return user != nullptr ? user->pw_name : "uid " + std::to_string(geteuid());
}

}  // namespace

Session::Session() : requested_by_(LoginName()) {}

absl::StatusOr<std::shared_ptr<grpc::Channel>> Session::ChannelTo(const std::string& area) {
  std::lock_guard<std::mutex> lock(mutex_);
  auto& plant_channel = channels_["plant"];
  if (plant_channel == nullptr) plant_channel = runtime::ConnectTo(server);
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
    return runtime::Failure(absl::StatusCode::kNotFound, "SERVICE_MISSING",
                            "the plant at " + server + " names no service for " + area);
  }
  return channels_[area] = runtime::ConnectTo(address->second);
}

absl::Status Session::Retrying(
    const std::string& area,
    const std::function<grpc::Status(const std::shared_ptr<grpc::Channel>&, grpc::ClientContext*)>& attempt) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(deadline_s);
  constexpr auto kNever = Clock::time_point::max();
  Clock::time_point away_since = kNever;
  auto pause = std::chrono::milliseconds(200);
  while (true) {
    absl::Status status;
    if (auto channel = ChannelTo(area); channel.ok()) {
      const double left_s = std::chrono::duration<double>(end - Clock::now()).count();
      const auto context = runtime::ContextFor(std::max(left_s, 0.001));
      status = runtime::FromGrpc(attempt(*channel, context.get()));
    } else {
      status = channel.status();
    }
    const auto now = Clock::now();
    if (absl::IsUnavailable(status)) {
      // A service that is being restarted is back within seconds; a plant that nobody started should not be waited for.
      if (!reached_) return status;
      if (away_since == kNever) away_since = now;
      if (now + pause > away_since + kRestartPatience) return status;
    } else {
      reached_ = true;
      away_since = kNever;
      if (!absl::IsResourceExhausted(status)) return status;
    }
    if (now + pause > end) return status;
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 2, std::chrono::milliseconds(2000));
  }
}

void Session::OnCommand(CLI::App* command, std::function<absl::Status()> action) {
  command->callback([this, action = std::move(action)] { action_ = action; });
}

int Session::Run() {
  const absl::Status status = action_();
  if (status.ok()) return exit_code_;
  if (json) {
    std::cout << FailureToJson(status, server).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  } else {
    std::cerr << FailureToText(status, server);
  }
  return absl::IsUnavailable(status) ? kUnreachable : kFailed;
}

std::string NewRequestId() {
  std::random_device device;
  const auto word = [&] { return (static_cast<std::uint64_t>(device()) << 32) | device(); };
  const std::uint64_t high = (word() & ~0xf000ull) | 0x4000ull;
  const std::uint64_t low = (word() & ~(3ull << 62)) | (1ull << 63);
  char text[40];
  std::snprintf(text, sizeof text, "%08llx-%04llx-%04llx-%04llx-%012llx", static_cast<unsigned long long>(high >> 32),
                static_cast<unsigned long long>(high >> 16 & 0xffff), static_cast<unsigned long long>(high & 0xffff),
                static_cast<unsigned long long>(low >> 48), static_cast<unsigned long long>(low & 0xffffffffffffull));
  return text;
}

std::string NextStep(const absl::Status& status, const std::string& server) {
  const std::string reason = runtime::ReasonOf(status);
  const std::string message(status.message());
  const auto about = [&](const char* noun) { return message.find(noun) != std::string::npos; };
  if (reason == "CALIBRATION_MISSING" || reason == "CALIBRATION_EXPIRED") {
    return "calibrate the machine: sixpoint calibrate sensor ..., sixpoint calibrate rotation ...";
  }
  if (reason == "POINTS_DELETED") return "its values and results are still there: sixpoint scan show ID";
  switch (status.code()) {
    case absl::StatusCode::kUnavailable:
      return "no plant answers at " + server +
             "; see `sixpoint status`, start one by `sixpoint up`, or name another by --server";
    case absl::StatusCode::kNotFound:
      if (about("machine")) return "see which there are: sixpoint machine list";
      if (about("artefact")) return "see which there are: sixpoint artefact list";
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
      return "do what is missing first; `sixpoint blade show SN` and `sixpoint calibration list` show what there is";
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return "ask for the right to do this";
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
