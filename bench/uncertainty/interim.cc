#include "bench/uncertainty/interim.h"

#include <algorithm>
#include <string>
#include <vector>

#include "metrology/studies/interim_check.h"

namespace sixpoint::bench {
namespace {

metrology::ArtefactFit FitOf(const Calibrated& found) {
  metrology::ArtefactFit fit;
  fit.sensor = found.sensor;
  fit.covariance = found.sensor.covariance;
  fit.field_response = found.response;
  return fit;
}

Vector6d DrawKnock(Knock knock, double knock_mm, const SensorPose& sensor, Draws* draw) {
  Vector6d by = Vector6d::Zero();
  const Eigen::Vector3d direction = draw->Vector(1).normalized();
  if (knock == Knock::kShift) by.tail<3>() = knock_mm * direction;
  if (knock != Knock::kTurn) return by;
  // What a turn about `direction` does to the place of the border that it moves most.
  double most_mm = 0;
  for (const double y : {-1.0, 1.0})
    for (const double z : {-1.0, 1.0}) {
      const Eigen::Vector3d arm = sensor.rotation.col(1) * y * sensor.field.half_width_mm +
                                  sensor.rotation.col(2) * z * sensor.field.half_range_mm;
      most_mm = std::max(most_mm, direction.cross(arm).norm());
    }
  by.head<3>() = knock_mm / most_mm * direction;
  return by;
}

}  // namespace

bool Accepts(const WorldErrors& errors, Knock knock, double knock_mm, Swings swings, std::uint64_t seed) {
  Draws draw{std::mt19937_64(seed), {}};
  const SensorPose design = DesignedSensor();
  const Field field = DrawField(errors, &draw);
  const Eigen::Vector3d offset = draw.Vector(errors.touch_offset_mm);
  const Eigen::Matrix3d linear = DrawLinearAxes(errors, &draw);
  std::vector<metrology::ReferenceScan> references;
  Vector6d arm_then;
  std::optional<metrology::MeasuredField> known_field;
  for (int k = 0; k < swings.calibrated; ++k) {
    arm_then = DrawArm(errors, &draw);
    const Calibrated then = Calibrate(design, Swung(design, arm_then), linear, field, errors, offset, &draw,
                                      Eigen::Vector3d::Zero(), known_field);
    known_field = then.sensor.measured_field;
    references.push_back({"then " + std::to_string(k), FitOf(then)});
  }
  const Vector6d by = DrawKnock(knock, knock_mm, design, &draw);
  metrology::InterimCheckOptions options;
  options.field_covariance_mm2.setZero();
  options.limit_mm = knock_mm;
  options.field_covariance_mm2 = metrology::FieldCovarianceOf(errors.field_mm, known_field);
  options.arm = LearntSpread(errors, &draw);
  std::vector<metrology::CheckedScan> scans;
  for (int i = 0; i < std::max(1, swings.since); ++i) {
    const Vector6d arm = swings.since == 0 ? arm_then : DrawArm(errors, &draw);
    std::uniform_real_distribution<double> elsewhere(-1, 1);
    const Eigen::Vector3d plate_mm(elsewhere(draw.random), elsewhere(draw.random), elsewhere(draw.random));
    const Calibrated now =
        Calibrate(design, Swung(Swung(design, arm), by), linear, field, errors, offset, &draw, plate_mm, known_field);
    for (std::size_t k = 0; k < references.size(); ++k)
      scans.push_back({static_cast<std::size_t>(i),
                       swings.since == 0 ? references[0].arm_series : "since " + std::to_string(i), k, FitOf(now)});
  }
  const metrology::InterimCheck check = OrEnd(metrology::CheckInterim(scans, references, options));
  return check.verdict == metrology::StudyVerdict::kAccepted;
}

}  // namespace sixpoint::bench
