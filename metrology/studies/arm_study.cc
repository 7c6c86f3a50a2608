#include "metrology/studies/arm_study.h"

#include <algorithm>
#include <cmath>

#include "metrology/studies/artefact_fit.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

absl::Status CheckScans(const std::vector<LineScan>& scans) {
  if (scans.size() < kFewestArmScans)
    return Refuse("scans", std::to_string(scans.size()) + " of them", "at least 5 scans of the artefact");
  for (const LineScan& scan : scans)
    for (const Eigen::Vector3d& p : scan.points_mm)
      if (!p.allFinite()) return Refuse("scans", scan.id + " with a point that is not finite", "finite ones");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<ArmDisplacement>> StudyArm(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                      const ArmStudyOptions& options) {
  if (absl::Status s = Validate(artefact); !s.ok()) return s;
  if (absl::Status s = CheckScans(scans); !s.ok()) return s;
  std::vector<ArmDisplacement> displacements;
  Eigen::Isometry3d machine_from_artefact;
  ArtefactFit first;
  for (const LineScan& scan : scans) {
    if (options.keep_going && !options.keep_going()) return absl::CancelledError("the caller is gone");
    if (displacements.empty()) {
      const absl::StatusOr<ArtefactFit> pose = FitArtefactPose(scan, artefact, options.optics, options.sensor);
      if (!pose.ok()) return pose.status();
      machine_from_artefact = pose->machine_from_artefact;
    } else if (absl::Status shown = CheckShown(scan, artefact, options.sensor); !shown.ok()) {
      return shown;
    }
    const absl::StatusOr<ArtefactFit> fit =
        FitSensorPose(scan, artefact, options.optics, options.sensor, machine_from_artefact);
    if (!fit.ok()) return fit.status();
    if (displacements.empty()) first = *fit;
    ArmDisplacement& d = displacements.emplace_back();
    d.scan = scan.id;
    d.residual_rms_mm = fit->residual_rms_mm;
    if (displacements.size() == 1) {
      d.covariance.setZero();  // against itself
      continue;
    }
    d.translation_mm = fit->sensor.t_sm_mm - first.sensor.t_sm_mm;
    d.angles = CardanFromRotation(fit->sensor.rotation * first.sensor.rotation.transpose());
    d.covariance = fit->covariance + first.covariance;
  }
  return displacements;
}

absl::StatusOr<ArmSpread> ArmSpreadOf(const std::vector<ArmDisplacement>& displacements,
                                      const Vector6d& displacement_sigma) {
  const auto count = static_cast<Eigen::Index>(displacements.size());
  if (count < kFewestArmScans)
    return Refuse("displacements", std::to_string(count), "at least " + std::to_string(kFewestArmScans));
  Eigen::Matrix<double, kSensorParameterCount, Eigen::Dynamic> all(kSensorParameterCount, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ArmDisplacement& one = displacements[static_cast<std::size_t>(i)];
    all.col(i) << VectorFromRotation(RotationFromCardan(one.angles)), one.translation_mm;
  }
  if (!all.allFinite() || !displacement_sigma.allFinite())
    return Refuse("displacements", "not finite", "finite translations, angles and uncertainties");
  const Vector6d mean = all.rowwise().mean();
  all.colwise() -= mean;
  const double freedom = static_cast<double>(count - 1);
  const SensorCovariance seen = all * all.transpose() / freedom;
  // Each coordinate scaled to what is the arm's: that stays a covariance.
  Vector6d share = Vector6d::Zero();
  for (Eigen::Index k = 0; k < kSensorParameterCount; ++k) {
    const double noise = displacement_sigma[k] * displacement_sigma[k] / 2;  // of one of the two fits
    const double arm = std::max(seen(k, k) - noise, noise * std::sqrt(2 / freedom));
    if (seen(k, k) > 0) share[k] = std::sqrt(std::min(1.0, arm / seen(k, k)));
  }
  return ArmSpread{share.asDiagonal() * seen * share.asDiagonal(), freedom};
}

}  // namespace sixpoint::metrology
