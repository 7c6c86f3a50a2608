// Encoder runs into what the kernel takes, and characterisations between kernel results, rows and messages.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/kinematics/joint_chain.h"
#include "sixpoint/calibration/v1/axis.pb.h"
#include "storage/axis_characterisations.h"

namespace sixpoint::calibration {

metrology::Travel TravelFrom(v1::Travel travel);

absl::Status CheckAxisRequest(const v1::CharacteriseAxisRequest& request);
absl::StatusOr<std::vector<metrology::AxisReading>> ReadingsOf(const v1::AxisRun& run);
// The axis is a rotary joint of the machine.
absl::Status CheckAxisOf(const std::string& machine, const metrology::JointChain& chain, const std::string& axis);

storage::AxisCharacterisationRow RowOf(const metrology::AxisCharacterisation& result);
v1::AxisCharacterisation ToProto(const storage::AxisCharacterisationRow& row);
metrology::AngleTable TableOf(const storage::AxisCharacterisationRow& row);
// A few figures for the journal, as JSON.
std::string SummaryOf(const storage::AxisCharacterisationRow& row);

}  // namespace sixpoint::calibration
