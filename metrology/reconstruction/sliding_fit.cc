// Surfaces that slide along themselves couple the three components. Their least is found by conjugate gradients, before which stands the factor of
// the system in which they do not slide: it serves the components one by one.
#include <map>

#include "metrology/parallel/loops.h"
#include "metrology/reconstruction/lattice_system.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kMostSlidingSteps = 60;
constexpr double kSettled = 1e-9;  // of the energy that is still to be gained, as a part of all

// The pulls of one cell, a row each.
struct CellPulls {
  std::array<int, 3> cell;
  MatrixXd splines, normals;  // normals: 0 of those that do not slide
  VectorXd weights;
};

std::vector<CellPulls> ByCell(const ControlLattice& lattice, const std::vector<LatticePull>& pulls, bool slides) {
  std::map<std::size_t, std::vector<const LatticePull*>> of_cell;
  for (const LatticePull& pull : pulls)
    if (pull.slides == slides)
      of_cell[lattice.CellIndex(pull.at.cell[0], pull.at.cell[1], pull.at.cell[2])].push_back(&pull);
  std::vector<CellPulls> cells;
  for (const auto& [index, own] : of_cell) {
    const auto count = static_cast<Index>(own.size());
    CellPulls cell{own[0]->at.cell, MatrixXd(count, 64), MatrixXd(count, 3), VectorXd(count)};
    for (Index i = 0; i < count; ++i) {
      const LatticePull& pull = *own[static_cast<std::size_t>(i)];
      for (int local = 0; local < 64; ++local)
        cell.splines(i, local) = pull.at.Weight(local / 16, local / 4 % 4, local % 4);
      cell.normals.row(i) = pull.normal.transpose();
      cell.weights[i] = pull.weight;
    }
    cells.push_back(std::move(cell));
  }
  return cells;
}

// How displacements are pulled at.
enum class Pulled { kWhole, kAlongNormals, kAcross };

}  // namespace

ControlDisplacements LatticeSystem::Slid(const std::vector<LatticePull>& pulls, const ControlDisplacements& begin_mm,
                                         int threads) const {
  const std::vector<CellPulls> sliding = ByCell(lattice_, pulls, true), held = ByCell(lattice_, pulls, false);
  const auto pulled = [&](const std::vector<CellPulls>& cells, const MatrixXd& unknowns_mm, Pulled how) {
    std::vector<Eigen::Matrix<double, 64, 3>> of_cell(cells.size());
    ForEach(cells.size(), threads, [&](std::size_t c) {
      const CellPulls& cell = cells[c];
      const std::array<Index, 64> unknowns = UnknownsOf(cell.cell);
      Eigen::Matrix<double, 64, 3> controls_mm;
      for (Index local = 0; local < 64; ++local)
        controls_mm.row(local) = unknowns_mm.row(unknowns[static_cast<std::size_t>(local)]);
      // Column by column: three are too few for what a product of matrices makes ready.
      MatrixXd at_mm(cell.splines.rows(), 3);
      for (Index axis = 0; axis < 3; ++axis) at_mm.col(axis).noalias() = cell.splines * controls_mm.col(axis);
      if (how != Pulled::kWhole) {
        const VectorXd along_mm = at_mm.cwiseProduct(cell.normals).rowwise().sum();
        const MatrixXd by_normals_mm = along_mm.asDiagonal() * cell.normals;
        if (how == Pulled::kAcross)
          at_mm -= by_normals_mm;
        else
          at_mm = by_normals_mm;
      }
      at_mm = cell.weights.asDiagonal() * at_mm;
      for (Index axis = 0; axis < 3; ++axis)
        of_cell[c].col(axis).noalias() = cell.splines.transpose() * at_mm.col(axis);
    });
    MatrixXd pushes = MatrixXd::Zero(size(), 3);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::array<Index, 64> unknowns = UnknownsOf(cells[c].cell);
      for (Index local = 0; local < 64; ++local)
        pushes.row(unknowns[static_cast<std::size_t>(local)]) += of_cell[c].row(local);
    }
    return pushes;
  };
  MatrixXd rest = MatrixXd::Zero(size(), 3);  // the right side less what is found
  for (const LatticePull& pull : pulls)
    AddPush(pull.at,
            pull.weight * (pull.slides ? Vector3d(pull.normal.dot(pull.wanted_mm) * pull.normal) : pull.wanted_mm),
            &rest);
  MatrixXd found_mm = MatrixXd::Zero(size(), 3), way = rest;
  system_.Solve(&way);
  const double first = rest.cwiseProduct(way).sum();
  if (begin_mm.cols() > 0) {
    for (Index i = 0; i < size(); ++i)
      found_mm.row(i) = begin_mm.col(static_cast<Index>(control_of_[static_cast<std::size_t>(i)])).transpose();
    rest -=
        ByEnergy(found_mm) + pulled(held, found_mm, Pulled::kWhole) + pulled(sliding, found_mm, Pulled::kAlongNormals);
    way = rest;
    system_.Solve(&way);
  }
  MatrixXd by_system = rest;  // the system's matrix times the way
  double gain = rest.cwiseProduct(way).sum();
  for (int step = 0; step < kMostSlidingSteps && gain > kSettled * first; ++step) {
    // The system has too much: pulls across the normals.
    const MatrixXd by_matrix = by_system - pulled(sliding, way, Pulled::kAcross);
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
