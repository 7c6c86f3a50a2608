#include "metrology/registration/pose_fit.h"

namespace sixpoint::metrology {

PlacedPose::PlacedPose(const Eigen::Isometry3d& zero_from_part_in, const Eigen::Vector3d& reference_mm,
                       const Matrix6d& noise, const PoseSensitivity& sensitivity, const MachineCalibration& calibration)
    : zero_from_part(zero_from_part_in),
      noise_covariance(noise, reference_mm),
      calibration_sensitivity(sensitivity),
      sources(SourcesOf(calibration)),
      covariance(noise, reference_mm) {
  ActOnPose(sensitivity, &sources);
  covariance.values += PoseCovarianceOf(sources);
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
