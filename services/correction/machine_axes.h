// The rotary axes of a machine record: nominal lines and limits.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/keep_out.h"
#include "metrology/correction/orientation.h"
#include "metrology/correction/release_gate.h"
#include "metrology/kinematics/rotary_axes.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::correction {

struct MachineAxes {
  metrology::RotaryAxes nominal;  // directions with their sense: a positive command turns positively about them
  metrology::RotaryLimits limits;
  std::array<std::string, 2> letters;  // of the axis on the bed and of the one that it carries
};

// FAILED_PRECONDITION (KINEMATICS_UNSUPPORTED) unless the part's side of the chain has exactly two rotary joints, the
// outer first, and the tool's side none.
absl::StatusOr<MachineAxes> AxesOf(const plant::v1::Machine& machine);

// What its record asks of a correction that is to be used without a person looking at it.
metrology::GateLimits LimitsOf(const plant::v1::Machine& machine);
// Of the linear joints that the record has, but of W, which stands at w_mm (none: anywhere in its travel) and takes its part of the way from
// the axes along it; none: travel is not asked.
absl::StatusOr<std::vector<metrology::LinearTravel>> TravelOf(const plant::v1::Machine& machine,
                                                              std::optional<double> w_mm);

}  // namespace sixpoint::correction
