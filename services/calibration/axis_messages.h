// Encoder runs into what the kernel takes, and characterisations between kernel results, rows and messages.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/kinematics/joint_chain.h"
#include "sixpoint/calibration/v1/axis.pb.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

metrology::Travel TravelFrom(v1::Travel travel);

absl::Status CheckAxisRequest(const v1::CharacteriseAxisRequest& request);
absl::StatusOr<std::vector<metrology::AxisReading>> ReadingsOf(const v1::AxisRun& run);
// The machine's rotary joint of that letter; refuses others.
absl::StatusOr<metrology::Joint> JointOf(const std::string& machine, const metrology::JointChain& chain,
                                         const std::string& axis);
// Readings that were commanded beyond the joint's limits: an encoder run wants a whole turn, for which a tilting axis has
// its limits lifted.
int BeyondLimits(const v1::AxisRun& run, const metrology::Joint& joint);

storage::AxisCharacterisationRow RowOf(const metrology::AxisCharacterisation& result, const std::string& axis);
// The table only where the row has it.
v1::AxisCharacterisation ToProto(const storage::AxisCharacterisationRow& row);
metrology::AngleTable TableOf(const storage::AxisCharacterisationRow& row);

}  // namespace sixpoint::calibration
