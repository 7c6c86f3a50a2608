#include "metrology/calibration/rotation_evidence.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kWorstResidualMm = 0.2;

double AngleOf(const SpherePose& pose, int joint) { return joint == 0 ? pose.a_rad : pose.b_rad; }

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

// The record knows each axis well enough to tell other units or another machine.
absl::Status CheckNominal(const std::string& name, const AxisLine& found, const AxisLine& nominal) {
  constexpr double kFarthestOffMm = 10, kGreatestTurn = 2 * kRadPerDeg;
  const double off = found.direction.cross(nominal.point_mm - found.point_mm).norm();
  const double turned = std::acos(std::min(1.0, std::abs(found.direction.dot(nominal.direction))));
  if (off <= kFarthestOffMm && turned <= kGreatestTurn) return absl::OkStatus();
  return absl::FailedPreconditionError(name + " axis was found " + Rounded(off) + " mm and " +
                                       Rounded(turned / kRadPerDeg) + " deg from the machine's record, want within " +
                                       Rounded(kFarthestOffMm) + " mm and " + Rounded(kGreatestTurn / kRadPerDeg) +
                                       " deg: check the poses' units (mm, deg) and that they are of this machine");
}

}  // namespace

std::string BothAxes(const RotationOptions& options) {
  return options.joints[0].axis + " and " + options.joints[1].axis;
}

absl::Status CheckPoses(const std::vector<SpherePose>& poses, const RotationOptions& options) {
  for (size_t i = 0; i < poses.size(); ++i) {
    const SpherePose& p = poses[i];
    const std::string field = "poses[" + std::to_string(i) + "]";
    if (!std::isfinite(p.a_rad) || !std::isfinite(p.b_rad) || !p.centre_mm.allFinite() ||
        p.centre_mm.cwiseAbs().maxCoeff() > 1e5)
      return Refuse(field, "not finite or off the machine", "degrees and mm in machine coordinates");
    for (int k = 0; k < 2; ++k) {
      const RotaryJoint& joint = options.joints[static_cast<size_t>(k)];
      const double angle = AngleOf(p, k);
      // Limits come from degrees: what is at a limit is within it.
      constexpr double kRounding = 1e-9;
      if (angle < joint.minimum_rad - kRounding || angle > joint.maximum_rad + kRounding)
        return Refuse(field + "." + joint.axis, Rounded(angle / kRadPerDeg) + " deg",
                      Rounded(joint.minimum_rad / kRadPerDeg) + " to " + Rounded(joint.maximum_rad / kRadPerDeg) +
                          " deg, the axis's limits");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckTurns(const std::vector<SpherePose>& poses, const RotationOptions& options) {
  constexpr double kLeastTurn = 20 * kRadPerDeg;
  constexpr int kFewestPoses = 6;
  int used = 0;
  for (const SpherePose& p : poses) used += !p.held_out;
  for (int k = 0; k < 2; ++k) {
    double low = 1e9, high = -1e9;
    for (const SpherePose& p : poses) {
      if (p.held_out) continue;
      low = std::min(low, AngleOf(p, k));
      high = std::max(high, AngleOf(p, k));
    }
    if (high - low >= kLeastTurn) continue;
    const std::string& axis = options.joints[static_cast<size_t>(k)].axis;
    return absl::FailedPreconditionError(axis + " axis is not determined: " + axis + " turns by " +
                                         (used == 0 ? "0" : Rounded((high - low) / kRadPerDeg)) + " deg over " +
                                         std::to_string(used) +
                                         " poses of the fit; probe the sphere over at least 20 deg of " + axis);
  }
  if (used < kFewestPoses)
    return absl::FailedPreconditionError("poses: " + std::to_string(used) + " for the fit, want at least " +
                                         std::to_string(kFewestPoses) + " that differ in " + BothAxes(options));
  return absl::OkStatus();
}

std::vector<SpherePose> ReachedPoses(const std::vector<SpherePose>& commanded, const RotationOptions& options) {
  std::vector<SpherePose> reached = commanded;
  for (SpherePose& pose : reached) {
    if (const auto& table = options.joints[0].table) pose.a_rad = table->Reached(pose.a_rad, pose.a_travel);
    if (const auto& table = options.joints[1].table) pose.b_rad = table->Reached(pose.b_rad, pose.b_travel);
  }
  return reached;
}

Eigen::Vector3d ResidualOf(const RotaryAxes& axes, const Eigen::Vector3d& sphere_in_zero_mm, const SpherePose& pose) {
  return axes.MachineFromZero(pose.a_rad, pose.b_rad) * sphere_in_zero_mm - pose.centre_mm;
}

Eigen::Vector3d BestSphere(const RotaryAxes& axes, const std::vector<SpherePose>& poses, bool all) {
  double count = 0;
  for (const SpherePose& pose : poses) count += all || !pose.held_out;
  Eigen::Vector3d sphere = Eigen::Vector3d::Zero();
  for (const SpherePose& pose : poses)
    if (all || !pose.held_out)
      sphere += axes.MachineFromZero(pose.a_rad, pose.b_rad).inverse() * pose.centre_mm / count;
  return sphere;
}

void AddEvidence(const std::vector<SpherePose>& poses, const RotationOptions& options, RotationCalibration* result) {
  double fit = 0, check = 0;
  int fit_count = 0;
  result->distances_mm.clear();
  result->before_mm.clear();
  result->check_count = 0;
  for (const SpherePose& pose : poses) fit_count += !pose.held_out;
  const Eigen::Vector3d sphere_before = BestSphere(options.nominal, poses, fit_count == 0);
  for (const SpherePose& pose : poses) {
    const double distance = ResidualOf(result->axes, result->sphere_in_zero_mm, pose).norm();
    result->distances_mm.push_back(distance);
    result->before_mm.push_back(ResidualOf(options.nominal, sphere_before, pose).norm());
    (pose.held_out ? check : fit) += distance * distance;
    result->check_count += pose.held_out;
  }
  result->residual_rms_mm = fit_count > 0 ? std::sqrt(fit / fit_count) : 0;
  result->check_rms_mm = result->check_count > 0 ? std::sqrt(check / result->check_count) : 0;
  result->point_c_mm = result->axes.PointC();
  const Eigen::Matrix<double, 3, 8> jacobian = PointCJacobian(result->axes);
  result->point_c_covariance_mm2 = jacobian * result->covariance * jacobian.transpose();
}

PoseRows RowsOf(const std::vector<SpherePose>& poses, const RotationCalibration& result) {
  const auto count = 3 * static_cast<Eigen::Index>(poses.size());
  PoseRows rows{Eigen::MatrixXd(count, kAxisParameterCount + 3), Eigen::VectorXd(count)};
  for (size_t i = 0; i < poses.size(); ++i) {
    const SpherePose& pose = poses[i];
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    rows.jacobian.block<3, kAxisParameterCount>(row, 0) =
        result.axes.ParameterJacobian(result.sphere_in_zero_mm, pose.a_rad, pose.b_rad);
    rows.jacobian.block<3, 3>(row, kAxisParameterCount) = result.axes.MachineFromZero(pose.a_rad, pose.b_rad).linear();
    rows.residuals_mm.segment<3>(row) = ResidualOf(result.axes, result.sphere_in_zero_mm, pose);
  }
  return rows;
}

ResidualJudgement JudgePoses(const std::string& of, const std::vector<SpherePose>& poses,
                             const RotationCalibration& result, const Eigen::MatrixXd& covariance, double spent) {
  const PoseRows rows = RowsOf(poses, result);
  const Eigen::Index count = rows.residuals_mm.size();
  const double noise_mm = std::max(result.noise_mm, kLeastProbingNoiseMm);
  const Eigen::MatrixXd expected = noise_mm * noise_mm * Eigen::MatrixXd::Identity(count, count) +
                                   rows.jacobian * covariance * rows.jacobian.transpose();
  return JudgeResiduals(of, rows.residuals_mm, expected, result.degrees_of_freedom, spent);
}

void SetPointC(const FoundPointC& found, RotationCalibration* result) {
  Eigen::Matrix<double, 8, 3> spread = Eigen::Matrix<double, 8, 3>::Zero();
  spread.middleRows<2>(2) = TangentBasis(result->axes.a.direction).transpose();
  spread.middleRows<2>(6) = TangentBasis(result->axes.b.direction).transpose();
  result->axes.a.point_mm = result->axes.b.point_mm = result->point_c_mm = found.point_mm;
  result->covariance = spread * found.covariance_mm2 * spread.transpose();
  result->point_c_covariance_mm2 = found.covariance_mm2;
  result->linear_response = spread * found.linear_response;
}

absl::Status CheckAgreement(const std::vector<SpherePose>& poses, const RotationOptions& options,
                            const RotationCalibration& result) {
  if (absl::Status s = CheckNominal(options.joints[0].axis, result.axes.a, options.nominal.a); !s.ok()) return s;
  if (absl::Status s = CheckNominal(options.joints[1].axis, result.axes.b, options.nominal.b); !s.ok()) return s;
  for (size_t i = 0; i < poses.size(); ++i)
    if (!poses[i].held_out && result.distances_mm[i] > kWorstResidualMm)
      return absl::FailedPreconditionError("poses[" + std::to_string(i) +
                                           "]: " + Rounded(1e3 * result.distances_mm[i]) +
                                           " um from the fit, want at most " + Rounded(1e3 * kWorstResidualMm) +
                                           " um: probe it again, or check its " + BothAxes(options) + " and units");
  return absl::OkStatus();
}

absl::StatusOr<RotationOptions> RotationOptions::Of(const JointChain& chain) {
  const absl::StatusOr<RotaryAxes> axes = RotaryAxes::Of(chain);
  if (!axes.ok()) return axes.status();
  if (axes->a.direction.cross(axes->b.direction).norm() < 0.1)
    return absl::FailedPreconditionError(
        "kinematics.part_side: its two rotary joints are parallel, want two that turn about different directions");
  RotationOptions options;
  options.nominal = *axes;
  const std::vector<int> rotary = chain.PartSideRotary();
  for (size_t k = 0; k < 2; ++k) {
    const Joint& joint = chain.joints()[static_cast<size_t>(rotary[k])];
    options.joints[k] = {joint.axis, joint.minimum, joint.maximum, joint.table};
  }
  return options;
}

}  // namespace sixpoint::metrology
