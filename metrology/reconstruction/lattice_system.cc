#include "metrology/reconstruction/lattice_system.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Gram = Eigen::Matrix4d;

constexpr Index kReach = 3;  // cubic splines overlap with the next three

// Integral over one cell of the products of derivatives of this order: four points of Gauss are exact for them.
Gram GramOf(int order, double spacing_mm) {
  const double inner = std::sqrt(3.0 / 7 - 2.0 / 7 * std::sqrt(6.0 / 5)),
               outer = std::sqrt(3.0 / 7 + 2.0 / 7 * std::sqrt(6.0 / 5));
  const double inner_weight = (18 + std::sqrt(30.0)) / 72, outer_weight = (18 - std::sqrt(30.0)) / 72;
  const double at[4] = {(1 - outer) / 2, (1 - inner) / 2, (1 + inner) / 2, (1 + outer) / 2};
  const double weight[4] = {outer_weight, inner_weight, inner_weight, outer_weight};
  Gram gram = Gram::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::array<double, 4> values = order == 0   ? SplineValues(at[k])
                                         : order == 1 ? SplineSlopes(at[k])
                                                      : SplineBends(at[k]);
    const Eigen::Map<const Eigen::Vector4d> column(values.data());
    gram += weight[k] * column * column.transpose();
  }
  return gram * std::pow(spacing_mm, 1 - 2 * order);
}

// Layers across the axis that has most controls: there the others are few.
struct Numbering {
  std::vector<Index> unknown_of, layer_sizes;
  std::vector<std::size_t> control_of;
};

Numbering Number(const ControlLattice& lattice, const std::vector<std::uint8_t>& covered) {
  std::vector<bool> acts(lattice.control_count(), false);
  for (int x = 0; x < lattice.cells[0]; ++x)
    for (int y = 0; y < lattice.cells[1]; ++y)
      for (int z = 0; z < lattice.cells[2]; ++z) {
        if (covered[lattice.CellIndex(x, y, z)] == 0) continue;
        for (int local = 0; local < 64; ++local)
          acts[lattice.ControlIndex(x + local / 16, y + local / 4 % 4, z + local % 4)] = true;
      }
  int along = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (lattice.Controls(axis) > lattice.Controls(along)) along = axis;
  const int across = along == 0 ? 1 : 0, last = along == 2 ? 1 : 2;
  Numbering numbering;
  numbering.unknown_of.assign(acts.size(), -1);
  for (int i = 0; i < lattice.Controls(along); ++i) {
    const std::size_t before = numbering.control_of.size();
    for (int j = 0; j < lattice.Controls(across); ++j)
      for (int k = 0; k < lattice.Controls(last); ++k) {
        std::array<int, 3> at = {};
        at[static_cast<std::size_t>(along)] = i;
        at[static_cast<std::size_t>(across)] = j;
        at[static_cast<std::size_t>(last)] = k;
        const std::size_t control = lattice.ControlIndex(at[0], at[1], at[2]);
        if (!acts[control]) continue;
        numbering.unknown_of[control] = static_cast<Index>(numbering.control_of.size());
        numbering.control_of.push_back(control);
      }
    numbering.layer_sizes.push_back(static_cast<Index>(numbering.control_of.size() - before));
  }
  return numbering;
}

}  // namespace

LatticeSystem::LatticeSystem(const ControlLattice& lattice, std::vector<std::uint8_t> covered)
    : lattice_(lattice), covered_(std::move(covered)), system_({}, kReach) {
  if (covered_.empty()) covered_.assign(lattice_.cell_count(), 1);
  Numbering numbering = Number(lattice_, covered_);
  unknown_of_ = std::move(numbering.unknown_of);
  control_of_ = std::move(numbering.control_of);
  system_ = LayeredCholesky(numbering.layer_sizes, kReach);
  right_ = MatrixXd::Zero(system_.size(), 3);
}

std::array<Index, 64> LatticeSystem::UnknownsOf(const std::array<int, 3>& cell) const {
  std::array<Index, 64> unknowns = {};
  for (int local = 0; local < 64; ++local)
    unknowns[static_cast<std::size_t>(local)] =
        unknown_of_[lattice_.ControlIndex(cell[0] + local / 16, cell[1] + local / 4 % 4, cell[2] + local % 4)];
  return unknowns;
}

void LatticeSystem::AddElement(const std::array<int, 3>& cell, const Element& element) {
  const std::array<Index, 64> unknowns = UnknownsOf(cell);
  for (Index p = 0; p < 64; ++p)
    for (Index q = 0; q < 64; ++q) {
      const Index row = unknowns[static_cast<std::size_t>(p)], column = unknowns[static_cast<std::size_t>(q)];
      if (row >= column) system_.Add(row, column, element(p, q));
    }
}

void LatticeSystem::AddEnergy(double stiffness, double decay_mm) {
  std::array<std::array<Gram, 3>, 3> gram;  // [axis][order]
  for (int axis = 0; axis < 3; ++axis)
    for (int order = 0; order < 3; ++order)
      gram[static_cast<std::size_t>(axis)][static_cast<std::size_t>(order)] = GramOf(order, lattice_.spacing_mm[axis]);
  struct Term {
    std::size_t x, y, z;
    double weight;
  };
  const Term terms[] = {{2, 0, 0, 1},
                        {0, 2, 0, 1},
                        {0, 0, 2, 1},
                        {1, 1, 0, 2},
                        {1, 0, 1, 2},
                        {0, 1, 1, 2},
                        {0, 0, 0, std::pow(decay_mm, -4)}};
  Element element = Element::Zero();
  for (const Term& term : terms)
    for (Index p = 0; p < 64; ++p)
      for (Index q = 0; q < 64; ++q)
        element(p, q) += stiffness * term.weight * gram[0][term.x](p / 16, q / 16) *
                         gram[1][term.y](p / 4 % 4, q / 4 % 4) * gram[2][term.z](p % 4, q % 4);
  energy_ += element;
  for (int x = 0; x < lattice_.cells[0]; ++x)
    for (int y = 0; y < lattice_.cells[1]; ++y)
      for (int z = 0; z < lattice_.cells[2]; ++z)
        if (covered_[lattice_.CellIndex(x, y, z)] != 0) AddElement({x, y, z}, element);
}

MatrixXd LatticeSystem::ByEnergy(const MatrixXd& unknowns_mm) const {
  MatrixXd product = MatrixXd::Zero(size(), 3);
  for (int x = 0; x < lattice_.cells[0]; ++x)
    for (int y = 0; y < lattice_.cells[1]; ++y)
      for (int z = 0; z < lattice_.cells[2]; ++z) {
        if (covered_[lattice_.CellIndex(x, y, z)] == 0) continue;
        const std::array<Index, 64> unknowns = UnknownsOf({x, y, z});
        Eigen::Matrix<double, 64, 3> own_mm;
        for (Index local = 0; local < 64; ++local)
          own_mm.row(local) = unknowns_mm.row(unknowns[static_cast<std::size_t>(local)]);
        const Eigen::Matrix<double, 64, 3> by_energy = energy_ * own_mm;
        for (Index local = 0; local < 64; ++local)
          product.row(unknowns[static_cast<std::size_t>(local)]) += by_energy.row(local);
      }
  return product;
}

void LatticeSystem::AddPull(const LatticeWeights& at, double weight, const Vector3d& wanted_mm) {
  const std::size_t cell = lattice_.CellIndex(at.cell[0], at.cell[1], at.cell[2]);
  auto [found, is_new] = gathered_.try_emplace(cell);
  if (is_new) found->second.setZero();
  Eigen::Matrix<double, 64, 1> column;
  for (int local = 0; local < 64; ++local) column[local] = at.Weight(local / 16, local / 4 % 4, local % 4);
  found->second.noalias() += weight * column * column.transpose();
  AddPush(at, weight * wanted_mm, &right_);
}

void LatticeSystem::AddPulls(const std::vector<LatticePull>& pulls) {
  for (const LatticePull& pull : pulls) AddPull(pull.at, pull.weight, pull.wanted_mm);
}

bool LatticeSystem::Factor() {
  for (const auto& [cell, element] : gathered_) {
    const auto index = static_cast<int>(cell);
    const int per_x = lattice_.cells[1] * lattice_.cells[2];
    AddElement({index / per_x, index % per_x / lattice_.cells[2], index % lattice_.cells[2]}, element);
  }
  gathered_.clear();
  if (!system_.Factor()) return false;
  free_mm_ = right_;
  system_.Solve(&free_mm_);
  return free_mm_.allFinite();
}

void LatticeSystem::AddPush(const LatticeWeights& at, const Vector3d& push, MatrixXd* right) const {
  const std::array<Index, 64> unknowns = UnknownsOf(at.cell);
  for (int local = 0; local < 64; ++local)
    right->row(unknowns[static_cast<std::size_t>(local)]) +=
        at.Weight(local / 16, local / 4 % 4, local % 4) * push.transpose();
}

MatrixXd LatticeSystem::Reaches(const std::vector<LatticeWeights>& places) const {
  MatrixXd columns = MatrixXd::Zero(size(), static_cast<Index>(places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::array<Index, 64> unknowns = UnknownsOf(places[i].cell);
    for (int local = 0; local < 64; ++local)
      columns(unknowns[static_cast<std::size_t>(local)], static_cast<Index>(i)) =
          places[i].Weight(local / 16, local / 4 % 4, local % 4);
  }
  system_.SolveForward(&columns);
  return columns;
}

ControlDisplacements LatticeSystem::Moved(MatrixXd right) const {
  system_.Solve(&right);
  return ControlsOf(free_mm_ + right);
}

ControlDisplacements LatticeSystem::ControlsOf(const MatrixXd& unknowns_mm) const {
  ControlDisplacements controls_mm = ControlDisplacements::Zero(3, static_cast<Index>(lattice_.control_count()));
  for (std::size_t unknown = 0; unknown < control_of_.size(); ++unknown)
    controls_mm.col(static_cast<Index>(control_of_[unknown])) =
        unknowns_mm.row(static_cast<Index>(unknown)).transpose();
  return controls_mm;
}

}  // namespace sixpoint::metrology
