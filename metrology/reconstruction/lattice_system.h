// The quadratic part of a reconstruction: bending energy of the lattice, and places whose displacement is wanted, all alike for the three
// components, so that one factor serves them all (docs/methods/reconstruction.md, what is minimised).
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "metrology/linear_algebra/layered_cholesky.h"
#include "metrology/reconstruction/free_form_deformation.h"

namespace sixpoint::metrology {

// A place whose displacement is wanted: as a vector, or along the normal alone, where a surface may slide along itself.
struct LatticePull {
  LatticeWeights at;
  double weight = 1;
  Eigen::Vector3d wanted_mm = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
  bool slides = false;
};

class LatticeSystem {
 public:
  // covered: as in FreeFormDeformation, of each cell.
  LatticeSystem(const ControlLattice& lattice, std::vector<std::uint8_t> covered);

  const ControlLattice& lattice() const { return lattice_; }
  const std::vector<std::uint8_t>& covered() const { return covered_; }
  Eigen::Index size() const { return system_.size(); }  // controls that act in a covered cell

  // stiffness * integral over the covered cells of |second derivatives of u|^2 + |u|^2 / decay_mm^4.
  void AddEnergy(double stiffness, double decay_mm);
  // weight * |u(at) - wanted_mm|^2.
  void AddPull(const LatticeWeights& at, double weight, const Eigen::Vector3d& wanted_mm);
  // The same of each, as a vector.
  void AddPulls(const std::vector<LatticePull>& pulls);
  // False where nothing holds some of the controls. Nothing can be added afterwards.
  bool Factor();

  // The least of all, a row an unknown, a column a component.
  const Eigen::MatrixXd& free_mm() const { return free_mm_; }
  // Adds the pushes weight * direction at a place to a right side.
  void AddPush(const LatticeWeights& at, const Eigen::Vector3d& push, Eigen::MatrixXd* right) const;
  // Columns of the places' weights by the factor: the dot product of two is how far a unit push at the one moves the other.
  Eigen::MatrixXd Reaches(const std::vector<LatticeWeights>& places) const;
  // free_mm plus what the pushes on the right side move.
  ControlDisplacements Moved(Eigen::MatrixXd right) const;
  // The least where those of the pulls that slide act along their normals alone; of a system that has these pulls and no others. begin_mm: controls
  // thought near, or none.
  ControlDisplacements Slid(const std::vector<LatticePull>& pulls, const ControlDisplacements& begin_mm,
                            int threads) const;

 private:
  using Element = Eigen::Matrix<double, 64, 64>;
  std::array<Eigen::Index, 64> UnknownsOf(const std::array<int, 3>& cell) const;
  void AddElement(const std::array<int, 3>& cell, const Element& element);
  // The energy's matrix times these.
  Eigen::MatrixXd ByEnergy(const Eigen::MatrixXd& unknowns_mm) const;
  // A row a control, of one an unknown.
  ControlDisplacements ControlsOf(const Eigen::MatrixXd& unknowns_mm) const;

  ControlLattice lattice_;
  std::vector<std::uint8_t> covered_;
  std::vector<Eigen::Index> unknown_of_;     // of each control; -1: it acts nowhere
  std::vector<std::size_t> control_of_;      // of each unknown
  std::map<std::size_t, Element> gathered_;  // pulls of each cell
  Element energy_ = Element::Zero();         // of each covered cell
  LayeredCholesky system_;
  Eigen::MatrixXd right_, free_mm_;
};

}  // namespace sixpoint::metrology
