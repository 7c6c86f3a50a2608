#include "bench/uncertainty/world.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <vector>

#include "metrology/calibration/field_estimate.h"

namespace sixpoint::bench {
namespace {

// Points of a touched plate with sloping walls, at three heights of the line.
constexpr double kPlateHalf_mm = 10;
struct PlatePoint {
  Eigen::Vector3d machine_mm, normal, v0_mm;
  bool is_upper = false;
};
std::vector<PlatePoint> Plate(const SensorPose& sensor, const Eigen::Vector3d& elsewhere_mm) {
  std::vector<PlatePoint> points;
  const Eigen::Vector3d centre(205, 137, -180);
  for (const double height : {-10.0, 0.0, 10.0})
    for (int i = -5; i <= 5; ++i)
      for (int k = -5; k <= 5; ++k) {
        const Eigen::Vector3d at = centre + Eigen::Vector3d(2.0 * i, 2.0 * k, 0);
        // The line's middle on the plate's, its encoder where the plate is.
        const Eigen::Vector3d v0 =
            sensor.t_sm_mm + Eigen::Vector3d(150, 0, 0) - centre + Eigen::Vector3d(0, 0, height) + elsewhere_mm;
        const int wall = (i + 2 * k + 20) % 5;
        const Eigen::Vector3d slope = wall == 1   ? Eigen::Vector3d(1, 0, 1)
                                      : wall == 2 ? Eigen::Vector3d(-1, 0, 1)
                                      : wall == 3 ? Eigen::Vector3d(0, 1, 1)
                                      : wall == 4 ? Eigen::Vector3d(0, -1, 1)
                                                  : Eigen::Vector3d(0, 0, 1);
        points.push_back({at, slope.normalized(), v0, wall == 0});
      }
  return points;
}

// Least squares of the scanner's pose onto the plate.
struct PlateFit {
  const std::vector<PlatePoint>& plate;
  metrology::Points readings, touched_mm;
  SensorPose found = SensorPose::Exact();
  Matrix6d normal;
  Vector6d right;

  Vector6d RowAt(std::size_t i) const { return found.ParameterJacobian(readings[i]).transpose() * plate[i].normal; }
  double OffAt(std::size_t i) const {
    return plate[i].normal.dot(found.MachineFromSensor(readings[i], plate[i].v0_mm) - touched_mm[i]);
  }
  metrology::FieldSeries FieldAt(std::size_t i) const {
    return plate[i].normal.dot(found.rotation.col(2)) * found.field.SeriesAt(readings[i].y(), readings[i].z());
  }

  void Settle() {
    for (int iteration = 0; iteration < 6; ++iteration) {
      normal.setZero();
      right.setZero();
      for (std::size_t i = 0; i < plate.size(); ++i) {
        const Vector6d row = RowAt(i);
        normal += row * row.transpose();
        right -= OffAt(i) * row;
      }
      found = Swung(found, normal.ldlt().solve(right));
    }
  }

  // Of the solution to the field's series.
  Eigen::Matrix<double, 6, metrology::kFieldSeriesCount> Response() const {
    Eigen::Matrix<double, 6, metrology::kFieldSeriesCount> pull;
    pull.setZero();
    for (std::size_t i = 0; i < plate.size(); ++i) pull -= RowAt(i) * FieldAt(i);
    return normal.ldlt().solve(pull);
  }

  std::vector<metrology::FieldResidual> Residuals(double noise_mm) const {
    const auto response = Response();
    std::vector<metrology::FieldResidual> residuals;
    for (std::size_t i = 0; i < plate.size(); ++i) {
      if (!plate[i].is_upper) continue;
      const Eigen::Vector3d at = plate[i].machine_mm - plate.front().machine_mm;
      residuals.push_back({OffAt(i), FieldAt(i) + RowAt(i).transpose() * response,
                           metrology::FlatnessTermsAt(at.head<2>() / kPlateHalf_mm - Eigen::Vector2d::Ones()),
                           noise_mm * noise_mm, true});
    }
    return residuals;
  }
};

// Three waves of root mean square sigma about their mean over -half to half.
Field DrawWaves(double sigma_mm, double shortest_mm, double longest_mm, double half_y_mm, double half_z_mm,
                Draws* draw) {
  struct Wave {
    double per_y, per_z, phase, height;
  };
  std::vector<Wave> waves;
  std::uniform_real_distribution<double> turn(0, 2 * M_PI), length_mm(shortest_mm, longest_mm);
  for (int i = 0; i < 3; ++i) {
    const double along = turn(draw->random), per_mm = 2 * M_PI / length_mm(draw->random);
    waves.push_back({per_mm * std::cos(along), per_mm * std::sin(along), turn(draw->random), (*draw)(1)});
  }
  const auto off_at = [waves](double y, double z) {
    double off = 0;
    for (const Wave& wave : waves) off += wave.height * std::cos(wave.per_y * y + wave.per_z * z + wave.phase);
    return off;
  };
  constexpr int kSteps = 12;
  double mean = 0, square = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const double off = off_at(half_y_mm * (2 * (i + 0.5) / kSteps - 1), half_z_mm * (2 * (k + 0.5) / kSteps - 1));
      mean += off / (kSteps * kSteps);
      square += off * off / (kSteps * kSteps);
    }
  const double scale = (*draw)(sigma_mm) / std::sqrt(square - mean * mean);
  return [off_at, mean, scale](double y, double z) { return scale * (off_at(y, z) - mean); };
}

// The plate's own form: about a plane, of which touching knows nothing.
Field DrawForm(const WorldErrors& errors, Draws* draw) {
  return DrawWaves(errors.flatness_mm, 15, 40, kPlateHalf_mm, kPlateHalf_mm, draw);
}

}  // namespace

SensorPose DesignedSensor() {
  SensorPose design = SensorPose::Exact();
  design.rotation = metrology::RotationFromCardan({0.4 * kRadPerDeg, 0.3 * kRadPerDeg, -0.4 * kRadPerDeg});
  design.t_sm_mm = {15, -42, 85};
  design.field = metrology::ScannerField::Of(kMid_mm, kRange_mm, kLine_rad);
  return design;
}

Field DrawField(const WorldErrors& errors, Draws* draw) {
  if (errors.field_mm == 0) return [](double, double) { return 0.0; };
  if (!errors.field_is_harsh) {
    Eigen::Matrix<double, metrology::kFieldParameterCount, 1> terms;
    for (double& term : terms) term = (*draw)(errors.field_mm / std::sqrt(metrology::kFieldParameterCount));
    const metrology::ScannerField field = metrology::ScannerField::Of(kMid_mm, kRange_mm, kLine_rad);
    return [terms, field](double y, double z) { return field.TermsAt(y, z).dot(terms); };
  }
  return DrawWaves(errors.field_mm, 30, 60, 13.8, 12.5, draw);
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

Eigen::Matrix3d DrawLinearAxes(const WorldErrors& errors, Draws* draw) {
  Eigen::Matrix3d done = Eigen::Matrix3d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = row; column < 3; ++column)
      done(row, column) += (*draw)(row == column ? errors.scale_ratio : errors.squareness_ratio);
  return done;
}

Eigen::Vector3d Read(const SensorPose& sensor, const Eigen::Matrix3d& linear, const Eigen::Vector3d& machine_mm,
                     const Eigen::Vector3d& v0_mm, const Field& field, double noise_mm, Draws* draw) {
  Eigen::Matrix3d map;
  map << linear.col(0), sensor.rotation.col(1), sensor.rotation.col(2);
  Eigen::Vector3d reading = map.inverse() * (machine_mm + linear * v0_mm - sensor.t_sm_mm);
  reading.z() += field(reading.y(), reading.z()) + (*draw)(noise_mm);
  return reading;
}

Calibrated Calibrate(const SensorPose& design, const SensorPose& truth, const Eigen::Matrix3d& linear,
                     const Field& field, const WorldErrors& errors, const Eigen::Vector3d& touch_offset_mm, Draws* draw,
                     const Eigen::Vector3d& elsewhere_mm, const std::optional<metrology::MeasuredField>& known_field) {
  const std::vector<PlatePoint> plate = Plate(design, elsewhere_mm);
  const Field form = errors.field_mm > 0 ? DrawForm(errors, draw) : Field([](double, double) { return 0.0; });
  const Eigen::Matrix3d touched = linear.inverse();  // what the axes read of a true place
  PlateFit fit{plate, {}, {}, design, {}, {}};
  for (const PlatePoint& point : plate) {
    const Eigen::Vector3d at = point.machine_mm - plate.front().machine_mm;
    const double off_mm = point.is_upper ? form(at.x() - kPlateHalf_mm, at.y() - kPlateHalf_mm) : 0;
    fit.readings.push_back(
        Read(truth, linear, point.machine_mm + off_mm * point.normal, point.v0_mm, field, errors.noise_mm, draw));
    fit.touched_mm.push_back(touched * point.machine_mm + touch_offset_mm);
  }
  fit.Settle();
  if (errors.field_mm > 0) {
    fit.found.measured_field = known_field.value_or(
        metrology::EstimateField(fit.Residuals(errors.noise_mm), errors.field_mm, errors.flatness_mm));
    for (Eigen::Vector3d& reading : fit.readings) reading = fit.found.WithoutField(reading);
    fit.Settle();
  }
  const Matrix6d inverse = fit.normal.ldlt().solve(Matrix6d::Identity());
  Matrix6d scatter = Matrix6d::Zero();
  for (std::size_t i = 0; i < plate.size(); ++i) {
    const Vector6d row = fit.found.ParameterJacobian(fit.readings[i]).transpose() * plate[i].normal;
    const double along = plate[i].normal.dot(fit.found.rotation.col(2));  // of a reading's noise
    scatter += along * along * row * row.transpose();
  }
  fit.found.covariance = errors.noise_mm * errors.noise_mm * inverse * scatter * inverse;
  return {fit.found, fit.Response().leftCols<metrology::kFieldParameterCount>()};
}

metrology::ArmSpread LearntSpread(const WorldErrors& errors, Draws* draw) {
  if (errors.arm_scans == 0) {
    metrology::ArmSpread known;
    known.covariance.setZero();
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

}  // namespace sixpoint::bench
