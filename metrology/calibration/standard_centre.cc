#include <cmath>

#include "metrology/calibration/probing_noise.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/rotation_evidence.h"
#include "metrology/kinematics/linear_axes.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/linear_algebra/singular_values.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

struct Bore {
  Eigen::Vector2d centre_mm;
  double radius_mm = 0;
  Eigen::Matrix2d inverse;  // of the centre's normal matrix
  double squares = 0;       // of the residuals
  double condition_number = 0;
};

// Least squares of the distances from the circle, from the algebraic circle.
absl::StatusOr<Bore> FitBore(const Points& points) {
  const auto rows = static_cast<Eigen::Index>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p.head<2>() / static_cast<double>(rows);
  Eigen::MatrixXd matrix(rows, 3);
  Eigen::VectorXd right(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Vector2d p = points[static_cast<size_t>(i)].head<2>() - mean;
    matrix.row(i) << 2 * p.x(), 2 * p.y(), 1;
    right(i) = p.squaredNorm();
  }
  const Eigen::Vector3d start = LeastSquares(matrix, right);
  Bore bore;
  bore.centre_mm = start.head<2>();
  bore.radius_mm = std::sqrt(std::max(0.0, start.z() + start.head<2>().squaredNorm()));
  Eigen::VectorXd residual(rows);
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      const Eigen::Vector2d out = points[static_cast<size_t>(i)].head<2>() - mean - bore.centre_mm;
      const double distance = std::max(out.norm(), 1e-9);
      matrix.row(i) << -out.x() / distance, -out.y() / distance, -1;
      residual(i) = distance - bore.radius_mm;
    }
    const Eigen::Vector3d step = LeastSquares(matrix, -residual);
    if (round + 1 == kRounds || step.norm() < 1e-12) break;
    bore.centre_mm += step.head<2>();
    bore.radius_mm += step.z();
  }
  const SingularValueDecomposition svd = DecomposeSingular(matrix);
  bore.condition_number = svd.values(0) / svd.values(2);
  constexpr double kWorstArcCondition = 30;  // an arc of some 40 deg
  if (!(bore.condition_number < kWorstArcCondition) || !bore.centre_mm.allFinite())
    return absl::FailedPreconditionError("bore_mm is not determined: condition number " +
                                         Rounded(bore.condition_number) + ", want below " +
                                         Rounded(kWorstArcCondition) + "; touch the bore all round");
  const Eigen::Matrix3d inverse =
      svd.right * svd.values.cwiseInverse().cwiseAbs2().asDiagonal() * svd.right.transpose();
  bore.inverse = inverse.topLeftCorner<2, 2>();
  bore.squares = residual.squaredNorm();
  bore.centre_mm += mean;
  return bore;
}

absl::Status CheckPoints(const std::string& field, const Points& points, size_t fewest) {
  if (points.size() < fewest)
    return Refuse(field, std::to_string(points.size()) + " points", "at least " + std::to_string(fewest));
  for (size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite() || points[i].cwiseAbs().maxCoeff() > 1e5)
      return Refuse(field + "[" + std::to_string(i) + "]", "not finite or off the machine",
                    "mm in machine coordinates");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<RotationCalibration> CalibrateStandardCentre(const StandardProbing& probing,
                                                            const std::vector<SpherePose>& commanded,
                                                            const RotationOptions& options) {
  if (absl::Status s = CheckPoints("bore_mm", probing.bore_mm, 4); !s.ok()) return s;
  if (absl::Status s = CheckPoints("face_mm", probing.face_mm, 3); !s.ok()) return s;
  if (!(std::abs(probing.face_above_centre_mm) < 1e4))
    return Refuse("face_above_centre_mm", probing.face_above_centre_mm, "within 10000 mm");
  if (absl::Status s = CheckPoses(commanded, options); !s.ok()) return s;
  const absl::StatusOr<Bore> bore = FitBore(probing.bore_mm);
  if (!bore.ok()) return bore.status();
  const auto faces = static_cast<double>(probing.face_mm.size()), bores = static_cast<double>(probing.bore_mm.size());
  double height = 0, squares = bore->squares;
  for (const Eigen::Vector3d& p : probing.face_mm) height += p.z() / faces;
  for (const Eigen::Vector3d& p : probing.face_mm) squares += (p.z() - height) * (p.z() - height);

  RotationCalibration result;
  result.axes = options.nominal;
  result.converged = true;
  result.iterations = 1;
  result.condition_number = bore->condition_number;
  const ProbingNoise noise = ProbingNoiseOf(squares, bores + faces - 4, options.standard_uncertainty_mm);
  result.noise_mm = noise.standard_uncertainty_mm;
  result.degrees_of_freedom = noise.degrees_of_freedom;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() = bore->inverse;
  covariance(2, 2) = 1 / faces;
  covariance *= result.noise_mm * result.noise_mm;
  const Eigen::Vector3d c(bore->centre_mm.x(), bore->centre_mm.y(), height - probing.face_above_centre_mm);
  const FoundPointC found{c, covariance, LinearAxesJacobian(c)};  // the mean of what was touched
  SetPointC(found, &result);
  std::vector<SpherePose> checks = ReachedPoses(commanded, options);
  for (SpherePose& pose : checks) pose.held_out = true;
  if (!checks.empty()) result.sphere_in_zero_mm = BestSphere(result.axes, checks, true);
  AddEvidence(checks, options, &result);
  SetPointC(found, &result);
  result.residual_rms_mm = std::sqrt(squares / (bores + faces));
  constexpr double kWorstRms = 0.2;
  if (result.residual_rms_mm > kWorstRms)
    return absl::FailedPreconditionError("bore_mm, face_mm: " + Rounded(1e3 * result.residual_rms_mm) +
                                         " um about the bore and the face, want at most " + Rounded(1e3 * kWorstRms) +
                                         " um: touch them again, or check their units");
  if (absl::Status s = CheckAgreement(checks, options, result); !s.ok()) return s;
  if (checks.size() > 1) {
    Eigen::MatrixXd of_axes = Eigen::MatrixXd::Zero(kAxisParameterCount + 3, kAxisParameterCount + 3);
    of_axes.topLeftCorner<kAxisParameterCount, kAxisParameterCount>() = result.covariance;
    result.judgements.push_back(JudgePoses(kAxesMeet, checks, result, of_axes, 3));  // the sphere's place is theirs
  }
  return result;
}

}  // namespace sixpoint::metrology
