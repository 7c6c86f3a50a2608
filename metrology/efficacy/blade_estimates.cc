#include "metrology/efficacy/blade_estimates.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Normal = Eigen::Matrix<double, 5, 5>;
using Right = Eigen::Matrix<double, 5, 1>;

// Least share of its whole that a direction must be seen with: sin^2 of some 8 degrees.
constexpr double kLeastShare = 0.02;
// Scaled columns; beyond it offsets and angles are not told apart.
constexpr double kGreatestCondition = 1e6;

struct Equations {
  Normal normal = Normal::Zero();
  Right right = Right::Zero();
};

struct Designs {
  Eigen::Matrix<double, 3, 5> position = Eigen::Matrix<double, 3, 5>::Zero(), direction = position;
};

Designs DesignsOf(const WeighedOutcome& hole, bool with_angles) {
  Designs designs;
  designs.position.leftCols<3>() = hole.seen.across;
  if (with_angles) {
    designs.position.rightCols<2>() = hole.seen.position_by_angles;
    designs.direction.rightCols<2>() = hole.seen.direction_by_angles;
  }
  return designs;
}

Equations EquationsOf(const SeenBlade& blade, bool with_angles) {
  Equations sum;
  for (const WeighedOutcome& hole : blade) {
    const auto [position, direction] = DesignsOf(hole, with_angles);
    sum.normal += hole.position_weight * position.transpose() * position +
                  hole.direction_weight * direction.transpose() * direction;
    sum.right += hole.position_weight * position.transpose() * hole.seen.position_mm +
                 hole.direction_weight * direction.transpose() * hole.seen.direction_rad;
  }
  return sum;
}

// Scaled to unit columns; by its eigenvalues.
double ConditionOf(const Eigen::MatrixXd& normal) {
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt();
  if (scale.minCoeff() <= 0) return INFINITY;
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues();
  return values.minCoeff() > 0 ? std::sqrt(values.maxCoeff() / values.minCoeff()) : INFINITY;
}

Eigen::MatrixXd Chosen(const Normal& normal, const std::vector<int>& columns) {
  const auto size = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd chosen(size, size);
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index j = 0; j < size; ++j)
      chosen(i, j) = normal(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
  return chosen;
}

// Rows of a 5 x 3 that were asked for.
Eigen::MatrixXd ChosenRows(const Eigen::Matrix<double, 5, 3>& all, const std::vector<int>& columns) {
  Eigen::MatrixXd chosen(static_cast<Eigen::Index>(columns.size()), 3);
  for (Eigen::Index i = 0; i < chosen.rows(); ++i) chosen.row(i) = all.row(columns[static_cast<std::size_t>(i)]);
  return chosen;
}

void AddGains(const SeenBlade& blade, const Eigen::MatrixXd& inverse, const std::vector<int>& columns, bool with_angles,
              BladeEstimates* estimates) {
  for (const WeighedOutcome& hole : blade) {
    const auto [position, direction] = DesignsOf(hole, with_angles);
    HoleGain& gain = estimates->gains[hole.outcome->hole];
    if (gain.by_position.size() == 0) gain.by_position = gain.by_direction = Eigen::MatrixXd::Zero(inverse.rows(), 3);
    gain.by_position += hole.position_weight * inverse * ChosenRows(position.transpose(), columns);
    gain.by_direction += hole.direction_weight * inverse * ChosenRows(direction.transpose(), columns);
  }
}

}  // namespace

std::vector<SeenBlade> SeeAll(const std::vector<BladeOutcome>& blades, const RotaryAxes& axes) {
  std::vector<double> positions, inclinations;
  for (const BladeOutcome& blade : blades)
    for (const HoleOutcome& hole : blade.holes) {
      positions.push_back(hole.position_standard_uncertainty_mm);
      inclinations.push_back(hole.inclination_standard_uncertainty_rad);
    }
  const double median_mm = Median(positions), median_rad = Median(inclinations);
  std::vector<SeenBlade> seen;
  for (const BladeOutcome& blade : blades) {
    SeenBlade& holes = seen.emplace_back();
    for (const HoleOutcome& hole : blade.holes) {
      // Two components share a distance's mean square.
      const double mm = std::max(hole.position_standard_uncertainty_mm, median_mm);
      const double rad = std::max(hole.inclination_standard_uncertainty_rad, median_rad);
      holes.push_back({&hole, See(hole, axes), 2 / (mm * mm), 2 / (rad * rad)});
    }
  }
  return seen;
}

Determined WhatIsDetermined(const std::vector<SeenBlade>& blades) {
  Normal normal = Normal::Zero();
  Eigen::Vector2d turned = Eigen::Vector2d::Zero();
  double position_weight = 0, direction_weight = 0;
  for (const SeenBlade& blade : blades) {
    normal += EquationsOf(blade, true).normal;
    for (const WeighedOutcome& hole : blade) {
      position_weight += hole.position_weight;
      direction_weight += hole.direction_weight;
      for (int k = 0; k < 2; ++k)
        turned[k] += hole.direction_weight * hole.seen.direction_by_angles.col(k).squaredNorm();
    }
  }
  Determined determined;
  for (int k = 0; k < 3; ++k)
    if (normal(k, k) > kLeastShare * position_weight) determined.positions.push_back(k);
  for (int k = 0; k < 2; ++k)
    if (turned[k] > kLeastShare * direction_weight) determined.angles.push_back(3 + k);
  if (determined.angles.empty()) return determined;
  std::vector<int> columns = determined.positions;
  columns.insert(columns.end(), determined.angles.begin(), determined.angles.end());
  determined.condition_number = ConditionOf(Chosen(normal, columns));
  if (!(*determined.condition_number < kGreatestCondition)) determined.angles.clear();
  return determined;
}

BladeEstimates EstimateEach(const std::vector<SeenBlade>& blades, const std::vector<int>& columns) {
  const bool with_angles = std::any_of(columns.begin(), columns.end(), [](int column) { return column >= 3; });
  BladeEstimates estimates;
  for (std::size_t i = 0; i < blades.size(); ++i) {
    const Equations equations = EquationsOf(blades[i], with_angles);
    const Eigen::MatrixXd normal = Chosen(equations.normal, columns);
    if (!(ConditionOf(normal) < kGreatestCondition)) continue;
    Eigen::VectorXd right(normal.rows());
    for (Eigen::Index k = 0; k < right.size(); ++k) right[k] = equations.right[columns[static_cast<std::size_t>(k)]];
    const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols());
    const Eigen::MatrixXd inverse = scale.asDiagonal() * scaled.ldlt().solve(one) * scale.asDiagonal();
    estimates.values.push_back(inverse * right);
    estimates.blades.push_back(i);
    AddGains(blades[i], inverse, columns, with_angles, &estimates);
  }
  for (auto& [hole, gain] : estimates.gains) {
    gain.by_position /= static_cast<double>(estimates.values.size());
    gain.by_direction /= static_cast<double>(estimates.values.size());
  }
  return estimates;
}

SharedUncertainty SharedBy(const std::vector<SeenBlade>& blades) {
  double count = 0, position = 0, angle = 0, lever = 0;
  for (const SeenBlade& blade : blades)
    for (const WeighedOutcome& hole : blade) {
      ++count;
      const HoleOutcome& outcome = *hole.outcome;
      position += outcome.shared_part * std::pow(outcome.position_standard_uncertainty_mm, 2) / 2;
      angle += outcome.shared_part * std::pow(outcome.inclination_standard_uncertainty_rad, 2) / 2;
      lever += hole.seen.position_by_angles.squaredNorm() / 2;
    }
  return {std::sqrt(position / count), std::sqrt(angle / count), std::sqrt(lever / count)};
}

}  // namespace sixpoint::metrology
