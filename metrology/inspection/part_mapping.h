// From a point as the scanner read it to its place in the part as it was registered, and how that follows everything that is uncertain
// (docs/methods/uncertainty.md).
//
// Frames: sensor, machine, zero, part. Units: mm, rad. Pure and thread-safe.
#pragma once

#include <Eigen/Geometry>

#include "metrology/correction/registered_pose.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

// Where a scan's points come from.
struct ScanPlace {
  Eigen::Vector3d v0_mm;
  Eigen::Affine3d part_from_machine, part_from_sensor;  // of readings without the field
  double a_rad, b_rad;                                  // as reached
  double commanded_a_rad, commanded_b_rad;
};

inline constexpr int kMappingInputs = 6 + kCalibrationParameterCount;  // the pose, then what maps a point
// Points that a thread maps at a time: sums do not depend on the number of threads.
inline constexpr std::size_t kMappedAtOnce = 8192;

class PartMapping {
 public:
  // sensor and axes: those that the pose was registered with; the scans' angles are taken by its tables.
  PartMapping(RegisteredPose pose, SensorPose sensor, RotaryAxes axes);

  ScanPlace PlaceOf(const LineScan& scan) const;
  Eigen::Vector3d PartPoint(const Eigen::Vector3d& in_sensor_mm, const ScanPlace& place) const {
    return place.part_from_sensor * sensor_.WithoutField(in_sensor_mm);
  }

  // Part frame, unit.
  Eigen::Vector3d TowardsScanner(const ScanPlace& place) const {
    return (place.part_from_machine.linear() * sensor_.rotation.col(2)).normalized();
  }

  // Change of a point's place in the part per change of the pose, and of the parameters that map it.
  Eigen::Matrix<double, 3, kMappingInputs> Sensitivity(const Eigen::Vector3d& in_part_mm,
                                                       const Eigen::Vector3d& in_sensor_mm,
                                                       const ScanPlace& place) const;
  // The same per radian that each of the pose's angles is taken greater; where the point was scanned at it, directly too.
  Eigen::Matrix3Xd AngleSensitivity(const Eigen::Vector3d& in_part_mm, const ScanPlace& place) const;

  const RegisteredPose& pose() const { return pose_; }

 private:
  RegisteredPose pose_;
  SensorPose sensor_;
  RotaryAxes axes_;
};

}  // namespace sixpoint::metrology
