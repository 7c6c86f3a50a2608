#include "services/calibration/study_service.h"

#include <utility>

#include "services/calibration/filters.h"
#include "services/calibration/study.h"
#include "services/calibration/study_messages.h"
#include "services/calibration/study_rows.h"
#include "services/calibration/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/recorded_results.h"

namespace sixpoint::calibration {
namespace {

using runtime::ToGrpc;

void LeaveBasic(v1::Study* study) {
  if (study->has_gauge()) study->mutable_gauge()->clear_stations();
}

}  // namespace

StudyService::StudyService(std::shared_ptr<storage::StudyStore> store,
                           std::shared_ptr<const storage::CalibrationReader> calibrations,
                           std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest)
    : store_(store), inputs_(std::move(calibrations), std::move(store), std::move(plant), std::move(ingest)) {}

template <typename Request>
grpc::Status StudyService::Run(grpc::ServerContext* context, const char* call, const Request& request,
                               v1::Study* response) {
  const Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  if (absl::Status status = CheckRequest(request); !status.ok()) return ToGrpc(status);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::StudyRow>> {
    const auto inputs = inputs_.Fetch(request, caller);
    if (!inputs.ok()) return inputs.status();
    absl::StatusOr<v1::Study> study = Study(request, *inputs);
    if (!study.ok()) return study.status();
    return RecordOf(request, *std::move(study));
  };
  return runtime::Answer(runtime::RecordedResult<v1::Study>(store_.get(), call, request, caller, make, ToProto),
                         response);
}

grpc::Status StudyService::RunGaugeStudy(grpc::ServerContext* context, const v1::RunGaugeStudyRequest* request,
                                         v1::Study* response) {
  return Run(context, "calibration.RunGaugeStudy", *request, response);
}

grpc::Status StudyService::RunArmStudy(grpc::ServerContext* context, const v1::RunArmStudyRequest* request,
                                       v1::Study* response) {
  return Run(context, "calibration.RunArmStudy", *request, response);
}

grpc::Status StudyService::RunRepeatStudy(grpc::ServerContext* context, const v1::RunRepeatStudyRequest* request,
                                          v1::Study* response) {
  return Run(context, "calibration.RunRepeatStudy", *request, response);
}

grpc::Status StudyService::RunGaugeRr(grpc::ServerContext* context, const v1::RunGaugeRrRequest* request,
                                      v1::Study* response) {
  return Run(context, "calibration.RunGaugeRr", *request, response);
}

grpc::Status StudyService::RunSphereCheck(grpc::ServerContext* context, const v1::RunSphereCheckRequest* request,
                                          v1::Study* response) {
  return Run(context, "calibration.RunSphereCheck", *request, response);
}

grpc::Status StudyService::RunInterimCheck(grpc::ServerContext* context, const v1::RunInterimCheckRequest* request,
                                           v1::Study* response) {
  return Run(context, "calibration.RunInterimCheck", *request, response);
}

grpc::Status StudyService::GetStudy(grpc::ServerContext* context, const v1::GetStudyRequest* request,
                                    v1::Study* response) {
  return runtime::Answer(runtime::GetResult<v1::Study>(*store_, runtime::DeadlineOf(*context), "studies",
                                                       request->name(), errors::v1::STUDY_NOT_FOUND, ToProto),
                         response);
}

grpc::Status StudyService::ListStudies(grpc::ServerContext* context, const v1::ListStudiesRequest* request,
                                       v1::ListStudiesResponse* response) {
  absl::StatusOr<storage::StudyFilter> filter = FilterOf(*request);
  if (!filter.ok()) return ToGrpc(filter.status());
  filter->reader = runtime::ReaderOf(*context);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, *filter, ToProto, LeaveBasic,
                                     response->mutable_studies(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::calibration
