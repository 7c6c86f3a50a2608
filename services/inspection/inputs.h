// What an inspection rests on, fetched and checked, and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/registered_pose.h"
#include "metrology/inspection/blade_inspection.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/surface/surface.h"
#include "services/clients/calibrations.h"
#include "services/inspection/peers.h"
#include "services/inspection/positioning.h"
#include "services/runtime/call.h"
#include "sixpoint/inspection/v1/inspection.pb.h"

namespace sixpoint::inspection {

struct Inputs {
  registration::v1::Registration registration;  // converged
  Compared compared;
  std::optional<metrology::RegisteredPose> pose;  // once fetched
  clients::FetchedSensorCalibration sensor_calibration;
  metrology::SensorPose sensor;  // of it
  metrology::RotaryAxes axes;
  plant::v1::Machine machine;
  plant::v1::Part part;
  std::vector<metrology::InspectedHole> holes;
  std::shared_ptr<const metrology::Surface> surface;
};

// FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED, PART_WITHOUT_HOLES; what the registration service refuses is
// passed on. INVALID_ARGUMENT for a scan of another blade or kind.
absl::StatusOr<Inputs> FetchInputs(const Peers& peers, const v1::InspectRequest& request,
                                   const runtime::Caller& caller);
// What a recorded one was judged from, whatever became of it since.
absl::StatusOr<Inputs> FetchAsRecorded(const Peers& peers, const v1::Inspection& recorded,
                                       const runtime::Caller& caller);
// Of all registrations that it rests on.
absl::StatusOr<std::vector<replay::v1::Replay>> ReplayRegistrations(const Peers& peers, const v1::Inspection& recorded,
                                                                    const runtime::Caller& caller);

}  // namespace sixpoint::inspection
