#include "services/correction/machine_axes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {
namespace {

absl::StatusOr<metrology::AxisLine> LineOf(const std::string& field, const plant::v1::Joint& joint) {
  const auto direction = runtime::FromProto(field + ".direction", joint.direction());
  if (!direction.ok()) return direction.status();
  const auto point = runtime::FromProto(field + ".point_mm", joint.point_mm());
  if (!point.ok()) return point.status();
  const double sense = joint.sign() < 0 ? -1.0 : 1.0;
  return metrology::AxisLine{sense * *direction, *point};
}

absl::Status CheckLimits(const std::string& machine, const std::string& field, const plant::v1::Joint& joint) {
  if (std::isfinite(joint.minimum()) && std::isfinite(joint.maximum()) && joint.minimum() < joint.maximum())
    return absl::OkStatus();
  return runtime::Failure(errors::v1::KINEMATICS_UNSUPPORTED,
                          field + ".minimum, maximum: " + NumberText(joint.minimum()) + ", " +
                              NumberText(joint.maximum()) + ", want finite limits in order",
                          {{"resource", machine}});
}

}  // namespace

absl::StatusOr<MachineAxes> AxesOf(const plant::v1::Machine& machine) {
  std::vector<const plant::v1::Joint*> rotary;
  for (const plant::v1::Joint& joint : machine.kinematics().part_side())
    if (joint.kind() == plant::v1::JOINT_KIND_ROTARY) rotary.push_back(&joint);
  int on_tool = 0;
  for (const plant::v1::Joint& joint : machine.kinematics().tool_side())
    on_tool += joint.kind() == plant::v1::JOINT_KIND_ROTARY;
  if (rotary.size() != 2 || on_tool != 0) {
    return runtime::Failure(errors::v1::KINEMATICS_UNSUPPORTED,
                            machine.name() + ".kinematics: " + std::to_string(rotary.size()) +
                                " rotary joints on the part's side and " + std::to_string(on_tool) +
                                " on the tool's, want 2 and 0",
                            {{"resource", machine.name()}});
  }
  MachineAxes axes;
  const auto a = LineOf("machine.kinematics.part_side." + rotary[0]->axis(), *rotary[0]);
  if (!a.ok()) return a.status();
  const auto b = LineOf("machine.kinematics.part_side." + rotary[1]->axis(), *rotary[1]);
  if (!b.ok()) return b.status();
  for (const plant::v1::Joint* joint : rotary) {
    if (absl::Status status = CheckLimits(machine.name(), "machine.kinematics.part_side." + joint->axis(), *joint);
        !status.ok())
      return status;
  }
  axes.nominal = {*a, *b};
  axes.letters = {rotary[0]->axis(), rotary[1]->axis()};
  axes.limits = {rotary[0]->minimum() * runtime::kRadPerDeg, rotary[0]->maximum() * runtime::kRadPerDeg,
                 rotary[1]->minimum() * runtime::kRadPerDeg, rotary[1]->maximum() * runtime::kRadPerDeg};
  return axes;
}

metrology::GateLimits LimitsOf(const plant::v1::Machine& machine) {
  const plant::v1::SafetyEnvelope& envelope = machine.safety_envelope();
  metrology::GateLimits limits;
  limits.translation_mm = envelope.translation_mm();
  limits.rotation_rad = envelope.rotation_deg() * runtime::kRadPerDeg;
  limits.uncertainty_share = envelope.uncertainty_share();
  limits.registration_age_h = envelope.registration_age_h();
  limits.keep_out_mm = envelope.keep_out_mm();
  limits.interim_check_mm = 1e-3 * envelope.interim_check_limit_um();
  return limits;
}

absl::StatusOr<std::vector<metrology::LinearTravel>> TravelOf(const plant::v1::Machine& machine,
                                                              std::optional<double> w_mm) {
  std::vector<metrology::LinearTravel> travel;
  std::optional<metrology::LinearTravel> w;
  for (const bool on_tool : {false, true}) {
    const auto& joints = on_tool ? machine.kinematics().tool_side() : machine.kinematics().part_side();
    for (const plant::v1::Joint& joint : joints) {
      if (joint.kind() != plant::v1::JOINT_KIND_LINEAR) continue;
      const auto direction = runtime::FromProto("machine.kinematics." + joint.axis() + ".direction", joint.direction());
      if (!direction.ok()) return direction.status();
      // A joint under the part moves it the other way.
      const double sense = (joint.sign() < 0 ? -1.0 : 1.0) * (on_tool ? 1.0 : -1.0);
      metrology::LinearTravel one{joint.axis(), sense * *direction, joint.minimum(), joint.maximum()};
      if (joint.axis() == "W")
        w = std::move(one);
      else
        travel.push_back(std::move(one));
    }
  }
  if (!w.has_value()) return travel;
  for (metrology::LinearTravel& axis : travel) {
    // The tip is as far as the axis and W together.
    const double along = axis.direction.dot(w->direction);
    const double one_mm = along * w_mm.value_or(w->minimum_mm), other_mm = along * w_mm.value_or(w->maximum_mm);
    axis.minimum_mm += std::max(one_mm, other_mm);
    axis.maximum_mm += std::min(one_mm, other_mm);
  }
  return travel;
}

}  // namespace sixpoint::correction
