#include "services/calibration/calibration_service.h"

#include <chrono>
#include <string>
#include <utility>

#include "services/calibration/calibrate.h"
#include "services/calibration/decide.h"
#include "services/calibration/filters.h"
#include "services/calibration/messages.h"
#include "services/calibration/rows.h"
#include "services/calibration/trend.h"
#include "services/calibration/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::Answer;
using runtime::ToGrpc;

// "sensor calibration", "characterisation of axis A".
std::string Described(const storage::CalibrationSubject& subject) {
  return subject.kind == "axis" ? "characterisation of axis " + subject.axis : subject.kind + " calibration";
}

absl::StatusOr<v1::Calibration> InForce(const storage::CalibrationReader& calibrations, storage::Deadline deadline,
                                        const v1::GetCalibrationInForceRequest& request) {
  const absl::StatusOr<storage::CalibrationSubject> subject =
      SubjectOf(request.machine(), request.kind(), request.axis());
  if (!subject.ok()) return subject.status();
  const absl::StatusOr<storage::Instant> at =
      request.has_at() ? InstantOf("at", request.at()) : calibrations.Now(deadline);
  if (!at.ok()) return at.status();
  const auto found = calibrations.InForce(*subject, *at, deadline);
  if (!found.ok()) return found.status();
  if (found->has_value()) return ToProto(**found);
  const auto withdrawn = calibrations.Withdrawn(*subject, *at, deadline);
  if (!withdrawn.ok()) return withdrawn.status();
  if (withdrawn->has_value())
    return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                            request.machine() + ": its " + Described(*subject) + " " + (**withdrawn).name() +
                                " was withdrawn (" + (**withdrawn).withdrawal->reason +
                                "), want one in force; calibrate",
                            {{"resource", request.machine()}});
  const auto ended = calibrations.LastValidity(*subject, *at, deadline);
  if (!ended.ok()) return ended.status();
  if (ended->has_value())
    return runtime::Failure(
        errors::v1::CALIBRATION_EXPIRED,
        request.machine() + ": its " + Described(*subject) + " has expired, want one in force; calibrate",
        {{"resource", request.machine()}});
  return runtime::Failure(errors::v1::CALIBRATION_MISSING,
                          request.machine() + ": no " + Described(*subject) + ", want one in force; calibrate first",
                          {{"resource", request.machine()}});
}

absl::StatusOr<v1::CalibrationTrend> Trend(const storage::CalibrationReader& calibrations, storage::Deadline deadline,
                                           const v1::GetCalibrationTrendRequest& request) {
  const absl::StatusOr<storage::CalibrationSubject> subject =
      SubjectOf(request.machine(), request.kind(), request.axis());
  if (!subject.ok()) return subject.status();
  if (absl::Status s = CheckRequest(request); !s.ok()) return s;
  const auto history =
      calibrations.History(*subject, request.most_count() == 0 ? kUsualTrendCount : request.most_count(), deadline);
  if (!history.ok()) return history.status();
  if (history->empty())
    return runtime::Failure(errors::v1::CALIBRATION_MISSING,
                            request.machine() + ": no " + subject->kind + " calibration" +
                                (subject->axis.empty() ? "" : " of " + subject->axis) +
                                " was ever in force, want at least one",
                            {{"resource", request.machine()}});
  return TrendOf(request, *history);
}

}  // namespace

CalibrationService::CalibrationService(std::shared_ptr<storage::CalibrationStore> store,
                                       std::shared_ptr<const storage::StudyStore> studies,
                                       std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest,
                                       int threads)
    : store_(store), inputs_(std::move(store), std::move(studies), std::move(plant), std::move(ingest), threads) {}

template <typename Request>
grpc::Status CalibrationService::Calibrate(grpc::ServerContext* context, const char* call, const Request& request,
                                           v1::Calibration* response) {
  const Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  if (absl::Status status = CheckRequest(request); !status.ok()) return ToGrpc(status);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::CalibrationRow>> {
    const auto inputs = inputs_.Fetch(request, caller);
    if (!inputs.ok()) return inputs.status();
    const auto result = calibration::Calibrate(request, *inputs);
    if (!result.ok()) return result.status();
    return RecordOf(RowOf(request, *inputs, *result));
  };
  return Answer(runtime::RecordedResult<v1::Calibration>(store_.get(), call, request, caller, make, ToProto), response);
}

grpc::Status CalibrationService::CalibrateSensor(grpc::ServerContext* context,
                                                 const v1::CalibrateSensorRequest* request, v1::Calibration* response) {
  return Calibrate(context, "calibration.CalibrateSensor", *request, response);
}

grpc::Status CalibrationService::StateSensorPose(grpc::ServerContext* context,
                                                 const v1::StateSensorPoseRequest* request, v1::Calibration* response) {
  return Calibrate(context, "calibration.StateSensorPose", *request, response);
}

grpc::Status CalibrationService::CalibrateRotation(grpc::ServerContext* context,
                                                   const v1::CalibrateRotationRequest* request,
                                                   v1::Calibration* response) {
  return Calibrate(context, "calibration.CalibrateRotation", *request, response);
}

grpc::Status CalibrationService::CalibrateProbe(grpc::ServerContext* context, const v1::CalibrateProbeRequest* request,
                                                v1::Calibration* response) {
  return Calibrate(context, "calibration.CalibrateProbe", *request, response);
}

grpc::Status CalibrationService::CharacteriseAxis(grpc::ServerContext* context,
                                                  const v1::CharacteriseAxisRequest* request,
                                                  v1::Calibration* response) {
  return Calibrate(context, "calibration.CharacteriseAxis", *request, response);
}

grpc::Status CalibrationService::GetCalibration(grpc::ServerContext* context, const v1::GetCalibrationRequest* request,
                                                v1::Calibration* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "calibrations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const auto found = store_->Find(*id, runtime::DeadlineOf(*context));
  if (!found.ok()) return ToGrpc(found.status());
  if (!found->has_value()) return ToGrpc(NotRecorded(request->name()));
  return Answer(ToProto(**found), response);
}

grpc::Status CalibrationService::GetCalibrationInForce(grpc::ServerContext* context,
                                                       const v1::GetCalibrationInForceRequest* request,
                                                       v1::Calibration* response) {
  return Answer(InForce(*store_, runtime::DeadlineOf(*context), *request), response);
}

grpc::Status CalibrationService::ListCalibrations(grpc::ServerContext* context,
                                                  const v1::ListCalibrationsRequest* request,
                                                  v1::ListCalibrationsResponse* response) {
  const absl::StatusOr<storage::CalibrationFilter> filter = FilterOf(*request);
  if (!filter.ok()) return ToGrpc(filter.status());
  // What BASIC leaves out is not read.
  const auto leave_basic = [](v1::Calibration*) {};
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, *filter, ToProto, leave_basic,
                                     response->mutable_calibrations(), response->mutable_next_page_token()));
}

grpc::Status CalibrationService::ReleaseCalibration(grpc::ServerContext* context,
                                                    const v1::ReleaseCalibrationRequest* request,
                                                    v1::Calibration* response) {
  const absl::StatusOr<storage::CalibrationDecision> decision = Decide(*request, runtime::RequestedBy(*context));
  if (!decision.ok()) return ToGrpc(decision.status());
  const absl::StatusOr<storage::CalibrationRow> released = store_->Release(
      runtime::RecordedRequestOf("calibration.ReleaseCalibration", *request, runtime::TraceIdOf(*context)), *decision,
      runtime::DeadlineOf(*context));
  if (!released.ok()) return ToGrpc(released.status());
  return Answer(ToProto(*released), response);
}

grpc::Status CalibrationService::WithdrawCalibration(grpc::ServerContext* context,
                                                     const v1::WithdrawCalibrationRequest* request,
                                                     v1::WithdrawCalibrationResponse* response) {
  if (absl::Status status = CheckRequest(*request); !status.ok()) return ToGrpc(status);
  absl::StatusOr<storage::CalibrationDecision> decision = Decide(*request, runtime::RequestedBy(*context));
  if (!decision.ok()) return ToGrpc(decision.status());
  decision->reader = runtime::ReaderOf(*context);
  const absl::StatusOr<storage::WithdrawnCalibrationRow> withdrawn = store_->Withdraw(
      runtime::RecordedRequestOf("calibration.WithdrawCalibration", *request, runtime::TraceIdOf(*context)), *decision,
      runtime::DeadlineOf(*context));
  if (!withdrawn.ok()) return ToGrpc(withdrawn.status());
  return Answer(ToProto(*withdrawn), response);
}

grpc::Status CalibrationService::GetCalibrationTrend(grpc::ServerContext* context,
                                                     const v1::GetCalibrationTrendRequest* request,
                                                     v1::CalibrationTrend* response) {
  return Answer(Trend(*store_, runtime::DeadlineOf(*context), *request), response);
}

}  // namespace sixpoint::calibration
