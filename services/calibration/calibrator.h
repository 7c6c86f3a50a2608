// The service's logic: fetch what a calibration rests on, compute, store.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>

#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/database.h"

namespace sixpoint::calibration {

// One call: its deadline, its cancellation and contexts for the calls it makes.
struct Caller {
  storage::Deadline deadline;
  std::function<std::unique_ptr<grpc::ClientContext>()> make_context;
  std::function<bool()> keep_going;
};

// Thread-safe.
class Calibrator {
 public:
  Calibrator(storage::Database* database, std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest,
             int threads);

  // Nothing is stored unless all of it is. The same request_id again gives the same answer.
  absl::StatusOr<v1::Calibration> CalibrateSensor(const v1::CalibrateSensorRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CalibrateRotation(const v1::CalibrateRotationRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CalibrateProbe(const v1::CalibrateProbeRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CharacteriseAxis(const v1::CharacteriseAxisRequest& request, const Caller& caller);

 private:
  storage::Database* database_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
  int threads_;
};

}  // namespace sixpoint::calibration
