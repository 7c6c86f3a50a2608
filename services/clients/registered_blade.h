// A registered blade as kernels take it: all that its registration names, fetched and checked.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/registered_pose.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/surface/surface.h"
#include "services/clients/blade_peers.h"
#include "services/clients/calibrations.h"
#include "services/runtime/call.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::clients {

struct RegisteredBlade {
  registration::v1::Registration registration;
  std::optional<metrology::RegisteredPose> pose;  // once fetched
  FetchedSensorCalibration sensor_calibration;
  metrology::SensorPose sensor;  // of it
  metrology::RotaryAxes axes;
  plant::v1::Machine machine;
  plant::v1::Part part;
  std::shared_ptr<const metrology::Surface> surface;
};

// All but the surface, which takes longest, follows from blade->registration. FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED.
absl::Status FetchRegistered(const BladePeers& peers, const runtime::Caller& caller, RegisteredBlade* blade);
absl::Status FetchSurface(const BladePeers& peers, const runtime::Caller& caller, RegisteredBlade* blade);

// Both, of the registration of that name. is_new: the scanner must not have moved since it was calibrated, as was known when the scans were
// received.
absl::Status FetchWhole(const BladePeers& peers, const std::string& registration, bool is_new,
                        const runtime::Caller& caller, RegisteredBlade* blade);

// take(scan): its blocks whole and checked, not decoded yet; its stretch is known. One after the other, the next is fetched meanwhile.
absl::Status ForEachScan(const ScanClient& scans, const RegisteredBlade& blade, const runtime::Caller& caller,
                         const std::function<absl::Status(int index, const StoredBlocks& scan)>& take);

}  // namespace sixpoint::clients
