// A plant whose errors are drawn: a scanner on an arm that swings, calibrated on a touched plate. What the scanner's field really is has
// nothing of the polynomials that the estimator knows.
#pragma once

#include <absl/status/statusor.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <random>
#include <utility>

#include "metrology/frames/angles.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/studies/arm_study.h"

namespace sixpoint::bench {

using metrology::kRadPerDeg;
using metrology::Matrix6d;
using metrology::SensorPose;
using metrology::Vector6d;

inline constexpr double kMid_mm = 66, kRange_mm = 25, kLine_rad = 20 * kRadPerDeg;

// Standard deviations; 0: that source is not there.
struct WorldErrors {
  double noise_mm = 0;
  double touch_offset_mm = 0;
  double field_mm = 0;
  double flatness_mm = 5e-4;  // of the plate that the field is looked for with
  double arm_mm = 0, arm_rad = 0;
  int arm_scans = 0;  // that its spread is learnt from; 0: it is known
  double axes_mm = 0, axes_rad = 0;
  int axes_freedom = 0;  // of what is stated of the axes; 0: it is known
  bool field_is_harsh = true;
  double scale_ratio = 0, squareness_ratio = 0;  // of the linear axes, mm in a mm
  double tool_offset_mm = 0;
  // The blade is warmer than 20 C by this. Measured by a thermometer of that standard deviation, of a material known so well; or not
  // measured, and known to be within the half range, anywhere in which it is then drawn.
  double warmer_k = 0, thermometer_k = 0, coefficient_per_k = 0, half_range_k = 0;
};

struct Draws {
  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  double operator()(double sigma) { return sigma > 0 ? sigma * normal(random) : 0; }
  Eigen::Vector3d Vector(double sigma) { return {(*this)(sigma), (*this)(sigma), (*this)(sigma)}; }
};

// As it is bought: where it should stand, and its measuring field.
SensorPose DesignedSensor();

// How far a reading is off along z: three waves across the measuring field, none shorter than it, of root mean square sigma.
using Field = std::function<double(double y, double z)>;
Field DrawField(const WorldErrors& errors, Draws* draw);

SensorPose Swung(const SensorPose& mean, const Vector6d& by);
// Where the arm stands, once swung, from where it stands on the mean: rotation vector, translation.
Vector6d DrawArm(const WorldErrors& errors, Draws* draw);
// Its spread, known or learnt from scans with the arm swung between.
metrology::ArmSpread LearntSpread(const WorldErrors& errors, Draws* draw);
// What the linear axes truly do where they read 1: scales and squareness.
Eigen::Matrix3d DrawLinearAxes(const WorldErrors& errors, Draws* draw);

// What the scanner reads of a true machine point. linear: what the axes do where they read 1.
Eigen::Vector3d Read(const SensorPose& sensor, const Eigen::Matrix3d& linear, const Eigen::Vector3d& machine_mm,
                     const Eigen::Vector3d& v0_mm, const Field& field, double noise_mm, Draws* draw);

struct Calibrated {
  SensorPose sensor;
  metrology::FieldResponse response;
};
// Least squares onto the plate as it was touched, at three heights of the line, from the design on; the field is looked for where it is
// stated and not known. elsewhere_mm: how far the plate stands from its usual place in the measuring field.
Calibrated Calibrate(const SensorPose& design, const SensorPose& truth, const Eigen::Matrix3d& linear,
                     const Field& field, const WorldErrors& errors, const Eigen::Vector3d& touch_offset_mm, Draws* draw,
                     const Eigen::Vector3d& elsewhere_mm = Eigen::Vector3d::Zero(),
                     const std::optional<metrology::MeasuredField>& known_field = {});

// The value, or the end of the program.
template <typename Value>
Value OrEnd(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "bench/run uncertainty: %s\n", std::string(value.status().message()).c_str());
  std::exit(1);
}

}  // namespace sixpoint::bench
