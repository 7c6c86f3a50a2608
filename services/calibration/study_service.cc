#include "services/calibration/study_service.h"

#include "services/calibration/study_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::ToGrpc;

absl::StatusOr<storage::StudyFilter> FilterOf(const v1::ListStudiesRequest& request) {
  storage::StudyFilter filter;
  absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine_id.ok()) return machine_id.status();
  filter.machine_id = *std::move(machine_id);
  filter.kind = KindText(request.kind());
  if (filter.kind.empty() && request.kind() != v1::STUDY_KIND_UNSPECIFIED)
    return runtime::Refuse("kind", std::to_string(request.kind()), "a kind of study");
  if (!v1::StudyVerdict_IsValid(request.verdict()))
    return runtime::Refuse("verdict", std::to_string(request.verdict()), "a verdict of a study");
  filter.verdict = VerdictText(request.verdict());
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  return filter;
}

void LeaveBasic(v1::Study* study) {
  if (study->has_gauge()) study->mutable_gauge()->clear_stations();
}

}  // namespace

StudyService::StudyService(std::shared_ptr<storage::StudyStore> store,
                           std::shared_ptr<storage::CalibrationStore> calibrations,
                           std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest)
    : store_(store), runner_(std::move(store), std::move(calibrations), std::move(plant), std::move(ingest)) {}

template <typename Request>
grpc::Status StudyService::Run(grpc::ServerContext* context,
                               absl::StatusOr<v1::Study> (StudyRunner::*method)(const Request&, const Caller&),
                               const Request& request, v1::Study* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer((runner_.*method)(request, runtime::CallerOf(*context)), response);
}

grpc::Status StudyService::RunGaugeStudy(grpc::ServerContext* context, const v1::RunGaugeStudyRequest* request,
                                         v1::Study* response) {
  return Run(context, &StudyRunner::RunGauge, *request, response);
}

grpc::Status StudyService::RunArmStudy(grpc::ServerContext* context, const v1::RunArmStudyRequest* request,
                                       v1::Study* response) {
  return Run(context, &StudyRunner::RunArm, *request, response);
}

grpc::Status StudyService::RunRepeatStudy(grpc::ServerContext* context, const v1::RunRepeatStudyRequest* request,
                                          v1::Study* response) {
  return Run(context, &StudyRunner::RunRepeat, *request, response);
}

grpc::Status StudyService::RunGaugeRr(grpc::ServerContext* context, const v1::RunGaugeRrRequest* request,
                                      v1::Study* response) {
  return Run(context, &StudyRunner::RunGaugeRr, *request, response);
}

grpc::Status StudyService::RunSphereCheck(grpc::ServerContext* context, const v1::RunSphereCheckRequest* request,
                                          v1::Study* response) {
  return Run(context, &StudyRunner::RunSphereCheck, *request, response);
}

grpc::Status StudyService::GetStudy(grpc::ServerContext* context, const v1::GetStudyRequest* request,
                                    v1::Study* response) {
  return runtime::Answer(runtime::GetResult<v1::Study>(*store_, runtime::DeadlineOf(*context), "studies",
                                                       request->name(), errors::v1::STUDY_NOT_FOUND,
                                                       [](const storage::StudyRow& row) { return ToProto(row); }),
                         response);
}

grpc::Status StudyService::ListStudies(grpc::ServerContext* context, const v1::ListStudiesRequest* request,
                                       v1::ListStudiesResponse* response) {
  const absl::StatusOr<storage::StudyFilter> filter = FilterOf(*request);
  if (!filter.ok()) return ToGrpc(filter.status());
  const auto to_study = [](const storage::StudyRow& row) { return ToProto(row); };
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, *filter, to_study, LeaveBasic,
                                     response->mutable_studies(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::calibration
