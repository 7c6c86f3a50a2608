
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "metrology/calibration/sensor_calibration.h"
#include "metrology/parallel/loops.h"
#include "metrology/uncertainty/error_source.h"

namespace sixpoint::metrology {
namespace {

// One slot over all scans.
struct SeenSlot {
  Eigen::Vector2d laser_minus_touch_mm = Eigen::Vector2d::Zero();  // mean, along the artefact's face
  Eigen::Matrix<double, 2, kSensorParameterCount> by_sensor;
  Eigen::Matrix<double, 2, kFieldParameterCount> by_field;
  double scan_count = 0, squares_mm2 = 0;  // of the scans about their mean
};

SeenSlot LookAt(const std::vector<const FeatureCentre*>& seen, const Eigen::Vector3d& touched_mm,
                const SensorCalibration& result) {
  SeenSlot slot;
  slot.by_sensor.setZero();
  slot.by_field.setZero();
  slot.scan_count = static_cast<double>(seen.size());
  const Eigen::Matrix<double, 2, 3> along = result.machine_from_artefact.linear().transpose().topRows<2>();
  const FieldResponse response = result.field_response.value_or(FieldResponse::Zero());
  for (const FeatureCentre* centre : seen) {
    const auto moves = result.sensor.ParameterJacobian(centre->in_sensor_mm);
    slot.laser_minus_touch_mm += along * (centre->in_machine_mm - touched_mm) / slot.scan_count;
    slot.by_sensor += along * moves / slot.scan_count;
    slot.by_field += along * (result.sensor.FieldJacobian(centre->in_sensor_mm) + moves * response) / slot.scan_count;
  }
  for (const FeatureCentre* centre : seen)
    slot.squares_mm2 += (along * (centre->in_machine_mm - touched_mm) - slot.laser_minus_touch_mm).squaredNorm();
  return slot;
}

// How well a slot's edges are seen: what its scans differ, and where between two profiles an edge lies, which they may have in common. A centre
// is the mean of two edges.
std::optional<ResidualJudgement> JudgeSlots(const std::vector<FeatureCentre>& centres, double pitch_mm,
                                            const ArtefactTouch& touch, const SensorCalibrationOptions& options,
                                            const SensorCalibration& result) {
  std::map<std::string, std::vector<const FeatureCentre*>> by_name;
  for (const FeatureCentre& centre : centres) by_name[centre.name].push_back(&centre);
  std::vector<SeenSlot> slots;
  double squares_mm2 = 0, freedom = 0;
  for (const auto& [name, seen] : by_name) {
    slots.push_back(LookAt(seen, *TouchedCentre(touch, name), result));
    squares_mm2 += slots.back().squares_mm2;
    freedom += 2 * (slots.back().scan_count - 1);
  }
  if (freedom < 2 || !(pitch_mm > 0)) return std::nullopt;
  const auto rows = 2 * static_cast<Eigen::Index>(slots.size());
  Eigen::VectorXd residuals(rows);
  Eigen::MatrixXd by_sensor(rows, kSensorParameterCount), by_field(rows, kFieldParameterCount);
  Eigen::VectorXd own(rows);
  const double touched_mm = std::max(result.touch_uncertainty_mm, kTouchUncertaintyMm);
  double seen_mm2 = 0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const Eigen::Index row = 2 * static_cast<Eigen::Index>(i);
    residuals.segment<2>(row) = slots[i].laser_minus_touch_mm;
    by_sensor.middleRows<2>(row) = slots[i].by_sensor;
    by_field.middleRows<2>(row) = slots[i].by_field;
    const double of_scans = squares_mm2 / freedom / slots[i].scan_count;
    seen_mm2 += 2 * of_scans;
    own.segment<2>(row).setConstant(of_scans + pitch_mm * pitch_mm / 24 + touched_mm * touched_mm +
                                    std::pow(options.centre_standard_uncertainty_mm, 2));
  }
  Eigen::MatrixXd expected =
      by_sensor * result.sensor.covariance * by_sensor.transpose() +
      by_field * FieldCovarianceOf(options.field_standard_uncertainty_mm, result.sensor.measured_field) *
          by_field.transpose();
  expected += own.asDiagonal();
  const double effective =
      EffectiveDegreesOfFreedom({{"scans", seen_mm2, freedom}, {"known", expected.trace() - seen_mm2}});
  return JudgeResiduals("slots, which took no part in the fit", residuals, expected, effective);
}

}  // namespace

double ConditionNumber(const Matrix6d& covariance) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(kArtefactLever_mm);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scale.asDiagonal() * covariance * scale.asDiagonal(),
                                                      Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()(5) / eigen.eigenvalues()(0);
}

ProbingNoise TouchNoise(const ArtefactTouch& touch, double squares, double freedom) {
  return ProbingNoiseOf(squares, freedom,
                        touch.standard_uncertainty_mm > 0 ? touch.standard_uncertainty_mm : kTouchUncertaintyMm);
}

CardanAngles CardanUncertainty(const CardanAngles& angles, const Eigen::Matrix3d& covariance) {
  // rotation vector = (Rz Ry ex) dalpha + (Rz ey) dbeta + ez dgamma.
  const Eigen::Matrix3d rz = RotationFromCardan({0, 0, angles.gamma}),
                        rzy = RotationFromCardan({0, angles.beta, angles.gamma});
  Eigen::Matrix3d jacobian;
  jacobian << rzy.col(0), rz.col(1), Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d inverse = jacobian.inverse();
  const Eigen::Vector3d sigma = (inverse * covariance * inverse.transpose()).diagonal().cwiseSqrt();
  return {sigma.x(), sigma.y(), sigma.z()};
}

absl::Status ReportCentres(const std::vector<LineScan>& scans, const Artefact& artefact, const ArtefactTouch& touch,
                           const SensorCalibrationOptions& options, SensorCalibration* result) {
  using CentresOfScan = absl::StatusOr<std::vector<FeatureCentre>>;
  std::vector<CentresOfScan> found(scans.size(), CentresOfScan(std::vector<FeatureCentre>{}));
  ForEach(scans.size(), options.threads, [&](size_t s) {
    found[s] = MeasureCentres(scans[s], artefact, result->machine_from_artefact, result->sensor, options.optics);
  });
  for (size_t s = 0; s < scans.size(); ++s) {
    if (!found[s].ok()) return found[s].status();
    for (const FeatureCentre& centre : *found[s])
      if (const Eigen::Vector3d* touched = TouchedCentre(touch, centre.name); touched != nullptr)
        (centre.slot ? result->check : result->fitted)
            .push_back({scans[s].id, centre.name, centre.in_machine_mm - *touched});
  }
  std::vector<FeatureCentre> slots;
  for (const CentresOfScan& of_scan : found)
    for (const FeatureCentre& centre : *of_scan)
      if (centre.slot && TouchedCentre(touch, centre.name) != nullptr) slots.push_back(centre);
  double pitch_mm = 0;
  for (const LineScan& scan : scans) pitch_mm = std::max(pitch_mm, scan.profile_pitch_mm);
  result->judgement = JudgeSlots(slots, pitch_mm, touch, options, *result);
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
