// A deformation of space by a lattice of control displacements: trivariate cubic B-splines over a box of equal cells, so that it is
// twice continuously differentiable wherever it is defined (docs/methods/reconstruction.md, lattice; after Zhao, Lin and Fu 2021).
//
// Frame: part. Units: mm. A point x goes to x + u(x). A lattice need not cover all of its box: cells far from the part have no controls,
// and what lies there is refused, never extrapolated. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace sixpoint::metrology {

// Where the controls of a lattice stand: cells + 3 along each axis, the second of them on the box's lower face.
struct ControlLattice {
  Eigen::Vector3d corner_mm = Eigen::Vector3d::Zero();   // least corner of the box
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();  // of a cell
  std::array<int, 3> cells = {1, 1, 1};

  int Controls(int axis) const { return cells[static_cast<std::size_t>(axis)] + 3; }
  std::size_t cell_count() const;
  std::size_t control_count() const;
  std::size_t CellIndex(int x, int y, int z) const;  // z runs fastest
  std::size_t ControlIndex(int x, int y,
                           int z) const;  // control (x, y, z) to (x + 3, y + 3, z + 3) act in cell (x, y, z)
  ControlLattice Refined() const;         // cells half as wide
};

// The 64 controls that act at a point, and by how much: weights[axis] along each axis.
struct LatticeWeights {
  std::array<int, 3> cell = {0, 0, 0};
  std::array<std::array<double, 4>, 3> weights = {};

  double Weight(int x, int y, int z) const {
    return weights[0][static_cast<std::size_t>(x)] * weights[1][static_cast<std::size_t>(y)] *
           weights[2][static_cast<std::size_t>(z)];
  }
};

// A column a control, mm.
using ControlDisplacements = Eigen::Matrix<double, 3, Eigen::Dynamic>;

class FreeFormDeformation {
 public:
  struct Local {
    Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();  // of the displacement: row its component, column the direction
    // Of x + u(x).
    Eigen::Matrix3d Jacobian() const { return Eigen::Matrix3d::Identity() + gradient; }
  };

  // covered: of each cell, whether its controls stand; empty: all. INVALID_ARGUMENT: spacing, cells or controls out of range or not
  // finite, more than 4 million controls.
  static absl::StatusOr<FreeFormDeformation> Make(const ControlLattice& lattice, ControlDisplacements controls_mm,
                                                  std::vector<std::uint8_t> covered = {});
  // That moves nothing.
  static absl::StatusOr<FreeFormDeformation> Still(const ControlLattice& lattice,
                                                   std::vector<std::uint8_t> covered = {});

  const ControlLattice& lattice() const { return lattice_; }
  const ControlDisplacements& controls_mm() const { return controls_mm_; }
  const std::vector<std::uint8_t>& covered() const { return covered_; }

  // Unset outside the lattice.
  std::optional<LatticeWeights> WeightsAt(const Eigen::Vector3d& point_mm) const;
  std::optional<Eigen::Vector3d> DisplacementAt(const Eigen::Vector3d& point_mm) const;
  std::optional<Local> LocalAt(const Eigen::Vector3d& point_mm) const;
  // The same for who must have it: INVALID_ARGUMENT, the field's value "outside the lattice".
  absl::StatusOr<Local> At(const std::string& field, const Eigen::Vector3d& point_mm) const;

  // Cells half as wide, the same deformation (knots inserted at the middles).
  FreeFormDeformation Refined() const;

 private:
  FreeFormDeformation() = default;
  ControlLattice lattice_;
  ControlDisplacements controls_mm_;
  std::vector<std::uint8_t> covered_;
};

// The four cubic B-splines at t in [0, 1] of a cell, and their first derivatives by t.
std::array<double, 4> SplineValues(double t);
std::array<double, 4> SplineSlopes(double t);
std::array<double, 4> SplineBends(double t);

// Of the displacement at weights, the lattice known by its controls.
inline Eigen::Vector3d DisplacementOf(const ControlLattice& lattice, const ControlDisplacements& controls_mm,
                                      const LatticeWeights& at) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      const auto first = static_cast<Eigen::Index>(lattice.ControlIndex(at.cell[0] + x, at.cell[1] + y, at.cell[2]));
      const double* column = controls_mm.data() + 3 * first;
      const double weight = at.weights[0][static_cast<std::size_t>(x)] * at.weights[1][static_cast<std::size_t>(y)];
      const auto& z = at.weights[2];
      for (int axis = 0; axis < 3; ++axis)
        sum[axis] += weight * (z[0] * column[axis] + z[1] * column[3 + axis] + z[2] * column[6 + axis] +
                               z[3] * column[9 + axis]);
    }
  }
  return sum;
}

}  // namespace sixpoint::metrology
