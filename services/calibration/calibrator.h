// The service's logic: fetch what a calibration rests on, compute, store.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/calibration/rotation_calibration.h"
#include "services/calibration/probe_messages.h"
#include "services/calibration/validate.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "services/runtime/call.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

using runtime::Caller;

// Thread-safe.
class Calibrator {
 public:
  Calibrator(std::shared_ptr<storage::CalibrationStore> store, std::shared_ptr<grpc::Channel> plant,
             std::shared_ptr<grpc::Channel> ingest, int threads);

  // Nothing is stored unless all of it is. The same request_id again gives the same answer.
  absl::StatusOr<v1::Calibration> CalibrateSensor(const v1::CalibrateSensorRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CalibrateRotation(const v1::CalibrateRotationRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CalibrateProbe(const v1::CalibrateProbeRequest& request, const Caller& caller);
  absl::StatusOr<v1::Calibration> CharacteriseAxis(const v1::CharacteriseAxisRequest& request, const Caller& caller);

 private:
  template <typename Request, typename Make>
  absl::StatusOr<v1::Calibration> Recorded(const char* call, const Request& request, const Caller& caller,
                                           const Make& make) const;
  // What is recorded of a request that was checked.
  absl::StatusOr<storage::CalibrationRow> MakeSensor(const v1::CalibrateSensorRequest& request,
                                                     const metrology::ArtefactTouch& touch, const Validity& validity,
                                                     const Caller& caller) const;
  absl::StatusOr<storage::CalibrationRow> MakeRotation(const v1::CalibrateRotationRequest& request,
                                                       const std::vector<metrology::SpherePose>& poses,
                                                       const Validity& validity, const Caller& caller) const;
  absl::StatusOr<storage::CalibrationRow> MakeProbe(const v1::CalibrateProbeRequest& request, const ProbeInputs& inputs,
                                                    const Validity& validity, const Caller& caller) const;
  absl::StatusOr<storage::CalibrationRow> MakeAxis(const v1::CharacteriseAxisRequest& request,
                                                   const std::vector<metrology::AxisReading>& readings,
                                                   const Validity& validity, const Caller& caller) const;

  const std::shared_ptr<storage::CalibrationStore> store_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
  int threads_;
};

}  // namespace sixpoint::calibration
