// A registration as kernels take it: the pose with all that made it uncertain.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metrology/correction/registered_pose.h"
#include "metrology/scanner/line_scanner.h"
#include "services/clients/calibrations.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::clients {

// FAILED_PRECONDITION (REGISTRATION_NOT_CONVERGED), with the registration's evidence, unless its outcome is CONVERGED.
absl::Status CheckConverged(const registration::v1::Registration& registration);

// sensor and rotation: the calibrations that the registration names; tables: those of its angles; machine: its own, of then. Refuses what is missing or
// not finite.
absl::StatusOr<metrology::RegisteredPose> RegisteredPoseOf(const registration::v1::Registration& registration,
                                                           const metrology::SensorPose& sensor,
                                                           const FetchedRotationCalibration& rotation,
                                                           const std::vector<FetchedAxis>& tables,
                                                           const plant::v1::Machine& machine);

// The characterisations whose tables the registration applied, each once.
absl::StatusOr<std::vector<FetchedAxis>> TablesOf(const registration::v1::Registration& registration,
                                                  const CalibrationClient& calibrations,
                                                  const std::function<std::unique_ptr<grpc::ClientContext>()>& context);

}  // namespace sixpoint::clients
