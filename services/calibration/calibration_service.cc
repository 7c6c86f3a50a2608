#include "services/calibration/calibration_service.h"

#include <chrono>
#include <string>

#include "services/calibration/calibration_messages.h"
#include "services/calibration/calibration_states.h"
#include "services/calibration/calibration_trend.h"
#include "services/calibration/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {
namespace {

using runtime::ToGrpc;

Caller CallerOf(const grpc::ServerContext* context) {
  return {runtime::DeadlineOf(*context), [context] { return runtime::ContextFor(*context); },
          runtime::KeepGoing(*context)};
}

template <typename Response>
grpc::Status Answer(absl::StatusOr<Response> result, Response* response) {
  if (result.ok()) *response = *std::move(result);
  return ToGrpc(result.status());
}

// "sensor calibration", "characterisation of axis A".
std::string Described(const storage::CalibrationSubject& subject) {
  return subject.kind == "axis" ? "characterisation of axis " + subject.axis : subject.kind + " calibration";
}

absl::StatusOr<v1::Calibration> InForce(storage::Database* database, storage::Deadline deadline,
                                        const v1::GetCalibrationInForceRequest& request) {
  const absl::StatusOr<storage::CalibrationSubject> subject =
      SubjectOf(request.machine(), request.kind(), request.axis());
  if (!subject.ok()) return subject.status();
  absl::StatusOr<storage::Instant> at = std::chrono::system_clock::now();
  if (request.has_at()) at = InstantOf("at", request.at());
  if (!at.ok()) return at.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const auto found = storage::CalibrationInForce(*transaction, *subject, *at);
  if (!found.ok()) return found.status();
  if (found->has_value()) return ToProto(**found);
  const auto withdrawn = storage::WithdrawnCalibration(*transaction, *subject, *at);
  if (!withdrawn.ok()) return withdrawn.status();
  if (withdrawn->has_value())
    return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                            request.machine() + ": its " + Described(*subject) + " " + (**withdrawn).name() +
                                " was withdrawn (" + (**withdrawn).withdrawal->reason +
                                "), want one in force; calibrate",
                            {{"resource", request.machine()}});
  const auto ended = storage::LastValidity(*transaction, *subject, *at);
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

absl::StatusOr<v1::ListCalibrationsResponse> List(storage::Database* database, storage::Deadline deadline,
                                                  const v1::ListCalibrationsRequest& request) {
  const absl::StatusOr<storage::CalibrationSubject> filter =
      FilterOf(request.machine(), request.kind(), request.axis());
  if (!filter.ok()) return filter.status();
  const std::string filters = filter->machine_id + "|" + filter->kind + "|" + filter->axis;
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows = storage::ListCalibrations(*transaction, *filter, page->before_sequence, page->size + 1);
  if (!rows.ok()) return rows.status();
  v1::ListCalibrationsResponse response;
  for (const storage::CalibrationRow& row : *rows) {
    if (response.calibrations_size() == page->size) {
      const std::int64_t last_sequence = response.calibrations(page->size - 1).record_sequence();
      response.set_next_page_token(runtime::TokenAfter(filters, last_sequence));
      break;
    }
    *response.add_calibrations() = ToProto(row);
  }
  return response;
}

}  // namespace

CalibrationService::CalibrationService(storage::Database* database, std::shared_ptr<grpc::Channel> plant,
                                       std::shared_ptr<grpc::Channel> ingest, int threads)
    : database_(database), calibrator_(database, std::move(plant), std::move(ingest), threads) {}

grpc::Status CalibrationService::CalibrateSensor(grpc::ServerContext* context,
                                                 const v1::CalibrateSensorRequest* request, v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateSensor(*request, CallerOf(context)), response);
}

grpc::Status CalibrationService::CalibrateRotation(grpc::ServerContext* context,
                                                   const v1::CalibrateRotationRequest* request,
                                                   v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateRotation(*request, CallerOf(context)), response);
}

grpc::Status CalibrationService::GetCalibration(grpc::ServerContext* context, const v1::GetCalibrationRequest* request,
                                                v1::Calibration* response) {
  const absl::StatusOr<std::string> id = CalibrationIdOf("name", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const auto found = storage::FindCalibration(*transaction, *id);
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
  return Answer(InForce(database_, runtime::DeadlineOf(*context), *request), response);
}

grpc::Status CalibrationService::ListCalibrations(grpc::ServerContext* context,
                                                  const v1::ListCalibrationsRequest* request,
                                                  v1::ListCalibrationsResponse* response) {
  absl::StatusOr<v1::ListCalibrationsResponse> page = List(database_, runtime::DeadlineOf(*context), *request);
  if (page.ok()) *response = *std::move(page);
  return ToGrpc(page.status());
}

grpc::Status CalibrationService::CalibrateProbe(grpc::ServerContext* context, const v1::CalibrateProbeRequest* request,
                                                v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CalibrateProbe(*request, CallerOf(context)), response);
}

grpc::Status CalibrationService::CharacteriseAxis(grpc::ServerContext* context,
                                                  const v1::CharacteriseAxisRequest* request,
                                                  v1::Calibration* response) {
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return Answer(calibrator_.CharacteriseAxis(*request, CallerOf(context)), response);
}

grpc::Status CalibrationService::ReleaseCalibration(grpc::ServerContext* context,
                                                    const v1::ReleaseCalibrationRequest* request,
                                                    v1::Calibration* response) {
  return Answer(Release(database_, runtime::DeadlineOf(*context), *request), response);
}

grpc::Status CalibrationService::WithdrawCalibration(grpc::ServerContext* context,
                                                     const v1::WithdrawCalibrationRequest* request,
                                                     v1::WithdrawCalibrationResponse* response) {
  absl::StatusOr<v1::WithdrawCalibrationResponse> done = Withdraw(database_, runtime::DeadlineOf(*context), *request);
  if (done.ok()) *response = *std::move(done);
  return ToGrpc(done.status());
}

grpc::Status CalibrationService::GetCalibrationTrend(grpc::ServerContext* context,
                                                     const v1::GetCalibrationTrendRequest* request,
                                                     v1::CalibrationTrend* response) {
  absl::StatusOr<v1::CalibrationTrend> trend = TrendOf(database_, runtime::DeadlineOf(*context), *request);
  if (trend.ok()) *response = *std::move(trend);
  return ToGrpc(trend.status());
}

}  // namespace sixpoint::calibration
