#include "metrology/calibration/rotation_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "metrology/calibration/probing_noise.h"
#include "metrology/calibration/rotation_evidence.h"
#include "metrology/kinematics/linear_axes.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/linear_algebra/singular_values.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr int kParameters = kAxisParameterCount + 3;  // and the sphere's centre
using ParameterVector = Eigen::Matrix<double, kParameters, 1>;
using ParameterMatrix = Eigen::Matrix<double, kParameters, kParameters>;

constexpr int kCircleParameters = 6;  // Point C and the sphere's place about it

constexpr double kWorstCondition = 1e4;

// The point along a line is free: take the one nearest to where the record has it.
void SlideTo(const Eigen::Vector3d& place, AxisLine* axis) {
  axis->point_mm += axis->direction * axis->direction.dot(place - axis->point_mm);
}

// centre_i = C + R_i q, both free: of all poses, each with its own noise alone. The rows that Point C is found from share the first
// pose's, and C has taken up as much of that as it could: their squares say too little.
template <typename TurnOf>
double SquaresAboutCircles(const std::vector<const SpherePose*>& used, const TurnOf& turn_of) {
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd matrix(rows, 6);
  Eigen::VectorXd right(rows);
  for (size_t i = 0; i < used.size(); ++i) {
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    matrix.block<3, 3>(row, 0).setIdentity();
    matrix.block<3, 3>(row, 3) = turn_of(*used[i]);
    right.segment<3>(row) = used[i]->centre_mm;
  }
  return (matrix * LeastSquares(matrix, right) - right).squaredNorm();
}

// What two lines explain of the poses beyond circles about one point in recorded directions, over what noise does. Nothing where the poses do
// not determine two lines.
std::optional<ResidualJudgement> JudgeClaim(const std::vector<SpherePose>& commanded, const RotationOptions& options,
                                            double circle_squares, double count) {
  const auto lines = CalibrateRotation(commanded, options);
  if (!lines.ok() || count <= kParameters) return std::nullopt;
  double line_squares = 0;
  const std::vector<SpherePose> poses = ReachedPoses(commanded, options);
  for (const SpherePose& pose : poses)
    if (!pose.held_out) line_squares += ResidualOf(lines->axes, lines->sphere_in_zero_mm, pose).squaredNorm();
  const double variance = std::pow(std::max(lines->noise_mm, kLeastProbingNoiseMm), 2);
  return JudgeSquares(kAxesMeet, std::max(0.0, circle_squares - line_squares) / variance,
                      kParameters - kCircleParameters, lines->degrees_of_freedom);
}

void SetNoise(const ProbingNoise& noise, RotationCalibration* result) {
  result->noise_mm = noise.standard_uncertainty_mm;
  result->degrees_of_freedom = noise.degrees_of_freedom;
}

}  // namespace

absl::StatusOr<RotationCalibration> CalibrateRotation(const std::vector<SpherePose>& commanded,
                                                      const RotationOptions& options) {
  if (absl::Status s = CheckPoses(commanded, options); !s.ok()) return s;
  if (absl::Status s = CheckTurns(commanded, options); !s.ok()) return s;
  const std::vector<SpherePose> poses = ReachedPoses(commanded, options);
  RotationCalibration result;
  result.axes = options.nominal;
  std::vector<SpherePose> used, held_out;
  for (const SpherePose& pose : poses) (pose.held_out ? held_out : used).push_back(pose);
  result.sphere_in_zero_mm = BestSphere(result.axes, poses, false);
  const double lever = std::max(1.0, (result.sphere_in_zero_mm - options.nominal.a.point_mm).norm());
  ParameterVector scale = ParameterVector::Ones();
  for (int k = 0; k < kAxisParameterCount; ++k)
    if (kAxisParameters[static_cast<std::size_t>(k)].unit == ParameterUnit::kRad) scale(k) = 1 / lever;

  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
  const auto linearise = [&] {
    PoseRows linear = RowsOf(used, result);
    jacobian = linear.jacobian * scale.asDiagonal();
    residual = std::move(linear.residuals_mm);
  };
  constexpr int kMostIterations = 30;
  constexpr double kSettledMm = 1e-9;
  for (int iteration = 0; iteration < kMostIterations && !result.converged; ++iteration) {
    linearise();
    const ParameterVector step = LeastSquares(jacobian, -residual);
    if (!step.allFinite() || step.cwiseAbs().maxCoeff() > 1e3)
      return absl::FailedPreconditionError(
          "the axes are not determined by these poses: the solution runs away; probe the sphere off both axes and over "
          "a wider range of " +
          BothAxes(options));
    const ParameterVector w = scale.cwiseProduct(step);
    result.axes = result.axes.Perturbed(w.head<kAxisParameterCount>());
    result.sphere_in_zero_mm += w.tail<3>();
    result.iterations = iteration + 1;
    result.converged = step.cwiseAbs().maxCoeff() < kSettledMm;
  }
  SlideTo(options.nominal.a.point_mm, &result.axes.a);
  SlideTo(options.nominal.b.point_mm, &result.axes.b);
  linearise();
  const auto [singular, left, right] = DecomposeSingular(jacobian);
  result.condition_number = singular(0) / singular(kParameters - 1);
  if (!(result.condition_number < kWorstCondition)) {
    Eigen::Index weakest;
    right.col(kParameters - 1).cwiseAbs().maxCoeff(&weakest);
    const std::string which =
        weakest < kAxisParameterCount
            ? options.joints[static_cast<size_t>(weakest / (kAxisParameterCount / 2))].axis + " axis"
            : std::string("sphere");
    return absl::FailedPreconditionError(which + " is not determined: condition number " +
                                         Rounded(result.condition_number) + ", want below " + Rounded(kWorstCondition) +
                                         "; probe the sphere farther from the axes and over a wider range of " +
                                         BothAxes(options));
  }
  SetNoise(
      ProbingNoiseOf(residual.squaredNorm(), static_cast<double>(rows - kParameters), options.standard_uncertainty_mm),
      &result);
  const Eigen::VectorXd inverse_squares = singular.cwiseInverse().cwiseAbs2();
  const ParameterMatrix full = right * inverse_squares.asDiagonal() * right.transpose();
  const ParameterMatrix covariance =
      result.noise_mm * result.noise_mm * (scale.asDiagonal() * full * scale.asDiagonal());
  result.covariance = covariance.topLeftCorner<kAxisParameterCount, kAxisParameterCount>();
  result.covariance = (result.covariance + result.covariance.transpose().eval()) / 2;
  Eigen::MatrixXd read(rows, kLinearParameterCount);
  for (size_t i = 0; i < used.size(); ++i)
    read.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = LinearAxesJacobian(used[i].centre_mm);
  const Eigen::MatrixXd follows = right * singular.cwiseInverse().asDiagonal() * (left.transpose() * read);
  result.linear_response = (scale.asDiagonal() * follows).topRows<kAxisParameterCount>();
  AddEvidence(poses, options, &result);
  if (absl::Status s = CheckAgreement(poses, options, result); !s.ok()) return s;
  if (!held_out.empty()) result.judgements.push_back(JudgePoses("held-out poses", held_out, result, covariance, 0));
  return result;
}

absl::StatusOr<RotationCalibration> CalibratePointC(const std::vector<SpherePose>& commanded,
                                                    const RotationOptions& options) {
  if (absl::Status s = CheckPoses(commanded, options); !s.ok()) return s;
  if (absl::Status s = CheckTurns(commanded, options); !s.ok()) return s;
  const std::vector<SpherePose> poses = ReachedPoses(commanded, options);
  std::vector<const SpherePose*> used;
  for (const SpherePose& pose : poses)
    if (!pose.held_out) used.push_back(&pose);
  const auto turn_of = [&](const SpherePose& p) {
    return Eigen::Matrix3d(options.nominal.MachineFromZero(p.a_rad, p.b_rad).linear());
  };
  // centre_i - C = D_i (centre_0 - C), D_i = R_i R_0^-1: linear in C.
  const Eigen::Matrix3d first_inverse = turn_of(*used[0]).transpose();
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(used.size() - 1);
  Eigen::MatrixXd matrix(rows, 3), read(rows, kLinearParameterCount);
  Eigen::VectorXd right(rows);
  for (size_t i = 1; i < used.size(); ++i) {
    const Eigen::Matrix3d turn = turn_of(*used[i]) * first_inverse;
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i - 1);
    matrix.block<3, 3>(row, 0) = Eigen::Matrix3d::Identity() - turn;
    right.segment<3>(row) = used[i]->centre_mm - turn * used[0]->centre_mm;
    read.middleRows<3>(row) = LinearAxesJacobian(used[i]->centre_mm) - turn * LinearAxesJacobian(used[0]->centre_mm);
  }
  const SingularValueDecomposition svd = DecomposeSingular(matrix);
  RotationCalibration result;
  result.axes = options.nominal;
  result.condition_number = svd.values(0) / svd.values(2);
  if (!(result.condition_number < kWorstCondition))
    return absl::FailedPreconditionError("Point C is not determined: condition number " +
                                         Rounded(result.condition_number) +
                                         "; probe the sphere over a wider range of " + BothAxes(options));
  const Eigen::MatrixXd solve = svd.right * svd.values.cwiseInverse().asDiagonal() * svd.left.transpose();
  const Eigen::Vector3d c = solve * right;
  FoundPointC found{c, Eigen::Matrix3d::Zero(), solve * read};
  SetPointC(found, &result);
  result.sphere_in_zero_mm =
      options.nominal.MachineFromZero(used[0]->a_rad, used[0]->b_rad).linear().transpose() * (used[0]->centre_mm - c) +
      c;
  result.converged = true;
  result.iterations = 1;
  // Noise of the first pose enters every row: covariance of the solution with rows i and j sharing it.
  const double circles = SquaresAboutCircles(used, turn_of);
  SetNoise(ProbingNoiseOf(circles, static_cast<double>(3 * used.size() - kCircleParameters),
                          options.standard_uncertainty_mm),
           &result);
  Eigen::Matrix3d shared = Eigen::Matrix3d::Zero();
  for (size_t i = 1; i < used.size(); ++i)
    shared += solve.middleCols<3>(3 * static_cast<Eigen::Index>(i - 1)) * turn_of(*used[i]) * first_inverse;
  found.covariance_mm2 = result.noise_mm * result.noise_mm * (solve * solve.transpose() + shared * shared.transpose());
  AddEvidence(poses, options, &result);
  SetPointC(found, &result);
  if (absl::Status s = CheckAgreement(poses, options, result); !s.ok()) return s;
  if (const auto judged = JudgeClaim(commanded, options, circles, static_cast<double>(3 * used.size())))
    result.judgements.push_back(*judged);
  return result;
}

}  // namespace sixpoint::metrology
