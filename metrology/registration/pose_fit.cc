#include "metrology/registration/pose_fit.h"

#include <cmath>

namespace sixpoint::metrology {

PlacedPose::PlacedPose(const Eigen::Isometry3d& zero_from_part_in, const Eigen::Vector3d& reference_mm,
                       const Matrix6d& noise, const MappingSensitivity& sensitivity,
                       const MachineCalibration& calibration)
    : zero_from_part(zero_from_part_in),
      noise_covariance(noise, reference_mm),
      calibration_sensitivity(sensitivity.leftCols<kCalibrationParameterCount>()),
      angle_sensitivity(sensitivity.rightCols(sensitivity.cols() - kCalibrationParameterCount)),
      sources(SourcesOf(calibration)),
      covariance(noise, reference_mm) {
  ActOnPose(calibration_sensitivity, &sources);
  covariance.values += PoseCovarianceOf(sources);
}

void PlacedPose::AddSource(const std::string& name, const Eigen::Matrix<double, 6, Eigen::Dynamic>& pose_per_sigma) {
  if (pose_per_sigma.isZero(0)) return;
  ErrorSource& source = sources.emplace_back();
  source.name = name;
  source.parameters_per_sigma.setZero(kCalibrationParameterCount, pose_per_sigma.cols());
  source.pose_per_sigma = pose_per_sigma;
  covariance.values += pose_per_sigma * pose_per_sigma.transpose();
}

MappingSensitivity PlacedPose::Sensitivity() const {
  MappingSensitivity whole(6, kCalibrationParameterCount + angle_sensitivity.cols());
  whole << calibration_sensitivity, angle_sensitivity;
  return whole;
}

double WithFormAndGaps(const PlacedPose& placed, const Vector6d& direction, double radius_mm, double noise_mm) {
  Vector6d along = direction;
  along.head<3>() *= radius_mm;
  double uncertainty_mm = noise_mm;
  for (const ErrorSource& source : placed.sources)
    if (source.name == kFormDeviation || source.name == kCadGap)
      uncertainty_mm = std::hypot(uncertainty_mm, (along.transpose() * source.pose_per_sigma).norm());
  return uncertainty_mm;
}

void PoseFit::Withdraw(Outcome why, const std::string& remark) {
  outcome = why;
  placed.reset();
  evidence.remark = remark;
}

std::string Percent(double part) { return std::to_string(static_cast<int>(100 * part)) + " %"; }

void AddRemark(const std::string& more, FitEvidence* evidence) {
  if (!more.empty()) evidence->remark += (evidence->remark.empty() ? "" : "; ") + more;
}

}  // namespace sixpoint::metrology
