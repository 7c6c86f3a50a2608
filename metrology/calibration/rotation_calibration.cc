#include "metrology/calibration/rotation_calibration.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>

namespace sixpoint::metrology {
namespace {

constexpr double kDegrees = M_PI / 180;
constexpr int kParameters = 11;  // 8 of the axes, 3 of the sphere
using Vector11d = Eigen::Matrix<double, kParameters, 1>;
using Matrix11d = Eigen::Matrix<double, kParameters, kParameters>;

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

absl::Status CheckPoses(const std::vector<SpherePose>& poses) {
  double a_low = 1e9, a_high = -1e9, b_low = 1e9, b_high = -1e9;
  int used = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    const SpherePose& p = poses[i];
    if (!std::isfinite(p.a_rad) || !std::isfinite(p.b_rad) || !p.centre_mm.allFinite() ||
        p.centre_mm.cwiseAbs().maxCoeff() > 1e5)
      return absl::InvalidArgumentError("poses[" + std::to_string(i) +
                                        "]: not finite or off the machine, want degrees and mm in machine coordinates");
    if (p.held_out) continue;
    ++used;
    a_low = std::min(a_low, p.a_rad);
    a_high = std::max(a_high, p.a_rad);
    b_low = std::min(b_low, p.b_rad);
    b_high = std::max(b_high, p.b_rad);
  }
  constexpr double kLeastTurn = 20 * kDegrees;
  const auto turn = [](double low, double high) { return high < low ? "0" : Number((high - low) / kDegrees); };
  constexpr int kFewestPoses = 6;
  if (a_high - a_low < kLeastTurn)
    return absl::FailedPreconditionError("A axis is not determined: A turns by " + turn(a_low, a_high) + " deg over " +
                                         std::to_string(used) +
                                         " poses of the fit; probe the sphere over at least 20 deg of A");
  if (b_high - b_low < kLeastTurn)
    return absl::FailedPreconditionError("B axis is not determined: B turns by " + turn(b_low, b_high) + " deg over " +
                                         std::to_string(used) +
                                         " poses of the fit; probe the sphere over at least 20 deg of B");
  if (used < kFewestPoses)
    return absl::FailedPreconditionError("poses: " + std::to_string(used) + " for the fit, want at least " +
                                         std::to_string(kFewestPoses) + " that differ in A and in B");
  return absl::OkStatus();
}

Eigen::Vector3d ResidualOf(const RotaryAxes& axes, const Eigen::Vector3d& sphere, const SpherePose& pose) {
  return axes.MachineFromZero(pose.a_rad, pose.b_rad) * sphere - pose.centre_mm;
}

// The point along a line is free: take the one nearest to where the record has it.
void SlideTo(const Eigen::Vector3d& place, AxisLine* axis) {
  axis->point_mm += axis->direction * axis->direction.dot(place - axis->point_mm);
}

// Point C's derivative by the axis parameters, by central differences (closed-form point, smooth).
Eigen::Matrix<double, 3, 8> PointCJacobian(const RotaryAxes& axes) {
  Eigen::Matrix<double, 3, 8> jacobian;
  for (int k = 0; k < 8; ++k) {
    const double step = k % 4 < 2 ? 1e-6 : 1e-3;
    Eigen::Matrix<double, 8, 1> w = Eigen::Matrix<double, 8, 1>::Zero();
    w(k) = step;
    jacobian.col(k) = (axes.Perturbed(w).PointC() - axes.Perturbed(-w).PointC()) / (2 * step);
  }
  return jacobian;
}

void Summarise(const std::vector<SpherePose>& poses, RotationCalibration* result) {
  double fit = 0, check = 0;
  int fit_count = 0;
  result->distances_mm.clear();
  result->check_count = 0;
  for (const SpherePose& pose : poses) {
    const double distance = ResidualOf(result->axes, result->sphere_in_zero_mm, pose).norm();
    result->distances_mm.push_back(distance);
    (pose.held_out ? check : fit) += distance * distance;
    (pose.held_out ? result->check_count : fit_count) += 1;
  }
  result->residual_rms_mm = std::sqrt(fit / fit_count);
  result->check_rms_mm = result->check_count > 0 ? std::sqrt(check / result->check_count) : 0;
  result->point_c_mm = result->axes.PointC();
  const Eigen::Matrix<double, 3, 8> jacobian = PointCJacobian(result->axes);
  result->point_c_covariance_mm2 = jacobian * result->covariance * jacobian.transpose();
}

constexpr double kWorstResidualMm = 0.2;

// The record knows each axis well enough to tell other units or another machine.
absl::Status CheckNominal(const char* name, const AxisLine& found, const AxisLine& nominal) {
  constexpr double kFarthestMm = 10, kGreatestTurn = 2 * kDegrees;
  const double off = found.direction.cross(nominal.point_mm - found.point_mm).norm();
  const double turned = std::acos(std::min(1.0, std::abs(found.direction.dot(nominal.direction))));
  if (off <= kFarthestMm && turned <= kGreatestTurn) return absl::OkStatus();
  return absl::FailedPreconditionError(std::string(name) + " axis was found " + Number(off) + " mm and " +
                                       Number(turned / kDegrees) + " deg from the machine's record, want within " +
                                       Number(kFarthestMm) + " mm and " + Number(kGreatestTurn / kDegrees) +
                                       " deg: check the poses' units (mm, deg) and that they are of this machine");
}

absl::Status CheckAgreement(const std::vector<SpherePose>& poses, const RotationOptions& options,
                            const RotationCalibration& result) {
  if (absl::Status s = CheckNominal("A", result.axes.a, options.nominal.a); !s.ok()) return s;
  if (absl::Status s = CheckNominal("B", result.axes.b, options.nominal.b); !s.ok()) return s;
  for (size_t i = 0; i < poses.size(); ++i)
    if (!poses[i].held_out && result.distances_mm[i] > kWorstResidualMm)
      return absl::FailedPreconditionError("poses[" + std::to_string(i) + "]: " + Number(1e3 * result.distances_mm[i]) +
                                           " um from the fit, want at most " + Number(1e3 * kWorstResidualMm) +
                                           " um: probe it again, or check its A, B and units");
  return absl::OkStatus();
}

// The noise of one coordinate: as stated, or as the residuals show where nothing was stated or they are clearly worse.
double NoiseOf(double squares, double freedom, double stated) {
  const double seen = std::sqrt(squares / std::max(1.0, freedom));
  if (stated <= 0) return seen;
  return seen > 1.5 * stated ? seen : stated;
}

}  // namespace

absl::StatusOr<RotationCalibration> CalibrateRotation(const std::vector<SpherePose>& poses,
                                                      const RotationOptions& options) {
  if (absl::Status s = CheckPoses(poses); !s.ok()) return s;
  RotationCalibration result;
  result.axes = options.nominal;
  std::vector<const SpherePose*> used;
  for (const SpherePose& pose : poses)
    if (!pose.held_out) used.push_back(&pose);
  for (const SpherePose* pose : used)
    result.sphere_in_zero_mm += result.axes.MachineFromZero(pose->a_rad, pose->b_rad).inverse() * pose->centre_mm /
                                static_cast<double>(used.size());
  const double lever = std::max(1.0, (result.sphere_in_zero_mm - options.nominal.a.point_mm).norm());
  Vector11d scale = Vector11d::Ones();
  for (const int k : {0, 1, 4, 5}) scale(k) = 1 / lever;

  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd jacobian(rows, kParameters);
  Eigen::VectorXd residual(rows);
  const auto linearise = [&] {
    for (size_t i = 0; i < used.size(); ++i) {
      const SpherePose& pose = *used[i];
      const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
      jacobian.block<3, 8>(row, 0) = result.axes.ParameterJacobian(result.sphere_in_zero_mm, pose.a_rad, pose.b_rad);
      jacobian.block<3, 3>(row, 8) = result.axes.MachineFromZero(pose.a_rad, pose.b_rad).linear();
      residual.segment<3>(row) = ResidualOf(result.axes, result.sphere_in_zero_mm, pose);
    }
    jacobian = jacobian * scale.asDiagonal();
  };
  constexpr int kMostIterations = 30;
  constexpr double kSettledMm = 1e-9;
  for (int iteration = 0; iteration < kMostIterations && !result.converged; ++iteration) {
    linearise();
    const Vector11d step = jacobian.colPivHouseholderQr().solve(-residual);
    if (!step.allFinite() || step.cwiseAbs().maxCoeff() > 1e3)
      return absl::FailedPreconditionError(
          "the axes are not determined by these poses: the solution runs away; probe the "
          "sphere off both axes and over a wider range of A and B");
    const Vector11d w = scale.cwiseProduct(step);
    result.axes = result.axes.Perturbed(w.head<8>());
    result.sphere_in_zero_mm += w.tail<3>();
    result.iterations = iteration + 1;
    result.converged = step.cwiseAbs().maxCoeff() < kSettledMm;
  }
  SlideTo(options.nominal.a.point_mm, &result.axes.a);
  SlideTo(options.nominal.b.point_mm, &result.axes.b);
  linearise();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian, Eigen::ComputeThinV);
  const Eigen::VectorXd& singular = svd.singularValues();
  result.condition_number = singular(0) / singular(kParameters - 1);
  constexpr double kWorstCondition = 1e4;
  if (!(result.condition_number < kWorstCondition)) {
    Eigen::Index weakest;
    svd.matrixV().col(kParameters - 1).cwiseAbs().maxCoeff(&weakest);
    const std::string which = weakest < 4 ? "A axis" : weakest < 8 ? "B axis" : "sphere";
    return absl::FailedPreconditionError(which + " is not determined: condition number " +
                                         Number(result.condition_number) + ", want below " + Number(kWorstCondition) +
                                         "; probe the sphere farther from the axes and over a wider range of A and B");
  }
  result.noise_mm =
      NoiseOf(residual.squaredNorm(), static_cast<double>(rows - kParameters), options.standard_uncertainty_mm);
  const Eigen::VectorXd inverse_squares = singular.cwiseInverse().cwiseAbs2();
  const Matrix11d full = svd.matrixV() * inverse_squares.asDiagonal() * svd.matrixV().transpose();
  const Matrix11d covariance = result.noise_mm * result.noise_mm * (scale.asDiagonal() * full * scale.asDiagonal());
  result.covariance = covariance.topLeftCorner<8, 8>();
  result.covariance = (result.covariance + result.covariance.transpose().eval()) / 2;
  Summarise(poses, &result);
  if (absl::Status s = CheckAgreement(poses, options, result); !s.ok()) return s;
  return result;
}

absl::StatusOr<RotationCalibration> CalibratePointC(const std::vector<SpherePose>& poses,
                                                    const RotationOptions& options) {
  if (absl::Status s = CheckPoses(poses); !s.ok()) return s;
  std::vector<const SpherePose*> used;
  for (const SpherePose& pose : poses)
    if (!pose.held_out) used.push_back(&pose);
  const auto turn_of = [&](const SpherePose& p) {
    return Eigen::Matrix3d(options.nominal.MachineFromZero(p.a_rad, p.b_rad).linear());
  };
  // centre_i - C = D_i (centre_0 - C), D_i = R_i R_0^-1: linear in C.
  const Eigen::Matrix3d first_inverse = turn_of(*used[0]).transpose();
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(used.size() - 1);
  Eigen::MatrixXd matrix(rows, 3);
  Eigen::VectorXd right(rows);
  for (size_t i = 1; i < used.size(); ++i) {
    const Eigen::Matrix3d turn = turn_of(*used[i]) * first_inverse;
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i - 1);
    matrix.block<3, 3>(row, 0) = Eigen::Matrix3d::Identity() - turn;
    right.segment<3>(row) = used[i]->centre_mm - turn * used[0]->centre_mm;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  RotationCalibration result;
  result.condition_number = svd.singularValues()(0) / svd.singularValues()(2);
  if (!(result.condition_number < 1e4))
    return absl::FailedPreconditionError("Point C is not determined: condition number " +
                                         Number(result.condition_number) +
                                         "; probe the sphere over a wider range of A and B");
  const Eigen::Vector3d c = svd.solve(right);
  result.axes = options.nominal;
  result.axes.a.point_mm = result.axes.b.point_mm = c;
  result.sphere_in_zero_mm =
      options.nominal.MachineFromZero(used[0]->a_rad, used[0]->b_rad).linear().transpose() * (used[0]->centre_mm - c) +
      c;
  result.converged = true;
  result.iterations = 1;
  // Noise of the first pose enters every row: covariance of the solution with rows i and j sharing it.
  const double squares = (matrix * c - right).squaredNorm();
  // A row differs by two probed centres, each of unit turn: twice the variance of one coordinate.
  result.noise_mm = NoiseOf(squares / 2, static_cast<double>(rows - 3), options.standard_uncertainty_mm);
  const Eigen::MatrixXd solve =
      svd.matrixV() * svd.singularValues().cwiseInverse().asDiagonal() * svd.matrixU().transpose();
  Eigen::Matrix3d shared = Eigen::Matrix3d::Zero();
  for (size_t i = 1; i < used.size(); ++i)
    shared += solve.middleCols<3>(3 * static_cast<Eigen::Index>(i - 1)) * turn_of(*used[i]) * first_inverse;
  const Eigen::Matrix3d covariance =
      result.noise_mm * result.noise_mm * (solve * solve.transpose() + shared * shared.transpose());
  Eigen::Matrix<double, 8, 3> spread = Eigen::Matrix<double, 8, 3>::Zero();
  spread.middleRows<2>(2) = TangentBasis(options.nominal.a.direction).transpose();
  spread.middleRows<2>(6) = TangentBasis(options.nominal.b.direction).transpose();
  result.covariance = spread * covariance * spread.transpose();
  Summarise(poses, &result);
  result.point_c_mm = c;
  result.point_c_covariance_mm2 = covariance;
  if (absl::Status s = CheckAgreement(poses, options, result); !s.ok()) return s;
  return result;
}

}  // namespace sixpoint::metrology
