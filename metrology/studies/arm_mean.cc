#include "metrology/studies/arm_mean.h"

#include <map>

#include "metrology/linear_algebra/inverse.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// A spread of so few scans may be narrower than any arm's along some direction: 1 urad and 0.05 um at least.
constexpr double kLeastTurn_rad = 1e-6, kLeastShift_mm = 5e-5;

Matrix6d Widened(const SensorCovariance& spread) {
  Matrix6d widened = spread;
  widened.diagonal().head<3>().array() += kLeastTurn_rad * kLeastTurn_rad;
  widened.diagonal().tail<3>().array() += kLeastShift_mm * kLeastShift_mm;
  return widened;
}

// All scans of one series, weighed by what each tells.
SwungScan Together(const std::vector<const SwungScan*>& scans) {
  SwungScan together;
  together.arm_series = scans.front()->arm_series;
  Matrix6d information = Matrix6d::Zero();
  for (const SwungScan* scan : scans) information += Inverse(scan->covariance);
  together.covariance = Inverse(information);
  for (const SwungScan* scan : scans) {
    const Matrix6d weight = together.covariance * Inverse(scan->covariance);
    together.displacement += weight * scan->displacement;
    together.field_response += weight * scan->field_response;
  }
  return together;
}

}  // namespace

absl::StatusOr<MeanOfSwings> FindMeanOfSwings(const std::string& calibrated_series, const std::vector<SwungScan>& scans,
                                              const ArmSpread& spread) {
  if (scans.empty()) return Refuse("scans", "none of another series", "at least 1");
  if (!spread.covariance.allFinite() || !(spread.covariance.diagonal().minCoeff() >= 0))
    return Refuse("arm.spread", "not finite", "a covariance");
  std::map<std::string, std::vector<const SwungScan*>> by_series;
  for (const SwungScan& scan : scans) {
    if (scan.arm_series.empty() || scan.arm_series == calibrated_series)
      return Refuse("scans.arm_series", "'" + scan.arm_series + "'", "another than the calibration's own");
    if (!scan.displacement.allFinite() || !scan.covariance.allFinite() || !(scan.covariance.diagonal().minCoeff() > 0))
      return Refuse("scans", "a displacement that is not finite", "finite ones with their covariance");
    by_series[scan.arm_series].push_back(&scan);
  }
  const Matrix6d about_mean = Widened(spread.covariance);
  std::vector<SwungScan> series;
  for (const auto& [name, of_series] : by_series) series.push_back(Together(of_series));
  const Matrix6d own = Inverse(about_mean);
  Matrix6d information = own;
  for (const SwungScan& one : series) information += Inverse(Matrix6d(about_mean + one.covariance));
  const Matrix6d found = Inverse(information);
  MeanOfSwings mean;
  mean.covariance.setZero();
  mean.shares.push_back({calibrated_series, Matrix6d::Identity()});
  for (const SwungScan& one : series) {
    const Matrix6d weight = found * Inverse(Matrix6d(about_mean + one.covariance));
    mean.displacement += weight * one.displacement;
    mean.covariance += weight * one.covariance * weight.transpose();
    mean.field_response += weight * one.field_response;
    mean.shares.push_back({one.arm_series, weight});
    mean.shares.front().response -= weight;
  }
  return mean;
}

SensorPose Moved(const SensorPose& calibrated, const MeanOfSwings& mean) {
  SensorPose moved = calibrated;
  moved.rotation = RotationFromVector(mean.displacement.head<3>()) * calibrated.rotation;
  moved.t_sm_mm += mean.displacement.tail<3>();
  moved.covariance += mean.covariance;
  moved.field_response += mean.field_response;
  return moved;
}

SwungScan Apart(const std::string& arm_series, const ArtefactFit& scan,
                const std::vector<ArtefactFit>& of_calibration) {
  Matrix6d information = Matrix6d::Zero();
  for (const ArtefactFit& fit : of_calibration) information += Inverse(fit.covariance);
  const Matrix6d together = Inverse(information);
  SwungScan swung;
  swung.arm_series = arm_series;
  swung.covariance = scan.covariance + together;
  swung.field_response = scan.field_response;
  for (const ArtefactFit& fit : of_calibration) {
    const Matrix6d weight = together * Inverse(fit.covariance);
    Vector6d apart;
    apart << VectorFromRotation(scan.sensor.rotation * fit.sensor.rotation.transpose()),
        scan.sensor.t_sm_mm - fit.sensor.t_sm_mm;
    swung.displacement += weight * apart;
    swung.field_response -= weight * fit.field_response;
  }
  return swung;
}

}  // namespace sixpoint::metrology
