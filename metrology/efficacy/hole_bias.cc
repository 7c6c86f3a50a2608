#include "metrology/efficacy/hole_bias.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "metrology/efficacy/holm.h"
#include "metrology/efficacy/mean_test.h"
#include "metrology/statistics/distributions.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

struct Gathered {
  std::vector<Eigen::Vector3d> in_machine, in_part, own, along;
};

// Component by component: one hole that is far off does not move it.
Eigen::Vector3d MedianOfOthers(const std::vector<Eigen::Vector3d>& rests, std::size_t left_out) {
  Eigen::Vector3d median;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (std::size_t i = 0; i < rests.size(); ++i)
      if (i != left_out) values.push_back(rests[i][k]);
    median[k] = Median(std::move(values));
  }
  return median;
}

Eigen::Vector3d MeanOf(const std::vector<Eigen::Vector3d>& values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& value : values) sum += value;
  return values.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(values.size()));
}

HoleBias BiasOf(const std::string& name, const Gathered& gathered, double confidence) {
  HoleBias bias;
  bias.hole = name;
  bias.blade_count = static_cast<int>(gathered.in_machine.size());
  bias.mean_in_machine_mm = MeanOf(gathered.in_machine);
  bias.mean_in_part_mm = MeanOf(gathered.in_part);
  if (gathered.own.empty()) return bias;
  bias.own_in_machine_mm = MeanOf(gathered.own);
  // Two components across the hole's mean direction.
  const Eigen::Vector3d along = MeanOf(gathered.along).normalized();
  const Eigen::Vector3d one = along.unitOrthogonal(), other = along.cross(one);
  std::vector<Eigen::VectorXd> across;
  for (const Eigen::Vector3d& own : gathered.own) across.push_back(Eigen::Vector2d(one.dot(own), other.dot(own)));
  const MeanTest test = TestMean(across);
  bias.p = test.p;
  const double n = test.count;
  if (n > 2)  // the radius that holds the joint region's ellipse
    bias.own_expanded_uncertainty_mm = std::sqrt(
        2 * (n - 1) / (n - 2) * FisherQuantile(confidence, 2, n - 2) *
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(Eigen::Matrix2d(test.covariance / n)).eigenvalues().maxCoeff());
  return bias;
}

}  // namespace

std::vector<HoleBias> HoleBiases(const std::vector<SeenBlade>& blades, const Eigen::Vector2d& angles,
                                 double confidence) {
  std::map<std::string, Gathered> holes;
  for (const SeenBlade& blade : blades) {
    std::vector<Eigen::Vector3d> rests;
    for (const WeighedOutcome& hole : blade)
      rests.push_back(hole.seen.position_mm - hole.seen.position_by_angles * angles);
    for (std::size_t i = 0; i < blade.size(); ++i) {
      const SeenOutcome& seen = blade[i].seen;
      Gathered& gathered = holes[blade[i].outcome->hole];
      gathered.in_machine.push_back(seen.position_mm);
      gathered.in_part.push_back(seen.part_from_machine * seen.position_mm);
      if (rests.size() < 2) continue;
      gathered.along.push_back(seen.along);
      gathered.own.push_back(seen.across * (rests[i] - MedianOfOthers(rests, i)));
    }
  }
  std::vector<HoleBias> biases;
  std::vector<double> tested;
  for (const auto& [name, gathered] : holes) {
    biases.push_back(BiasOf(name, gathered, confidence));
    if (biases.back().p) tested.push_back(*biases.back().p);
  }
  const std::vector<double> adjusted = HolmAdjusted(tested);
  std::size_t next = 0;
  for (HoleBias& bias : biases) {
    if (!bias.p) continue;
    bias.adjusted_p = adjusted[next++];
    bias.significant = *bias.adjusted_p < 1 - confidence;
  }
  return biases;
}

}  // namespace sixpoint::metrology
