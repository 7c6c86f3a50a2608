#include "metrology/inspection/part_mapping.h"

#include <cmath>
#include <utility>

namespace sixpoint::metrology {

PartMapping::PartMapping(RegisteredPose pose, SensorPose sensor, RotaryAxes axes)
    : pose_(std::move(pose)), sensor_(std::move(sensor)), axes_(axes) {}

ScanPlace PartMapping::PlaceOf(const LineScan& scan) const {
  ScanPlace place;
  place.v0_mm = scan.v0_mm;
  place.a_rad = pose_.positioning.a.Reached(scan.a_rad);
  place.b_rad = pose_.positioning.b.Reached(scan.b_rad);
  place.commanded_a_rad = scan.a_rad;
  place.commanded_b_rad = scan.b_rad;
  place.part_from_machine = pose_.zero_from_part.inverse(Eigen::Isometry) * axes_.Growth(1 / scan.stretch) *
                            axes_.MachineFromZero(place.a_rad, place.b_rad).inverse(Eigen::Isometry);
  place.part_from_sensor = place.part_from_machine * sensor_.MachineFromSensor(place.v0_mm);
  return place;
}

Eigen::Matrix<double, 3, kMappingInputs> PartMapping::Sensitivity(const Eigen::Vector3d& in_part_mm,
                                                                  const Eigen::Vector3d& in_sensor_mm,
                                                                  const ScanPlace& place) const {
  const Eigen::Matrix3d part_from_zero = pose_.zero_from_part.linear().transpose();
  const Eigen::Vector3d in_zero = pose_.zero_from_part * in_part_mm;
  // How the pose moves the point's place in the part, and how its place at `zero` follows what maps it: only their difference shows.
  Eigen::Matrix<double, 3, kMappingInputs> sensitivity;
  sensitivity << -PointJacobian(in_zero, pose_.noise.reference_mm),
      ZeroPointSensitivity(in_sensor_mm, in_zero, place.a_rad, place.b_rad, sensor_, axes_);
  return part_from_zero * sensitivity;
}

Eigen::Matrix3Xd PartMapping::AngleSensitivity(const Eigen::Vector3d& in_part_mm, const ScanPlace& place) const {
  const Eigen::Vector3d in_zero = pose_.zero_from_part * in_part_mm;
  const auto turned = ZeroPointAngleSensitivity(in_zero, place.a_rad, place.b_rad, axes_);
  Eigen::Matrix3Xd sensitivity(3, static_cast<Eigen::Index>(pose_.angles.size()));
  for (std::size_t k = 0; k < pose_.angles.size(); ++k) {
    const AngleInfluence& angle = pose_.angles[k];
    const bool on_a = angle.axis == AngleInfluence::Axis::kA;
    Eigen::Vector3d moved = -PointJacobian(in_zero, pose_.noise.reference_mm) * angle.pose_per_rad;
    const double command_rad = on_a ? place.commanded_a_rad : place.commanded_b_rad;
    if (std::abs(angle.commanded_rad - command_rad) < kSameCommandRad) moved += turned.col(on_a ? 0 : 1);
    sensitivity.col(static_cast<Eigen::Index>(k)) = moved;
  }
  return pose_.zero_from_part.linear().transpose() * sensitivity;
}

}  // namespace sixpoint::metrology
