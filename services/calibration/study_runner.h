// The studies' logic: fetch what a study rests on, compute, store.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "services/calibration/calibrator.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "storage/calibration_store.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

// Thread-safe. Nothing is stored unless all of it is; the same request_id again gives the same answer.
class StudyRunner {
 public:
  StudyRunner(std::shared_ptr<storage::StudyStore> store,
              std::shared_ptr<const storage::CalibrationReader> calibrations, std::shared_ptr<grpc::Channel> plant,
              std::shared_ptr<grpc::Channel> ingest);

  absl::StatusOr<v1::Study> RunGauge(const v1::RunGaugeStudyRequest& request, const Caller& caller);
  absl::StatusOr<v1::Study> RunArm(const v1::RunArmStudyRequest& request, const Caller& caller);
  absl::StatusOr<v1::Study> RunRepeat(const v1::RunRepeatStudyRequest& request, const Caller& caller);
  absl::StatusOr<v1::Study> RunGaugeRr(const v1::RunGaugeRrRequest& request, const Caller& caller);
  absl::StatusOr<v1::Study> RunSphereCheck(const v1::RunSphereCheckRequest& request, const Caller& caller);

 private:
  struct FetchedScans;
  // All of one machine and one artefact, with the same A and B; arm_only: of kind arm.
  absl::StatusOr<FetchedScans> Fetch(const google::protobuf::RepeatedPtrField<std::string>& names, bool arm_only,
                                     const Caller& caller) const;

  // The sensor calibration asked for, or the one in force of the machine.
  absl::StatusOr<storage::CalibrationRow> SensorCalibration(const v1::RunArmStudyRequest& request,
                                                            const std::string& machine, const Caller& caller) const;
  // The studies themselves, of requests that were checked.
  absl::StatusOr<v1::Study> Gauge(const v1::RunGaugeStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<v1::Study> Arm(const v1::RunArmStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<v1::Study> Repeat(const v1::RunRepeatStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<v1::Study> GaugeRr(const v1::RunGaugeRrRequest& request, const Caller& caller) const;
  absl::StatusOr<v1::Study> SphereCheck(const v1::RunSphereCheckRequest& request, const Caller& caller) const;
  // Once for each request_id, with no connection held while it runs.
  template <typename Request>
  absl::StatusOr<v1::Study> Recorded(const char* call, const Request& request, const Caller& caller,
                                     absl::StatusOr<v1::Study> (StudyRunner::*run)(const Request&, const Caller&)
                                         const) const;

  const std::shared_ptr<storage::StudyStore> store_;
  const std::shared_ptr<const storage::CalibrationReader> calibrations_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
};

}  // namespace sixpoint::calibration
