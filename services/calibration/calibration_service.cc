#include "services/calibration/calibration_service.h"

#include <chrono>
#include <string>
#include <utility>

#include "services/calibration/calibration_messages.h"
#include "services/calibration/calibration_states.h"
#include "services/calibration/calibration_trend.h"
#include "services/calibration/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::ToGrpc;

using runtime::Answer;
using runtime::CallerOf;

// "sensor calibration", "characterisation of axis A".
std::string Described(const storage::CalibrationSubject& subject) {
  return subject.kind == "axis" ? "characterisation of axis " + subject.axis : subject.kind + " calibration";
}

absl::StatusOr<v1::Calibration> InForce(const storage::CalibrationReader& calibrations, storage::Deadline deadline,
                                        const v1::GetCalibrationInForceRequest& request) {
  const absl::StatusOr<storage::CalibrationSubject> subject =
      SubjectOf(request.machine(), request.kind(), request.axis());
  if (!subject.ok()) return subject.status();
  absl::StatusOr<storage::Instant> at = std::chrono::system_clock::now();
  if (request.has_at()) at = InstantOf("at", request.at());
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

}  // namespace

CalibrationService::CalibrationService(std::shared_ptr<storage::CalibrationStore> store,
                                       std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest,
                                       int threads)
    : store_(store), calibrator_(std::move(store), std::move(plant), std::move(ingest), threads) {}

grpc::Status CalibrationService::CalibrateSensor(grpc::ServerContext* context,
                                                 const v1::CalibrateSensorRequest* request, v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateSensor(*request, CallerOf(*context)), response);
}

grpc::Status CalibrationService::CalibrateRotation(grpc::ServerContext* context,
                                                   const v1::CalibrateRotationRequest* request,
                                                   v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateRotation(*request, CallerOf(*context)), response);
}

grpc::Status CalibrationService::GetCalibration(grpc::ServerContext* context, const v1::GetCalibrationRequest* request,
                                                v1::Calibration* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "calibrations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  const auto found = store_->Find(*id, runtime::DeadlineOf(*context));
  if (!found.ok()) return ToGrpc(found.status());
  if (!found->has_value())
    return ToGrpc(runtime::Failure(errors::v1::CALIBRATION_NOT_FOUND,
                                   "name: " + request->name() + ", want a calibration that is recorded",
                                   {{"resource", request->name()}}));
  *response = ToProto(**found);
  return grpc::Status::OK;
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
  return ToGrpc(runtime::ListResults(
      *store_, runtime::DeadlineOf(*context), *request, *filter,
      [](const storage::CalibrationRow& row) -> absl::StatusOr<v1::Calibration> { return ToProto(row); }, leave_basic,
      response->mutable_calibrations(), response->mutable_next_page_token()));
}

grpc::Status CalibrationService::CalibrateProbe(grpc::ServerContext* context, const v1::CalibrateProbeRequest* request,
                                                v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateProbe(*request, CallerOf(*context)), response);
}

grpc::Status CalibrationService::CharacteriseAxis(grpc::ServerContext* context,
                                                  const v1::CharacteriseAxisRequest* request,
                                                  v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CharacteriseAxis(*request, CallerOf(*context)), response);
}

grpc::Status CalibrationService::ReleaseCalibration(grpc::ServerContext* context,
                                                    const v1::ReleaseCalibrationRequest* request,
                                                    v1::Calibration* response) {
  return Answer(Release(*store_, runtime::DeadlineOf(*context), *request), response);
}

grpc::Status CalibrationService::WithdrawCalibration(grpc::ServerContext* context,
                                                     const v1::WithdrawCalibrationRequest* request,
                                                     v1::WithdrawCalibrationResponse* response) {
  return Answer(Withdraw(*store_, runtime::DeadlineOf(*context), *request), response);
}

grpc::Status CalibrationService::GetCalibrationTrend(grpc::ServerContext* context,
                                                     const v1::GetCalibrationTrendRequest* request,
                                                     v1::CalibrationTrend* response) {
  return Answer(TrendOf(*store_, runtime::DeadlineOf(*context), *request), response);
}

}  // namespace sixpoint::calibration
