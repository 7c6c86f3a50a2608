#include "services/correction/correction_service.h"

#include <cstring>
#include <string>
#include <utility>

#include "services/correction/correct.h"
#include "services/correction/messages.h"
#include "services/correction/rows.h"
#include "services/correction/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"

namespace sixpoint::correction {

using runtime::ToGrpc;

CorrectionService::CorrectionService(std::shared_ptr<storage::CorrectionStore> store,
                                     std::unique_ptr<const Peers> peers, int greatest_count)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      running_({greatest_count, 0}, "corrections", errors::v1::CORRECTIONS_FULL) {}

grpc::Status CorrectionService::Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                                        v1::Correction* response) {
  if (absl::Status status = CheckCorrect(*request); !status.ok()) return ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  const auto make = [&] { return Make(*request, caller); };
  return runtime::Answer(runtime::RecordedResult<v1::Correction>(store_.get(), "correction.Correct", *request,
                                                                 caller.deadline, make, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::CorrectionRow>> CorrectionService::Make(const v1::CorrectRequest& request,
                                                                              const runtime::Caller& caller) const {
  const absl::StatusOr<Inputs> inputs = FetchInputs(*peers_, request, caller);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<Corrected> corrected = CorrectBlade(request, *inputs);
  if (!corrected.ok()) return corrected.status();
  return RecordOf(request, *inputs, *corrected);
}

grpc::Status CorrectionService::GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                                              v1::Correction* response) {
  return runtime::Answer(runtime::GetResult<v1::Correction>(*store_, runtime::DeadlineOf(*context), "corrections",
                                                            request->name(), errors::v1::CORRECTION_NOT_FOUND, ToProto),
                         response);
}

grpc::Status CorrectionService::ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                                                v1::ListCorrectionsResponse* response) {
  storage::CorrectionFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  if (!v1::Release_IsValid(request->release()))
    return ToGrpc(runtime::Refuse("release", std::to_string(request->release()), "a release, or none"));
  if (request->release() != v1::RELEASE_UNSPECIFIED)
    filter.release = v1::Release_Name(request->release()).substr(std::strlen("RELEASE_"));
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_corrections(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::correction
