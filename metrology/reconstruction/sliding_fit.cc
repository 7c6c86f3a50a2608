// Surfaces that slide along themselves couple the three components. Their least is found by conjugate gradients, before which stands the factor of
// the system in which they do not slide: it serves the components one by one.
#include "metrology/reconstruction/lattice_system.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int kSteps = 40;
constexpr double kSettled = 1e-9;  // of the energy that is still to be gained, as a part of all

}  // namespace

ControlDisplacements LatticeSystem::Slid(const std::vector<LatticePull>& pulls) const {
  MatrixXd rest = MatrixXd::Zero(size(), 3);  // the right side less what is found
  for (const LatticePull& pull : pulls)
    AddPush(pull.at,
            pull.weight * (pull.slides ? Vector3d(pull.normal.dot(pull.wanted_mm) * pull.normal) : pull.wanted_mm),
            &rest);
  // What the system has too much: pulls across the normals.
  const auto across = [&](const MatrixXd& unknowns_mm) {
    MatrixXd pushes = MatrixXd::Zero(size(), 3);
    for (const LatticePull& pull : pulls) {
      if (!pull.slides) continue;
      const std::array<Index, 64> unknowns = UnknownsOf(pull.at.cell);
      Vector3d at_mm = Vector3d::Zero();
      for (int local = 0; local < 64; ++local)
        at_mm += pull.at.Weight(local / 16, local / 4 % 4, local % 4) *
                 unknowns_mm.row(unknowns[static_cast<std::size_t>(local)]).transpose();
      AddPush(pull.at, pull.weight * (at_mm - pull.normal.dot(at_mm) * pull.normal), &pushes);
    }
    return pushes;
  };
  MatrixXd found_mm = MatrixXd::Zero(size(), 3), way = rest,
           by_system = rest;  // by_system: the system's matrix times the way
  system_.Solve(&way);
  double gain = rest.cwiseProduct(way).sum();
  const double first = gain;
  for (int step = 0; step < kSteps && gain > kSettled * first; ++step) {
    const MatrixXd by_matrix = by_system - across(way);
    const double far = gain / way.cwiseProduct(by_matrix).sum();
    found_mm += far * way;
    rest -= far * by_matrix;
    MatrixXd next = rest;
    system_.Solve(&next);
    const double next_gain = rest.cwiseProduct(next).sum(), turn = next_gain / gain;
    way = next + turn * way;
    by_system = rest + turn * by_system;
    gain = next_gain;
  }
  return ControlsOf(found_mm);
}

}  // namespace sixpoint::metrology
