#include "bench/uncertainty/chain.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/studies/arm_study.h"
#include "metrology/uncertainty/thermal_expansion.h"

namespace sixpoint::bench {
namespace {

using metrology::ErrorSource;
using metrology::Matrix6d;
using metrology::SensorPose;
using metrology::Vector6d;

constexpr double kDegree = M_PI / 180;
constexpr double kMid_mm = 66, kRange_mm = 25, kLine_rad = 20 * kDegree;

struct Draws {
  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  double operator()(double sigma) { return sigma > 0 ? sigma * normal(random) : 0; }
  Eigen::Vector3d Vector(double sigma) { return {(*this)(sigma), (*this)(sigma), (*this)(sigma)}; }
};

// How far a reading is off along z: three waves across the measuring field, none shorter than it, of root mean square sigma.
using Field = std::function<double(double y, double z)>;
Field DrawField(const WorldErrors& errors, Draws* draw) {
  if (errors.field_mm == 0) return [](double, double) { return 0.0; };
  if (!errors.field_is_harsh) {
    Eigen::Matrix<double, metrology::kFieldParameterCount, 1> terms;
    for (double& term : terms) term = (*draw)(errors.field_mm / std::sqrt(metrology::kFieldParameterCount));
    const metrology::ScannerField field = metrology::ScannerField::Of(kMid_mm, kRange_mm, kLine_rad);
    return [terms, field](double y, double z) { return field.TermsAt(y, z).dot(terms); };
  }
  struct Wave {
    double per_y, per_z, phase, height;
  };
  std::vector<Wave> waves;
  std::uniform_real_distribution<double> turn(0, 2 * M_PI), length_mm(30, 60);
  for (int i = 0; i < 3; ++i) {
    const double along = turn(draw->random), per_mm = 2 * M_PI / length_mm(draw->random);
    waves.push_back({per_mm * std::cos(along), per_mm * std::sin(along), turn(draw->random), (*draw)(1)});
  }
  const auto off_at = [waves](double y, double z) {
    double off = 0;
    for (const Wave& wave : waves) off += wave.height * std::cos(wave.per_y * y + wave.per_z * z + wave.phase);
    return off;
  };
  // Stated is what is left beside the constant, which is T_sm's, over the measuring field.
  constexpr int kSteps = 12;
  double mean = 0, square = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const double off = off_at(13.8 * (2 * (i + 0.5) / kSteps - 1), 12.5 * (2 * (k + 0.5) / kSteps - 1));
      mean += off / (kSteps * kSteps);
      square += off * off / (kSteps * kSteps);
    }
  const double scale = (*draw)(errors.field_mm) / std::sqrt(square - mean * mean);
  return [off_at, mean, scale](double y, double z) { return scale * (off_at(y, z) - mean); };
}

SensorPose Swung(const SensorPose& mean, const Vector6d& by) {
  SensorPose swung = mean;
  swung.rotation = metrology::RotationFromVector(by.head<3>()) * mean.rotation;
  swung.t_sm_mm += by.tail<3>();
  return swung;
}

Vector6d DrawArm(const WorldErrors& errors, Draws* draw) {
  Vector6d arm;
  arm << draw->Vector(errors.arm_rad), draw->Vector(errors.arm_mm);
  return arm;
}

// What the linear axes truly do where they read 1: scales and squareness.
Eigen::Matrix3d DrawLinearAxes(const WorldErrors& errors, Draws* draw) {
  Eigen::Matrix3d done = Eigen::Matrix3d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column)
      done(row, column) += (*draw)(row == column ? errors.scale_ratio : errors.squareness_ratio);
  return done;
}

// What the scanner reads of a true machine point. linear: what the axes do where they read 1.
Eigen::Vector3d Read(const SensorPose& sensor, const Eigen::Matrix3d& linear, const Eigen::Vector3d& machine_mm,
                     const Eigen::Vector3d& v0_mm, const Field& field, double noise_mm, Draws* draw) {
  Eigen::Matrix3d map;
  map << linear.col(0), sensor.rotation.col(1), sensor.rotation.col(2);
  Eigen::Vector3d reading = map.inverse() * (machine_mm + linear * v0_mm - sensor.t_sm_mm);
  reading.z() += field(reading.y(), reading.z()) + (*draw)(noise_mm);
  return reading;
}

// Points of a touched plate with sloping walls, at two heights of the line.
struct PlatePoint {
  Eigen::Vector3d machine_mm, normal, v0_mm;
};
std::vector<PlatePoint> Plate(const SensorPose& sensor) {
  std::vector<PlatePoint> points;
  const Eigen::Vector3d centre(205, 137, -180);
  for (const double height : {-10.0, 0.0, 10.0})
    for (int i = -5; i <= 5; ++i)
      for (int k = -5; k <= 5; ++k) {
        const Eigen::Vector3d at = centre + Eigen::Vector3d(2.0 * i, 2.0 * k, 0);
        // The line's middle on the plate's, its encoder where the plate is.
        const Eigen::Vector3d v0 = sensor.t_sm_mm + Eigen::Vector3d(150, 0, 0) - centre + Eigen::Vector3d(0, 0, height);
        const int wall = (i + 2 * k + 20) % 5;
        const Eigen::Vector3d slope = wall == 1   ? Eigen::Vector3d(1, 0, 1)
                                      : wall == 2 ? Eigen::Vector3d(-1, 0, 1)
                                      : wall == 3 ? Eigen::Vector3d(0, 1, 1)
                                      : wall == 4 ? Eigen::Vector3d(0, -1, 1)
                                                  : Eigen::Vector3d(0, 0, 1);
        points.push_back({at, slope.normalized(), v0});
      }
  return points;
}

struct Calibrated {
  SensorPose sensor;
  metrology::FieldResponse response;
};
// Least squares onto the plate as it was touched, from the design on.
Calibrated Calibrate(const SensorPose& design, const SensorPose& truth, const Eigen::Matrix3d& linear,
                     const Field& field, const WorldErrors& errors, const Eigen::Vector3d& touch_offset_mm,
                     Draws* draw) {
  const std::vector<PlatePoint> plate = Plate(design);
  metrology::Points readings;
  for (const PlatePoint& point : plate)
    readings.push_back(Read(truth, linear, point.machine_mm, point.v0_mm, field, errors.noise_mm, draw));
  const Eigen::Matrix3d touched = linear.inverse();  // what the axes read of a true place
  SensorPose found = design;
  Matrix6d normal;
  for (int iteration = 0; iteration < 6; ++iteration) {
    normal.setZero();
    Vector6d right = Vector6d::Zero();
    for (std::size_t i = 0; i < plate.size(); ++i) {
      const Vector6d row = found.ParameterJacobian(readings[i]).transpose() * plate[i].normal;
      const double off = plate[i].normal.dot(found.MachineFromSensor(readings[i], plate[i].v0_mm) -
                                             touched * plate[i].machine_mm - touch_offset_mm);
      normal += row * row.transpose();
      right -= off * row;
    }
    found = Swung(found, normal.ldlt().solve(right));
  }
  const Matrix6d inverse = normal.ldlt().solve(Matrix6d::Identity());
  Eigen::Matrix<double, 6, metrology::kFieldParameterCount> pull;
  pull.setZero();
  Matrix6d scatter = Matrix6d::Zero();
  for (std::size_t i = 0; i < plate.size(); ++i) {
    const Vector6d row = found.ParameterJacobian(readings[i]).transpose() * plate[i].normal;
    pull -= row * (plate[i].normal.transpose() * found.FieldJacobian(readings[i]));
    const double along = plate[i].normal.dot(found.rotation.col(2));  // of a reading's noise
    scatter += along * along * row * row.transpose();
  }
  found.covariance = errors.noise_mm * errors.noise_mm * inverse * scatter * inverse;
  return {found, inverse * pull};
}

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
          axes.MachineFromZero(a_deg * kDegree, b_deg * kDegree) * zero_from_part;
      const Eigen::Vector3d v0 = design.t_sm_mm + Eigen::Vector3d(150, 0, 0) - machine_from_part.translation();
      for (const BladePoint& point : blade) {
        if (machine_from_part.linear().row(2).dot(point.normal) < 0.3) continue;  // the scanner looks down
        const Eigen::Vector3d reading =
            Read(truth, linear, machine_from_part * (size * point.at_mm), v0, field, noise_mm, draw);
        if (std::abs(reading.y()) > 13 || std::abs(reading.z()) > 12.5) continue;
        readings.push_back({reading, v0, a_deg * kDegree, b_deg * kDegree, point});
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
  group.nominal = {2 * kDegree, 40 * kDegree};
  group.axis_in_part = nominal.linear().transpose() *
                       axes.MachineFromZero(group.nominal.a_rad, group.nominal.b_rad).linear().transpose() *
                       Eigen::Vector3d::UnitZ();
  group.holes = {{"H1", {-30, 5, 5}}, {"H2", {0, 9, 2}}, {"H3", {30, -5, 5}}};
  return group;
}

template <typename Value>
Value OrEnd(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "bench/run uncertainty: %s\n", std::string(value.status().message()).c_str());
  std::exit(1);
}

metrology::ArmSpread LearntSpread(const WorldErrors& errors, Draws* draw) {
  if (errors.arm_scans == 0) {
    metrology::ArmSpread known;
    known.covariance.diagonal() << Eigen::Vector3d::Constant(errors.arm_rad * errors.arm_rad),
        Eigen::Vector3d::Constant(errors.arm_mm * errors.arm_mm);
    known.degrees_of_freedom = std::numeric_limits<double>::infinity();
    return known;
  }
  std::vector<metrology::ArmDisplacement> displacements;
  const Vector6d first = DrawArm(errors, draw);
  for (int i = 0; i < errors.arm_scans; ++i) {
    const Vector6d by = (i == 0 ? first : DrawArm(errors, draw)) - first;
    metrology::ArmDisplacement& one = displacements.emplace_back();
    one.angles = metrology::CardanFromRotation(metrology::RotationFromVector(by.head<3>()));
    one.translation_mm = by.tail<3>();
  }
  return OrEnd(metrology::ArmSpreadOf(displacements, Vector6d::Zero()));
}

// The axes as a sphere shows them whose places the linear axes read.
metrology::RotationCalibration AxesAsRead(const metrology::RotaryAxes& axes, const Eigen::Matrix3d& linear) {
  std::vector<metrology::SpherePose> poses;
  const Eigen::Vector3d sphere = axes.a.point_mm + Eigen::Vector3d(60, 20, 30);
  for (const double a_deg : {-60.0, 0.0, 60.0})
    for (int k = 0; k < 4; ++k) {
      metrology::SpherePose& pose = poses.emplace_back();
      pose.a_rad = a_deg * kDegree;
      pose.b_rad = 90 * k * kDegree;
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
  SensorPose design;
  design.rotation = metrology::RotationFromCardan({0.4 * kDegree, 0.3 * kDegree, -0.4 * kDegree});
  design.t_sm_mm = {15, -42, 85};
  design.field = metrology::ScannerField::Of(kMid_mm, kRange_mm, kLine_rad);
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
  metrology::MachineCalibration machine;
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
    machine.further.push_back(metrology::ScannerFieldSource(errors.field_mm, calibrated.response));
  if (errors.arm_mm > 0 || errors.arm_rad > 0) {
    const metrology::ArmSpread spread = LearntSpread(errors, &draw);
    for (const char* name : {"arm when calibrated", "arm when scanned"})
      machine.further.push_back(metrology::ArmSwing(name, spread.covariance, spread.degrees_of_freedom / 2));
  }
  const Warmth warmth = DrawWarmth(errors, &draw);
  AddFurther(errors, by_sphere.linear_response, warmth.taken, &machine.further);
  const std::vector<ScanReading> readings = ScanBlade(Swung(design, DrawArm(errors, &draw)), design, linear, axes,
                                                      truth, warmth.size, field, errors.noise_mm, &draw);
  const metrology::PlacedPose placed = Register(readings, nominal, machine, warmth.taken.ratio, errors.noise_mm);

  const metrology::RegisteredPose pose(placed.zero_from_part, placed.noise_covariance, placed.sources);
  const metrology::NominalHoleGroup group = Holes(nominal, axes);
  const metrology::RotaryLimits limits{-100 * kDegree, 100 * kDegree, -360 * kDegree, 360 * kDegree};
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
