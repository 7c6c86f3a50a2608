// The studies' logic: fetch what a study rests on, compute, store.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "services/calibration/calibrator.h"
#include "sixpoint/calibration/v1/study.pb.h"

namespace sixpoint::calibration {

// Thread-safe. Nothing is stored unless all of it is; the same request_id again gives the same answer.
class StudyRunner {
 public:
  StudyRunner(storage::Database* database, std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest);

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

  storage::Database* database_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
};

}  // namespace sixpoint::calibration
