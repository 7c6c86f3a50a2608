#include "metrology/correction/correct.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "metrology/kinematics/linear_axes.h"
#include "metrology/statistics/distance_quantile.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kPose = 6, kParameters = kPose + kAxisParameterCount;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

constexpr std::size_t kBeforeStarts = 4;  // values of the chain

// A quarter: of the gate's third, the rest is left for what uncertainty adds.
double AllowedTilt(const NominalHoleGroup& group) { return group.inclination_tolerance_rad / 4; }

// The estimates as they would be, had pose and axes been found moved by these parameters.
struct Chain {
  const NominalHoleGroup& group;
  const RegisteredPose& pose;
  const RotaryAxes& axes;
  Eigen::Affine3d growth;  // of the part, at zero

  // a, b, x and y of the turned direction, and then x, y, z of every start.
  absl::StatusOr<Eigen::VectorXd> operator()(const Parameters& change, const RotaryAngles& near,
                                             const RotaryLimits& limits) const {
    const Eigen::Isometry3d zero_from_part =
        Perturbed(pose.zero_from_part, change.head<kPose>(), pose.noise.reference_mm);
    const RotaryAxes moved = axes.Perturbed(change.tail<kAxisParameterCount>());
    const Eigen::Vector3d direction = zero_from_part.linear() * group.axis_in_part;
    const auto angles = Orient(moved, direction, near, limits, AllowedTilt(group));
    if (!angles.ok()) return angles.status();
    const Eigen::Isometry3d machine_from_zero = moved.MachineFromZero(angles->a_rad, angles->b_rad);
    Eigen::VectorXd values(kBeforeStarts + 3 * group.holes.size());
    values.head<2>() << angles->a_rad, angles->b_rad;
    values.segment<2>(2) = (machine_from_zero.linear() * direction).head<2>();
    for (std::size_t i = 0; i < group.holes.size(); ++i)
      values.segment<3>(kBeforeStarts + 3 * i) =
          machine_from_zero * (growth * (zero_from_part * group.holes[i].start_in_part_mm));
    return values;
  }
};

// OUT_OF_RANGE where a table takes a command beyond the limits that the angle itself keeps.
absl::Status CheckCommand(const char* axis, double command_rad, double minimum_rad, double maximum_rad) {
  constexpr double kSlackRad = 1e-12;  // as Orient's
  if (command_rad >= minimum_rad - kSlackRad && command_rad <= maximum_rad + kSlackRad) return absl::OkStatus();
  char text[160];
  std::snprintf(text, sizeof text, "%s_deg: %.6f by its axis table, want within %g..%g", axis, command_rad * 180 / kPi,
                minimum_rad * 180 / kPi, maximum_rad * 180 / kPi);
  return absl::OutOfRangeError(text);
}

// What each source does to the chain's values, a column a draw: as they are found, less what the linear axes read of where they should be.
Eigen::MatrixXd ValuesPerSigma(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& values,
                               const ErrorSource& source) {
  Eigen::MatrixXd per_sigma = jacobian.leftCols(kPose) * source.pose_per_sigma +
                              jacobian.rightCols(kAxisParameterCount) *
                                  source.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter);
  const auto linear = source.parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter);
  if (linear.isZero(0)) return per_sigma;
  for (Eigen::Index at = kBeforeStarts; at < values.size(); at += 3)
    per_sigma.middleRows<3>(at) -= LinearAxesJacobian(values.segment<3>(at)) * linear;
  return per_sigma;
}

// A named cause's part of the values' covariance: slope * causes * slope^T. Never made as a whole: a group may have thousands of holes.
struct Part {
  std::string source;
  double degrees_of_freedom;
  Eigen::MatrixXd slope, causes;

  double Variance(Eigen::Index row) const { return (slope.row(row) * causes * slope.row(row).transpose()).value(); }
  Eigen::Matrix3d OfStart(Eigen::Index first_row) const {
    return slope.middleRows<3>(first_row) * causes * slope.middleRows<3>(first_row).transpose();
  }
};

std::vector<Part> PartsOf(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& values, const RegisteredPose& pose) {
  const double known = std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd per_pose = jacobian.leftCols(kPose);
  std::vector<Part> parts = {{"noise of the scans", known, per_pose, pose.noise.values}};
  if (!pose.angles.empty()) parts.push_back({"angles of the scans", known, per_pose, PoseCovarianceOf(pose.angles)});
  for (const ErrorSource& source : pose.sources) {
    const Eigen::Index draws = source.pose_per_sigma.cols();
    parts.push_back({source.name, source.degrees_of_freedom, ValuesPerSigma(jacobian, values, source),
                     Eigen::MatrixXd::Identity(draws, draws)});
  }
  return parts;
}

// The hole's covariance from its parts, and what follows from it.
void SumUp(const std::vector<std::pair<const Part*, Eigen::Matrix3d>>& parts, CorrectedHole* hole) {
  constexpr double kUm2 = 1e6;
  for (const auto& [part, covariance_mm2] : parts) {
    hole->covariance_mm2 += covariance_mm2;
    if (const double variance_um2 = kUm2 * covariance_mm2.trace(); variance_um2 > 0)
      hole->components.push_back({part->source, variance_um2, part->degrees_of_freedom});
  }
  std::stable_sort(hole->components.begin(), hole->components.end(),
                   [](const auto& one, const auto& other) { return one.variance > other.variance; });
  hole->degrees_of_freedom = EffectiveDegreesOfFreedom(hole->components);
  constexpr double kProbability = 0.95;
  hole->expanded_uncertainty_um =
      1e3 * WideningOf(kProbability, hole->degrees_of_freedom, ComponentsOf(hole->covariance_mm2)) *
      DistanceQuantile(hole->covariance_mm2, kProbability);
}

// Central differences of the whole chain: it is so nearly linear over these steps that their error (about 1e-10) is nothing beside the
// covariances. Limits do not bind here: the branch is the one found.
absl::StatusOr<Eigen::MatrixXd> JacobianOf(const Chain& chain, const RotaryAngles& reached, Eigen::Index value_count) {
  const double free = 4 * kPi;
  const RotaryLimits unlimited{-free, free, -free, free};
  Eigen::MatrixXd jacobian(value_count, kParameters);
  for (int k = 0; k < kParameters; ++k) {
    const bool angle =
        k < kPose ? k < 3 : kAxisParameters[static_cast<std::size_t>(k - kPose)].unit == ParameterUnit::kRad;
    const double step = angle ? 1e-6 : 1e-4;
    Parameters change = Parameters::Zero();
    change[k] = step;
    const auto above = chain(change, reached, unlimited);
    const auto below = chain(-change, reached, unlimited);
    if (!above.ok()) return above.status();
    if (!below.ok()) return below.status();
    jacobian.col(k) = (*above - *below) / (2 * step);
  }
  return jacobian;
}

absl::Status Named(const std::string& group, const absl::Status& status) {
  return absl::Status(status.code(), "group " + group + ": " + std::string(status.message()));
}

}  // namespace

absl::StatusOr<CorrectedHoleGroup> CorrectGroup(const NominalHoleGroup& group, const RegisteredPose& pose,
                                                const Eigen::Isometry3d& zero_from_part_nominal, const RotaryAxes& axes,
                                                const RotaryAxes& nominal_axes, const RotaryLimits& limits,
                                                const Drilling& drilling) {
  const bool sources_finite = std::all_of(pose.sources.begin(), pose.sources.end(), [](const ErrorSource& source) {
    return source.parameters_per_sigma.allFinite() && source.pose_per_sigma.allFinite() &&
           source.pose_per_sigma.cols() == source.parameters_per_sigma.cols();
  });
  if (!pose.noise.values.allFinite() || !sources_finite || !pose.zero_from_part.matrix().allFinite())
    return Refuse("pose", "not finite", "a pose with finite covariances");
  const Chain chain{group, pose, axes, axes.Growth(drilling.stretch)};
  const auto values = chain(Parameters::Zero(), group.nominal, limits);
  if (!values.ok()) return Named(group.name, values.status());

  CorrectedHoleGroup result;
  result.name = group.name;
  result.nominal = group.nominal;
  result.reached = {(*values)[0], (*values)[1]};
  const RotaryPositioning& positioning = pose.positioning;
  result.corrected = {positioning.a.CommandFor(result.reached.a_rad), positioning.b.CommandFor(result.reached.b_rad)};
  for (const absl::Status& status :
       {CheckCommand("a", result.corrected.a_rad, limits.a_minimum_rad, limits.a_maximum_rad),
        CheckCommand("b", result.corrected.b_rad, limits.b_minimum_rad, limits.b_maximum_rad)})
    if (!status.ok()) return Named(group.name, status);
  const Eigen::Vector3d direction = pose.zero_from_part.linear() * group.axis_in_part;
  result.tilt_rad = TiltOf(axes, direction, result.reached);
  const auto ideal = Orient(nominal_axes, direction, group.nominal, limits, AllowedTilt(group));
  if (!ideal.ok()) return Named(group.name, ideal.status());
  result.ideal = *ideal;

  const auto jacobian = JacobianOf(chain, result.reached, values->size());
  if (!jacobian.ok()) return Named(group.name, jacobian.status());
  const std::vector<Part> parts = PartsOf(*jacobian, *values, pose);
  const auto variance = [&](int row) {
    double sum = 0;
    for (const Part& part : parts) sum += part.Variance(row);
    return sum;
  };
  const Eigen::Vector2d turn_rad(positioning.a.StandardUncertaintyAt(result.corrected.a_rad),
                                 positioning.b.StandardUncertaintyAt(result.corrected.b_rad));
  const Eigen::Vector2d turn_variance_rad2 = turn_rad.cwiseAbs2();
  result.a_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(0) + turn_variance_rad2[0]));
  result.b_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(1) + turn_variance_rad2[1]));
  result.tilt_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(2) + variance(3)));
  const Part turning{"angles of the drilling", std::numeric_limits<double>::infinity(), {}, {}};
  const Part tool{drilling.tool_offset_name, std::numeric_limits<double>::infinity(), {}, {}};
  const Eigen::Isometry3d nominal_machine_from_zero = axes.MachineFromZero(group.nominal.a_rad, group.nominal.b_rad);
  for (std::size_t i = 0; i < group.holes.size(); ++i) {
    CorrectedHole hole;
    hole.name = group.holes[i].name;
    hole.start_mm = values->segment<3>(kBeforeStarts + 3 * i);
    hole.nominal_start_mm =
        nominal_machine_from_zero * (chain.growth * (zero_from_part_nominal * group.holes[i].start_in_part_mm));
    std::vector<std::pair<const Part*, Eigen::Matrix3d>> of_hole;
    const auto at = static_cast<Eigen::Index>(kBeforeStarts + 3 * i);
    for (const Part& part : parts) of_hole.emplace_back(&part, part.OfStart(at));
    if (drilling.tool_offset_mm > 0)
      of_hole.emplace_back(&tool, std::pow(drilling.tool_offset_mm, 2) * Eigen::Matrix3d::Identity());
    if (positioning.Uncertain()) {
      const Eigen::Matrix<double, 3, 2> turned = axes.AngleJacobian(
          pose.zero_from_part * group.holes[i].start_in_part_mm, result.reached.a_rad, result.reached.b_rad);
      of_hole.emplace_back(&turning, turned * turn_variance_rad2.asDiagonal() * turned.transpose());
    }
    SumUp(of_hole, &hole);
    result.holes.push_back(hole);
  }
  return result;
}

}  // namespace sixpoint::metrology
