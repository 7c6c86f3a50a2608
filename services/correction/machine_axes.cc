#include "services/correction/machine_axes.h"

#include <cmath>
#include <vector>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::correction {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

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
  axes.limits = {rotary[0]->minimum() * kRad, rotary[0]->maximum() * kRad, rotary[1]->minimum() * kRad,
                 rotary[1]->maximum() * kRad};
  return axes;
}

metrology::SafetyEnvelope EnvelopeOf(const plant::v1::Machine& machine) {
  metrology::SafetyEnvelope envelope;
  if (machine.safety_envelope().translation_mm() > 0)
    envelope.translation_mm = machine.safety_envelope().translation_mm();
  if (machine.safety_envelope().rotation_deg() > 0)
    envelope.rotation_rad = machine.safety_envelope().rotation_deg() * kRad;
  return envelope;
}

}  // namespace sixpoint::correction
