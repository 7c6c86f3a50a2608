#include "metrology/inspection/hole_displacement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kUpright_rad = 5 * kPi / 180;  // nearer the normal an axis points nowhere along the surface

double AngleBetween(const Vector3d& one, const Vector3d& other) {
  return std::atan2(one.cross(other).norm(), std::abs(one.dot(other)));
}

// Of a value that is `of(start, axis)`: how far the other positionings take it, at most.
template <typename Of>
ValueEffect MovedBy(const MeasuredHole& hole, double value, const Of& of) {
  double greatest = 0;
  for (const MovedHole& moved : hole.moved)
    greatest = std::max(greatest, std::abs(of(moved.start_in_part_mm, moved.axis_in_part) - value));
  return OtherPositionings(greatest);
}

SurfaceUncertainty InStatedPositioning(const SurfaceDirections& directions, const MeasuredHole& hole) {
  Eigen::Matrix<double, 2, 5> per_parameter;
  per_parameter << directions.along.transpose() * hole.start_per_parameter,
      directions.across.transpose() * hole.start_per_parameter;
  SurfaceUncertainty uncertainty;
  uncertainty.covariance_mm2.setZero();
  for (const CylinderSource& source : hole.sources) {
    const Eigen::Matrix<double, 2, Eigen::Dynamic> per_sigma = per_parameter * source.per_sigma;
    uncertainty.covariance_mm2 += per_sigma * per_sigma.transpose();
  }
  // Which cause weighs how much goes with the direction, and the degrees of freedom with it.
  constexpr int kDirections = 36;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = kPi * i / kDirections;
    const Eigen::RowVector2d towards(std::cos(angle), std::sin(angle));
    const double variance_mm2 = towards * uncertainty.covariance_mm2 * towards.transpose();
    const StatedLength length = StateLength(0, EffectsOf(towards * per_parameter, hole.sources, hole.index));
    if (variance_mm2 > 0)
      uncertainty.coverage_factor =
          std::max(uncertainty.coverage_factor, length.expanded_uncertainty_mm / std::sqrt(variance_mm2));
  }
  return uncertainty;
}

}  // namespace

SurfaceDirections SurfaceDirectionsOf(const Vector3d& axis, const Vector3d& normal) {
  SurfaceDirections directions;
  Vector3d reference = axis;
  if (AngleBetween(axis, normal) <= kUpright_rad) {
    const bool z_lies = AngleBetween(Vector3d::UnitZ(), normal) > kUpright_rad;
    directions.reference = z_lies ? SurfaceReference::kPartZ : SurfaceReference::kPartX;
    reference = z_lies ? Vector3d::UnitZ() : Vector3d::UnitX();
  }
  directions.along = (reference - normal.dot(reference) / normal.squaredNorm() * normal).normalized();
  directions.across = normal.normalized().cross(directions.along);
  return directions;
}

ValueEffects EffectsOf(const Eigen::Matrix<double, 1, 5>& per_parameter, const std::vector<CylinderSource>& sources,
                       int hole) {
  ValueEffects effects;
  for (const CylinderSource& source : sources)
    AddEffects({{source.source, source.degrees_of_freedom, source.common ? ValueEffect::kCommon : hole,
                 per_parameter * source.per_sigma}},
               1, &effects);
  return effects;
}

ValueEffect OtherPositionings(double greatest_difference) {
  return {kOtherPositionings, std::numeric_limits<double>::infinity(), ValueEffect::kCommon,
          Eigen::RowVectorXd::Constant(1, greatest_difference / std::sqrt(3.0))};
}

HoleDisplacement DisplacementOf(const NominalPin& nominal, const PinFit& fit, const MeasuredHole& hole) {
  HoleDisplacement displacement;
  displacement.directions = SurfaceDirectionsOf(nominal.axis, nominal.normal);
  const auto length = [&](const Vector3d& direction) {
    const auto of = [&](const Vector3d& start_mm, const Vector3d&) {
      return direction.dot(start_mm - nominal.start_mm);
    };
    const double value_mm = of(hole.start_in_part_mm, hole.axis_in_part);
    ValueEffects effects = EffectsOf(direction.transpose() * hole.start_per_parameter, hole.sources, hole.index);
    effects.push_back(MovedBy(hole, value_mm, of));
    return StateLength(value_mm, effects);
  };
  displacement.along = length(displacement.directions.along);
  displacement.across = length(displacement.directions.across);
  displacement.in_stated_positioning = InStatedPositioning(displacement.directions, hole);

  const auto angle = [&](const Vector3d& direction) {
    // Across the nominal axis, of which the slopes are.
    const Vector3d towards = (direction - nominal.axis.dot(direction) * nominal.axis).normalized();
    const auto of = [&](const Vector3d&, const Vector3d& axis) {
      return std::atan2(towards.dot(axis), nominal.axis.dot(axis));
    };
    const double value_rad = of(hole.start_in_part_mm, hole.axis_in_part);
    Eigen::Matrix<double, 1, 5> per_parameter = Eigen::Matrix<double, 1, 5>::Zero();
    per_parameter.segment<2>(2) = std::pow(std::cos(value_rad), 2) * towards.transpose() * fit.across;
    ValueEffects effects = EffectsOf(per_parameter, hole.sources, hole.index);
    effects.push_back(MovedBy(hole, value_rad, of));
    return StateAngle(value_rad, effects);
  };
  displacement.inclination_along = angle(displacement.directions.along);
  displacement.inclination_across = angle(displacement.directions.across);
  return displacement;
}

}  // namespace sixpoint::metrology
