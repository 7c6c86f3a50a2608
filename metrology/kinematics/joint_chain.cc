#include "metrology/kinematics/joint_chain.h"

#include <cmath>
#include <set>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

absl::Status CheckJoint(const Joint& joint, std::set<std::string>* axes) {
  const auto refuse = [&](const std::string& field, const std::string& value, const std::string& wanted) {
    return Refuse("joint " + joint.axis + field, value, wanted);
  };
  if (joint.axis.empty() || !axes->insert(joint.axis).second)
    return refuse(".axis", joint.axis, "a letter that no other joint has");
  const AxisLine& line = joint.motion.line;
  if (!(std::abs(line.direction.norm() - 1) <= 1e-6))
    return refuse(".direction", "length " + Rounded(line.direction.norm()), "length 1");
  if (!line.point_mm.allFinite()) return refuse(".point_mm", "not finite", "a point");
  if (joint.sign != 1 && joint.sign != -1) return refuse(".sign", Rounded(joint.sign), "+1 or -1");
  if (!(joint.minimum < joint.maximum))
    return refuse(".minimum, .maximum", Rounded(joint.minimum) + ", " + Rounded(joint.maximum), "limits in order");
  if (!joint.table) return absl::OkStatus();
  if (joint.motion.kind != JointKind::kRotary)
    return refuse(".angle_table", "on a linear joint", "one on a rotary joint");
  return joint.table->Check();
}

Eigen::Isometry3d Along(const Eigen::Vector3d& shift_mm) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translation() = shift_mm;
  return result;
}

// On the stack: kernels ask for many points.
using CarriedColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMostJoints>;

// p as each joint meets it: carried by all joints farther out.
CarriedColumns CarriedPoints(const JointMotion* joints, const double* positions, int count, const Eigen::Vector3d& p) {
  CarriedColumns points(3, count);
  Eigen::Vector3d q = p;
  for (int i = count - 1; i >= 0; --i) {
    points.col(i) = q;
    if (i > 0) q = joints[i].At(positions[i]) * q;
  }
  return points;
}

}  // namespace

Eigen::Isometry3d JointMotion::At(double position) const {
  return kind == JointKind::kRotary ? AboutLine(line, position) : Along(position * line.direction);
}

Eigen::Isometry3d Carry(const JointMotion* joints, const double* positions, int count) {
  if (count == 0) return Eigen::Isometry3d::Identity();
  Eigen::Isometry3d result = joints[0].At(positions[0]);
  for (int i = 1; i < count; ++i) result = result * joints[i].At(positions[i]);
  return result;
}

void CarryParameterJacobian(const JointMotion* joints, const double* positions, int count, const Eigen::Vector3d& p,
                            Eigen::Ref<Eigen::Matrix3Xd> jacobian) {
  const CarriedColumns points = CarriedPoints(joints, positions, count, p);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // of the joints before
  int column = 0;
  for (int i = 0; i < count; ++i) {
    const JointMotion& joint = joints[i];
    if (joint.kind == JointKind::kRotary)
      jacobian.middleCols<4>(column) = turn * LineJacobian(joint.line, points.col(i), positions[i]);
    else
      jacobian.middleCols<2>(column) = turn * (positions[i] * TangentBasis(joint.line.direction));
    column += joint.ParameterCount();
    turn = turn * joint.At(positions[i]).linear();
  }
}

void CarryPositionJacobian(const JointMotion* joints, const double* positions, int count, const Eigen::Vector3d& p,
                           Eigen::Ref<Eigen::Matrix3Xd> jacobian) {
  const CarriedColumns points = CarriedPoints(joints, positions, count, p);
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  for (int i = 0; i < count; ++i) {
    const AxisLine& line = joints[i].line;
    const Eigen::Matrix3d own = joints[i].At(positions[i]).linear();
    jacobian.col(i) = joints[i].kind == JointKind::kRotary
                          ? Eigen::Vector3d(turn * line.direction.cross(own * (points.col(i) - line.point_mm)))
                          : Eigen::Vector3d(turn * line.direction);
    turn = turn * own;
  }
}

absl::StatusOr<JointChain> JointChain::Make(std::vector<Joint> part_side, std::vector<Joint> tool_side) {
  JointChain chain;
  chain.part_size_ = static_cast<int>(part_side.size());
  chain.joints_ = std::move(part_side);
  for (Joint& joint : tool_side) chain.joints_.push_back(std::move(joint));
  if (chain.size() > kMostJoints)
    return Refuse("joints", std::to_string(chain.size()) + " of them", "at most " + std::to_string(kMostJoints));
  std::set<std::string> axes;
  for (int i = 0; i < chain.size(); ++i) {
    const Joint& joint = chain.joints_[static_cast<size_t>(i)];
    if (absl::Status s = CheckJoint(joint, &axes); !s.ok()) return s;
    JointMotion motion = joint.motion;
    motion.line.direction = joint.sign < 0 ? Eigen::Vector3d(-motion.line.direction) : motion.line.direction;
    chain.motions_.push_back(motion);
  }
  return chain;
}

std::optional<int> JointChain::Find(const std::string& axis) const {
  for (int i = 0; i < size(); ++i)
    if (joints_[static_cast<size_t>(i)].axis == axis) return i;
  return std::nullopt;
}

std::vector<int> JointChain::PartSideRotary() const {
  std::vector<int> found;
  for (int i = 0; i < part_size_; ++i)
    if (joints_[static_cast<size_t>(i)].motion.kind == JointKind::kRotary) found.push_back(i);
  return found;
}

absl::Status JointChain::CheckLimits(const Eigen::VectorXd& positions) const {
  if (positions.size() != size())
    return Refuse("positions", std::to_string(positions.size()) + " values",
                  std::to_string(size()) + ", one for each joint");
  for (int i = 0; i < size(); ++i) {
    const Joint& joint = joints_[static_cast<size_t>(i)];
    const bool rotary = joint.motion.kind == JointKind::kRotary;
    const double unit = rotary ? kDegPerRad : 1;
    const std::string name = rotary ? " deg" : " mm";
    if (!std::isfinite(positions(i))) return Refuse(joint.axis, Rounded(positions(i)) + name, "a number");
    // Limits come from degrees: what is at a limit is within it.
    constexpr double kRounding = 1e-12;
    if (positions(i) < joint.minimum - kRounding || positions(i) > joint.maximum + kRounding)
      return absl::OutOfRangeError(joint.axis + ": " + Rounded(positions(i) * unit) + name + ", want " +
                                   Rounded(joint.minimum * unit) + " to " + Rounded(joint.maximum * unit) + name);
  }
  return absl::OkStatus();
}

Eigen::VectorXd JointChain::Reached(const Eigen::VectorXd& commanded, const std::vector<Travel>& travel) const {
  Eigen::VectorXd reached = commanded;
  for (int i = 0; i < size(); ++i)
    if (const auto& table = joints_[static_cast<size_t>(i)].table)
      reached(i) = table->Reached(commanded(i), travel.empty() ? Travel::kUnknown : travel.at(static_cast<size_t>(i)));
  return reached;
}

Eigen::Isometry3d JointChain::MachineFromZero(const Eigen::VectorXd& positions) const {
  return Carry(motions_.data(), positions.data(), part_size_);
}

Eigen::Isometry3d JointChain::MachineFromTool(const Eigen::VectorXd& positions) const {
  return Carry(motions_.data() + part_size_, positions.data() + part_size_, size() - part_size_);
}

Eigen::Isometry3d JointChain::ZeroFromTool(const Eigen::VectorXd& positions) const {
  return MachineFromZero(positions).inverse() * MachineFromTool(positions);
}

}  // namespace sixpoint::metrology
