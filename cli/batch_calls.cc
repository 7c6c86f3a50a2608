#include "cli/batch_calls.h"

#include <utility>

#include "cli/output.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using registration::v1::RegistrationProgress;
using registration::v1::RegistrationService;

std::string StepText(const RegistrationProgress& progress) {
  switch (progress.step()) {
    case registration::v1::REGISTRATION_STEP_FETCHING:
      return "fetching, " + std::to_string(progress.scan_count()) + " scans";
    case registration::v1::REGISTRATION_STEP_FITTING:
      return "fitting, iteration " + std::to_string(progress.iteration_count());
    default:
      return "waiting";
  }
}

}  // namespace

BatchCalls::BatchCalls(Session* session, registration::v1::RegisterBatchRequest request, Finished finished)
    : session_(session), request_(std::move(request)), finished_(std::move(finished)), line_(session->json) {}

absl::Status BatchCalls::Run() {
  while (true) {
    const std::size_t before = results_.size();
    const absl::Status status = CallOnce();
    const bool went_on = results_.size() > before;
    // A batch that takes longer than one call's deadline, or loses its server now and then, takes several calls.
    if (status.ok() || !went_on || !(absl::IsDeadlineExceeded(status) || absl::IsUnavailable(status))) {
      line_.Clear();
      return status;
    }
  }
}

absl::Status BatchCalls::CallOnce() {
  return session_->Retrying(
      "registration", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
        request_.clear_skip();
        for (const auto& [index, result] : results_) request_.add_skip(index);
        working_.clear();
        const auto stub = RegistrationService::NewStub(channel);
        const auto reader = stub->RegisterBatch(context.get(), request_);
        registration::v1::RegisterBatchResponse response;
        absl::Status taken;
        while (reader->Read(&response)) taken.Update(Take(std::move(response)));
        const absl::Status ended = runtime::FromGrpc(reader->Finish());
        return ended.ok() ? taken : ended;
      });
}

absl::Status BatchCalls::Take(registration::v1::RegisterBatchResponse response) {
  absl::Status status;
  if (response.has_progress()) {
    working_[response.progress().index()] = StepText(response.progress());
  } else if (response.has_finished()) {
    const int index = response.finished().index();
    working_.erase(index);
    status = finished_(BladeOf(index), response.finished());
    if (status.ok()) results_[index] = std::move(*response.mutable_finished());
  }
  line_.Show(HowFar());
  return status;
}

std::string BatchCalls::BladeOf(int index) const {
  return index >= 0 && index < request_.requests_size() ? request_.requests(index).blade() : "";
}

std::string BatchCalls::HowFar() const {
  std::string text = "register";
  if (total_count() > 1)
    text += " " + std::to_string(results_.size()) + " of " + std::to_string(total_count()) + " blades";
  for (const auto& [index, step] : working_) text += "; " + IdText(BladeOf(index)) + " " + step;
  return text;
}

}  // namespace sixpoint::cli
