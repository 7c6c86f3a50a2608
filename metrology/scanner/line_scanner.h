// The sensors' models. A line scanner's sensor frame: x = encoder reading of the profile, (y, z) in the laser plane
// (docs/methods/frames.md, line scanner). A snapshot sensor's: points as they stand.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/calibration_parameters.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/scanner_field.h"

namespace sixpoint::metrology {

// What a sensor's points are.
enum class CloudKind {
  kProfiles,  // of a line scanner, which the encoder carries along machine X
  kSnapshot,  // of a sensor that stood still: in any order, rigidly mapped
};

// One decoded scan; points in the sensor frame, mm, in the order measured.
struct LineScan {
  std::string id;
  Points points_mm;
  Eigen::Vector3d v0_mm = Eigen::Vector3d::Zero();  // machine position at the start of the scan
  double a_rad = 0;
  double b_rad = 0;
  double profile_pitch_mm = 0;  // 0: a snapshot
  // How many times as long as at 20 C what it shows is on the machine's scales. At zero, and in the part, points are as at 20 C.
  double stretch = 1;
};

// p_machine = rotation (0, y, z) + (x, 0, 0) - V0 + t_sm_mm  (CONF 12: the encoder moves along machine X, so a scan of
// a turned sensor is sheared, not only turned). Of a snapshot p_machine = rotation (x, y, z) - V0 + t_sm_mm.
struct SensorPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // R_sm
  Eigen::Vector3d t_sm_mm = Eigen::Vector3d::Zero();
  SensorCovariance covariance = NotYet<SensorCovariance>();             // in the order of kSensorParameters
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  // of the covariance
  ScannerField field = {};
  FieldResponse field_response = FieldResponse::Zero();  // of this calibration
  std::optional<MeasuredField> measured_field = {};      // by it; none: the field was not looked for
  CloudKind cloud = CloudKind::kProfiles;                // of the scans that it maps

  // Where nothing is uncertain, as in a simulation, or nothing is asked of the covariance.
  static SensorPose Exact() {
    SensorPose sensor;
    sensor.covariance.setZero();
    return sensor;
  }

  Eigen::Vector3d MachineFromSensor(const Eigen::Vector3d& p, const Eigen::Vector3d& v0_mm) const {
    if (cloud == CloudKind::kSnapshot) return rotation * p - v0_mm + t_sm_mm;
    return rotation.col(1) * p.y() + rotation.col(2) * p.z() + Eigen::Vector3d(p.x(), 0, 0) - v0_mm + t_sm_mm;
  }
  // The same for every point.
  Eigen::Affine3d MachineFromSensor(const Eigen::Vector3d& v0_mm) const {
    Eigen::Affine3d map;
    map.linear() = rotation;
    if (cloud != CloudKind::kSnapshot) map.linear().col(0) = Eigen::Vector3d::UnitX();
    map.translation() = t_sm_mm - v0_mm;
    return map;
  }
  // Change of the machine point per sensor parameter, in the order of kSensorParameters.
  Eigen::Matrix<double, 3, kSensorParameterCount> ParameterJacobian(const Eigen::Vector3d& p) const {
    Eigen::Matrix<double, 3, kSensorParameterCount> jacobian;
    if (cloud == CloudKind::kSnapshot)
      jacobian << -Skew(rotation * p), Eigen::Matrix3d::Identity();
    else
      jacobian << -Skew(rotation.col(1) * p.y() + rotation.col(2) * p.z()), Eigen::Matrix3d::Identity();
    return jacobian;
  }
  // A reading as it would be without the measured field.
  Eigen::Vector3d WithoutField(const Eigen::Vector3d& p) const {
    if (!measured_field) return p;
    return {p.x(), p.y(), p.z() - field.TermsAt(p.y(), p.z()).dot(measured_field->terms_mm)};
  }
  // The same per field parameter, in the order of kFieldParameters: over the laser plane, or over a snapshot's view.
  Eigen::Matrix<double, 3, kFieldParameterCount> FieldJacobian(const Eigen::Vector3d& p) const {
    const bool is_snapshot = cloud == CloudKind::kSnapshot;
    return rotation.col(2) * (is_snapshot ? field.TermsAt(p.x(), p.y()) : field.TermsAt(p.y(), p.z()));
  }
};

// The scan in machine coordinates.
Points MachineFromSensor(const LineScan& scan, const SensorPose& sensor);

// Change of a scan point at A = B = 0 per calibration parameter.
PointSensitivity ZeroPointSensitivity(const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& zero_mm, double a_rad,
                                      double b_rad, const SensorPose& sensor, const RotaryAxes& axes);
// The same per radian that the scan's a and b are taken greater.
Eigen::Matrix<double, 3, 2> ZeroPointAngleSensitivity(const Eigen::Vector3d& zero_mm, double a_rad, double b_rad,
                                                      const RotaryAxes& axes);

}  // namespace sixpoint::metrology
