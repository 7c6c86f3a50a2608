#include "services/runtime/machine_chain.h"

#include <cmath>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::runtime {
namespace {

absl::Status Unsuitable(const plant::v1::Machine& machine, const absl::Status& status) {
  return Failure(errors::v1::KINEMATICS_UNSUITABLE, machine.name() + ".kinematics: " + std::string(status.message()),
                 {{"resource", machine.name()}});
}

absl::StatusOr<metrology::Joint> JointOf(const plant::v1::Machine& machine, const plant::v1::Joint& in) {
  if (in.kind() != plant::v1::JOINT_KIND_LINEAR && in.kind() != plant::v1::JOINT_KIND_ROTARY)
    return Refuse("joint " + in.axis() + ".kind", std::to_string(in.kind()), "linear or rotary");
  const bool rotary = in.kind() == plant::v1::JOINT_KIND_ROTARY;
  const std::string field = "joint " + in.axis();
  const absl::StatusOr<Eigen::Vector3d> direction = FromProto(field + ".direction", in.direction());
  if (!direction.ok()) return direction.status();
  const absl::StatusOr<Eigen::Vector3d> point =
      FromProto(field + ".point_mm", in.has_point_mm() ? in.point_mm() : machine.nominal_centre_mm());
  if (!point.ok()) return point.status();
  metrology::Joint joint;
  joint.axis = in.axis();
  joint.motion = {rotary ? metrology::JointKind::kRotary : metrology::JointKind::kLinear, {*direction, *point}};
  joint.sign = in.sign();
  if (in.minimum() != 0 || in.maximum() != 0) {
    joint.minimum = in.minimum() * (rotary ? kRadPerDeg : 1);
    joint.maximum = in.maximum() * (rotary ? kRadPerDeg : 1);
  }
  return joint;
}

}  // namespace

absl::StatusOr<metrology::JointChain> ChainOf(const plant::v1::Machine& machine) {
  std::vector<metrology::Joint> part_side, tool_side;
  for (const auto& [joints, out] : {std::pair{&machine.kinematics().part_side(), &part_side},
                                    std::pair{&machine.kinematics().tool_side(), &tool_side}})
    for (const plant::v1::Joint& in : *joints) {
      absl::StatusOr<metrology::Joint> joint = JointOf(machine, in);
      if (!joint.ok()) return Unsuitable(machine, joint.status());
      out->push_back(*std::move(joint));
    }
  absl::StatusOr<metrology::JointChain> chain = metrology::JointChain::Make(std::move(part_side), std::move(tool_side));
  if (!chain.ok()) return Unsuitable(machine, chain.status());
  return chain;
}

}  // namespace sixpoint::runtime
