
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "metrology/calibration/sensor_calibration.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeverMm = 10;  // half the artefact: what an angle means in mm

}  // namespace

double ConditionNumber(const Matrix6d& covariance) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(kLeverMm);
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
  using Centres = absl::StatusOr<std::vector<FeatureCentre>>;
  std::vector<Centres> found(scans.size(), Centres(std::vector<FeatureCentre>{}));
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
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
