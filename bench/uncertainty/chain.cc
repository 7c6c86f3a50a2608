#include "bench/uncertainty/chain.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/correction/correct.h"
#include "metrology/registration/pose_fit.h"
#include "metrology/studies/arm_study.h"
#include "metrology/uncertainty/thermal_expansion.h"

namespace sixpoint::bench {
namespace {

// A blade of 80 mm by 20 mm by 10 mm: an ellipsoid's points and normals about its middle; part frame.
struct BladePoint {
  Eigen::Vector3d at_mm, normal;
};
std::vector<BladePoint> Blade() {
  std::vector<BladePoint> points;
  const Eigen::Vector3d half(40, 10, 6);
  for (int i = 0; i < 240; ++i) {  // a golden spiral
    const double z = 1 - 2 * (i + 0.5) / 240, turn = i * M_PI * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
    const Eigen::Vector3d unit(z, r * std::cos(turn), r * std::sin(turn));
    points.push_back({half.cwiseProduct(unit), unit.cwiseQuotient(half).normalized()});
  }
  return points;
}

struct ScanReading {
  Eigen::Vector3d sensor_mm, v0_mm;
  double a_rad = 0, b_rad = 0;
  BladePoint of;
};
// size: how many times as long as its drawing it is.
std::vector<ScanReading> ScanBlade(const SensorPose& truth, const SensorPose& design, const Eigen::Matrix3d& linear,
                                   const metrology::RotaryAxes& axes, const Eigen::Isometry3d& zero_from_part,
                                   double size, const Field& field, double noise_mm, Draws* draw) {
  std::vector<ScanReading> readings;
  const std::vector<BladePoint> blade = Blade();
  for (const double b_deg : {0.0, 60.0, 120.0, 180.0, 240.0, 300.0})
    for (const double a_deg : {0.0, -50.0}) {
      if (a_deg != 0 && b_deg != 0 && b_deg != 180) continue;
      const Eigen::Isometry3d machine_from_part =
          axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * zero_from_part;
      const Eigen::Vector3d v0 = design.t_sm_mm + Eigen::Vector3d(150, 0, 0) - machine_from_part.translation();
      for (const BladePoint& point : blade) {
        if (machine_from_part.linear().row(2).dot(point.normal) < 0.3) continue;  // the scanner looks down
        const Eigen::Vector3d reading =
            Read(truth, linear, machine_from_part * (size * point.at_mm), v0, field, noise_mm, draw);
        if (std::abs(reading.y()) > 13 || std::abs(reading.z()) > 12.5) continue;
        readings.push_back({reading, v0, a_deg * kRadPerDeg, b_deg * kRadPerDeg, point});
      }
    }
  return readings;
}

// Point to plane onto the blade's own tangents, and how the pose follows every parameter and the readings' noise.
metrology::PlacedPose Register(const std::vector<ScanReading>& readings, const Eigen::Isometry3d& start,
                               const metrology::MachineCalibration& machine, double stretch, double noise_mm) {
  Eigen::Isometry3d pose = start;
  const Eigen::Vector3d reference = start.translation();
  Matrix6d normal = Matrix6d::Zero(), inverse = Matrix6d::Zero(), scatter = Matrix6d::Zero();
  metrology::PoseSensitivity pull = metrology::PoseSensitivity::Zero();
  for (int iteration = 0; iteration < 8; ++iteration) {
    normal.setZero();
    scatter.setZero();
    pull.setZero();
    Vector6d right = Vector6d::Zero();
    for (const ScanReading& reading : readings) {
      const Eigen::Isometry3d machine_from_zero = machine.axes.MachineFromZero(reading.a_rad, reading.b_rad);
      const Eigen::Vector3d zero =
          machine.axes.Growth(1 / stretch) * (machine_from_zero.inverse(Eigen::Isometry) *
                                              machine.sensor.MachineFromSensor(reading.sensor_mm, reading.v0_mm));
      const Eigen::Vector3d n = pose.linear() * reading.of.normal;
      const Vector6d row = metrology::PointJacobian(zero, reference).transpose() * n;
      const double along =
          n.dot(machine_from_zero.linear().transpose() * machine.sensor.rotation.col(2));  // of a reading's noise
      normal += row * row.transpose();
      scatter += along * along * row * row.transpose();
      right += n.dot(zero - pose * reading.of.at_mm) * row;
      pull += row * (n.transpose() * metrology::ZeroPointSensitivity(reading.sensor_mm, zero, reading.a_rad,
                                                                     reading.b_rad, machine.sensor, machine.axes));
    }
    pose = metrology::Perturbed(pose, normal.ldlt().solve(right), reference);
  }
  inverse = normal.ldlt().solve(Matrix6d::Identity());
  return {pose, reference, noise_mm * noise_mm * inverse * scatter * inverse, inverse * pull, machine};
}

metrology::NominalHoleGroup Holes(const Eigen::Isometry3d& nominal, const metrology::RotaryAxes& axes) {
  metrology::NominalHoleGroup group;
  group.name = "G";
  group.nominal = {2 * kRadPerDeg, 40 * kRadPerDeg};
  group.axis_in_part = nominal.linear().transpose() *
                       axes.MachineFromZero(group.nominal.a_rad, group.nominal.b_rad).linear().transpose() *
                       Eigen::Vector3d::UnitZ();
  group.holes = {{"H1", {-30, 5, 5}}, {"H2", {0, 9, 2}}, {"H3", {30, -5, 5}}};
  return group;
}

// The axes as a sphere shows them whose places the linear axes read.
metrology::RotationCalibration AxesAsRead(const metrology::RotaryAxes& axes, const Eigen::Matrix3d& linear) {
  std::vector<metrology::SpherePose> poses;
  const Eigen::Vector3d sphere = axes.a.point_mm + Eigen::Vector3d(60, 20, 30);
  for (const double a_deg : {-60.0, 0.0, 60.0})
    for (int k = 0; k < 4; ++k) {
      metrology::SpherePose& pose = poses.emplace_back();
      pose.a_rad = a_deg * kRadPerDeg;
      pose.b_rad = 90 * k * kRadPerDeg;
      pose.centre_mm = linear.inverse() * (axes.MachineFromZero(pose.a_rad, pose.b_rad) * sphere);
    }
  metrology::RotationOptions options;
  options.nominal = axes;
  options.standard_uncertainty_mm = 1e-3;
  return OrEnd(metrology::CalibrateRotation(poses, options));
}

// How much longer the blade is, and how much it is taken to be.
struct Warmth {
  double size = 1;
  metrology::Stretch taken;
};
constexpr double kNickelPerK = 12.5e-6;
Warmth DrawWarmth(const WorldErrors& errors, Draws* draw) {
  Warmth warmth;
  const metrology::ExpansionCoefficient stated{kNickelPerK, errors.coefficient_per_k};
  const double per_k = kNickelPerK + (*draw)(errors.coefficient_per_k);
  if (errors.half_range_k > 0) {
    std::uniform_real_distribution<double> anywhere(-errors.half_range_k, errors.half_range_k);
    warmth.size = 1 + per_k * anywhere(draw->random);
    warmth.taken = metrology::StretchOf(stated, metrology::Within(errors.half_range_k), {}, {});
  } else if (errors.thermometer_k > 0) {
    warmth.size = 1 + per_k * errors.warmer_k;
    const double read_c = metrology::kReferenceTemperatureC + errors.warmer_k + (*draw)(errors.thermometer_k);
    warmth.taken = metrology::StretchOf(stated, {read_c, errors.thermometer_k}, {}, {});
  }
  return warmth;
}

void AddFurther(const WorldErrors& errors, const metrology::LinearResponse& response, const metrology::Stretch& taken,
                std::vector<metrology::ErrorSource>* further) {
  if (errors.scale_ratio > 0) further->push_back(metrology::ScalesOfLinearAxes(errors.scale_ratio, response));
  if (errors.squareness_ratio > 0)
    further->push_back(metrology::SquarenessOfLinearAxes(errors.squareness_ratio, response));
  if (taken.by_temperatures > 0)
    further->push_back(metrology::Expansion("temperature", taken.by_temperatures, response));
  if (taken.by_coefficients > 0) further->push_back(metrology::Expansion("expansion", taken.by_coefficients, response));
}

}  // namespace

std::vector<HoleOutcome> DrawHoles(const WorldErrors& errors, std::uint64_t seed) {
  Draws draw{std::mt19937_64(seed), {}};
  const SensorPose design = DesignedSensor();
  metrology::RotaryAxes axes;
  axes.a = {Eigen::Vector3d(1e-4, 1, -2e-4).normalized(), {26.63, 54.88, -193.1}};
  axes.b = {Eigen::Vector3d(1, -1e-4, 3e-4).normalized(), {26.63, 54.87, -193.11}};
  Eigen::Isometry3d nominal = Eigen::Isometry3d::Identity();
  nominal.translation() = axes.a.point_mm + Eigen::Vector3d(35, 0, 8);
  const Eigen::Isometry3d truth = metrology::Perturbed(
      nominal, (Vector6d() << draw.Vector(2e-3), draw.Vector(0.1)).finished(), nominal.translation());

  const Field field = DrawField(errors, &draw);
  const Eigen::Vector3d offset = draw.Vector(errors.touch_offset_mm);
  const Eigen::Matrix3d linear = DrawLinearAxes(errors, &draw);
  const Calibrated calibrated =
      Calibrate(design, Swung(design, DrawArm(errors, &draw)), linear, field, errors, offset, &draw);
  metrology::MachineCalibration machine = metrology::MachineCalibration::Exact();
  machine.sensor = calibrated.sensor;
  Eigen::Matrix<double, 8, 1> axis_errors, axis_sigma;
  axis_sigma << errors.axes_rad, errors.axes_rad, errors.axes_mm, errors.axes_mm, errors.axes_rad, errors.axes_rad,
      errors.axes_mm, errors.axes_mm;
  for (int k = 0; k < 8; ++k) axis_errors[k] = draw(axis_sigma[k]);
  const metrology::RotationCalibration by_sphere = AxesAsRead(axes, linear);
  machine.axes = by_sphere.axes.Perturbed(axis_errors);
  machine.axes.a.point_mm += offset;
  machine.axes.b.point_mm += offset;
  double estimated = 1;  // of the axes' variance
  if (errors.axes_freedom > 0) {
    std::chi_squared_distribution<double> chi2(errors.axes_freedom);
    estimated = chi2(draw.random) / errors.axes_freedom;
    machine.axes_degrees_of_freedom = errors.axes_freedom;
  }
  machine.axes_covariance = estimated * axis_sigma.cwiseAbs2().asDiagonal().toDenseMatrix();
  if (errors.touch_offset_mm > 0)
    machine.further.push_back(
        metrology::TouchOffset(errors.touch_offset_mm, machine.axes.a.direction, machine.axes.b.direction));
  if (errors.field_mm > 0)
    machine.further.push_back(metrology::ScannerFieldSource(
        metrology::FieldCovarianceOf(errors.field_mm, calibrated.sensor.measured_field), calibrated.response));
  if (errors.arm_mm > 0 || errors.arm_rad > 0) {
    const metrology::ArmSpread spread = LearntSpread(errors, &draw);
    for (const char* name : {"arm when calibrated", "arm when scanned"})
      machine.further.push_back(metrology::ArmSwing(name, spread.covariance, spread.degrees_of_freedom / 2));
  }
  const Warmth warmth = DrawWarmth(errors, &draw);
  AddFurther(errors, by_sphere.linear_response, warmth.taken, &machine.further);
  std::vector<ScanReading> readings = ScanBlade(Swung(design, DrawArm(errors, &draw)), design, linear, axes, truth,
                                                warmth.size, field, errors.noise_mm, &draw);
  for (ScanReading& reading : readings) reading.sensor_mm = machine.sensor.WithoutField(reading.sensor_mm);
  const metrology::PlacedPose placed = Register(readings, nominal, machine, warmth.taken.ratio, errors.noise_mm);

  const metrology::RegisteredPose pose(placed.zero_from_part, placed.noise_covariance, placed.sources);
  const metrology::NominalHoleGroup group = Holes(nominal, axes);
  const metrology::RotaryLimits limits{-100 * kRadPerDeg, 100 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  const auto corrected = OrEnd(metrology::CorrectGroup(group, pose, nominal, machine.axes, metrology::RotaryAxes(),
                                                       limits, {warmth.taken.ratio, errors.tool_offset_mm}));
  const auto angles = OrEnd(metrology::Orient(axes, truth.linear() * group.axis_in_part, group.nominal, limits));
  const Eigen::Isometry3d machine_from_part = axes.MachineFromZero(angles.a_rad, angles.b_rad) * truth;
  const Eigen::Vector3d tool = draw.Vector(errors.tool_offset_mm);
  std::vector<HoleOutcome> outcomes;
  for (std::size_t i = 0; i < group.holes.size(); ++i) {
    const Eigen::Vector3d drilled = linear * corrected.holes[i].start_mm + tool;
    const Eigen::Vector3d wanted = machine_from_part * (warmth.size * group.holes[i].start_in_part_mm);
    outcomes.push_back({1e3 * (drilled - wanted).norm(), corrected.holes[i].expanded_uncertainty_um});
  }
  return outcomes;
}

}  // namespace sixpoint::bench
