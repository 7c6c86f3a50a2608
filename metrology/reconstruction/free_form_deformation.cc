#include "metrology/reconstruction/free_form_deformation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kMostControls = 4e6;  // 100 MB
// A point of the box's upper face, found by arithmetic, may lie this part of a cell beyond it.
constexpr double kBeyondBox = 1e-9;

std::string PointText(const Vector3d& point_mm) {
  return "(" + Rounded(point_mm.x()) + ", " + Rounded(point_mm.y()) + ", " + Rounded(point_mm.z()) + ")";
}

absl::Status CheckLattice(const ControlLattice& lattice) {
  if (!lattice.corner_mm.allFinite()) return Refuse("lattice.corner_mm", "not finite", "finite numbers");
  double count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(lattice.spacing_mm[axis] >= 1e-3 && lattice.spacing_mm[axis] <= 1e4))
      return Refuse("lattice.spacing_mm", lattice.spacing_mm[axis], "0.001 to 10000");
    if (!(lattice.cells[static_cast<std::size_t>(axis)] >= 1))
      return Refuse("lattice.cells", lattice.cells[static_cast<std::size_t>(axis)], "at least 1");
    count *= lattice.Controls(axis);
  }
  if (!(count <= kMostControls)) return Refuse("lattice.cells", Rounded(count) + " controls", "at most 4000000");
  return absl::OkStatus();
}

absl::Status Check(const ControlLattice& lattice, const ControlDisplacements& controls_mm,
                   const std::vector<std::uint8_t>& covered) {
  if (absl::Status good = CheckLattice(lattice); !good.ok()) return good;
  if (static_cast<std::size_t>(controls_mm.cols()) != lattice.control_count())
    return Refuse("controls_mm", std::to_string(controls_mm.cols()), std::to_string(lattice.control_count()));
  if (!controls_mm.allFinite()) return Refuse("controls_mm", "not finite", "finite numbers");
  if (!covered.empty() && covered.size() != lattice.cell_count())
    return Refuse("covered", std::to_string(covered.size()), std::to_string(lattice.cell_count()));
  return absl::OkStatus();
}

// Controls of half the spacing along one axis, of a block [outer][n][inner] of columns.
ControlDisplacements Halved(const ControlDisplacements& controls_mm, Index outer, Index count, Index inner) {
  const Index fine = 2 * (count - 3) + 3;
  ControlDisplacements halved(3, outer * fine * inner);
  for (Index o = 0; o < outer; ++o) {
    for (Index f = 0; f < fine; ++f) {
      for (Index i = 0; i < inner; ++i) {
        const auto old = [&](Index k) { return controls_mm.col((o * count + k) * inner + i); };
        const Index k = f / 2;
        halved.col((o * fine + f) * inner + i) =
            f % 2 == 0 ? Vector3d((old(k) + old(k + 1)) / 2) : Vector3d((old(k) + 6 * old(k + 1) + old(k + 2)) / 8);
      }
    }
  }
  return halved;
}

}  // namespace

std::size_t ControlLattice::cell_count() const {
  return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
}

std::size_t ControlLattice::control_count() const {
  return static_cast<std::size_t>(Controls(0)) * static_cast<std::size_t>(Controls(1)) *
         static_cast<std::size_t>(Controls(2));
}

std::size_t ControlLattice::CellIndex(int x, int y, int z) const {
  return static_cast<std::size_t>((x * cells[1] + y) * cells[2] + z);
}

std::size_t ControlLattice::ControlIndex(int x, int y, int z) const {
  return static_cast<std::size_t>((x * Controls(1) + y) * Controls(2) + z);
}

ControlLattice ControlLattice::Refined() const {
  ControlLattice refined = *this;
  refined.spacing_mm /= 2;
  for (int& count : refined.cells) count *= 2;
  return refined;
}

std::array<double, 4> SplineValues(double t) {
  const double s = 1 - t, t2 = t * t, t3 = t2 * t;
  return {s * s * s / 6, (3 * t3 - 6 * t2 + 4) / 6, (-3 * t3 + 3 * t2 + 3 * t + 1) / 6, t3 / 6};
}

std::array<double, 4> SplineSlopes(double t) {
  const double s = 1 - t;
  return {-s * s / 2, (3 * t * t - 4 * t) / 2, (-3 * t * t + 2 * t + 1) / 2, t * t / 2};
}

std::array<double, 4> SplineBends(double t) { return {1 - t, 3 * t - 2, 1 - 3 * t, t}; }

absl::StatusOr<FreeFormDeformation> FreeFormDeformation::Make(const ControlLattice& lattice,
                                                              ControlDisplacements controls_mm,
                                                              std::vector<std::uint8_t> covered) {
  if (absl::Status good = Check(lattice, controls_mm, covered); !good.ok()) return good;
  FreeFormDeformation made;
  made.lattice_ = lattice;
  made.controls_mm_ = std::move(controls_mm);
  made.covered_ = std::move(covered);
  if (made.covered_.empty()) made.covered_.assign(lattice.cell_count(), 1);
  return made;
}

absl::StatusOr<FreeFormDeformation> FreeFormDeformation::Still(const ControlLattice& lattice,
                                                               std::vector<std::uint8_t> covered) {
  if (absl::Status good = CheckLattice(lattice); !good.ok()) return good;
  return Make(lattice, ControlDisplacements::Zero(3, static_cast<Index>(lattice.control_count())), std::move(covered));
}

std::optional<LatticeWeights> FreeFormDeformation::WeightsAt(const Vector3d& point_mm) const {
  LatticeWeights at;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double along = (point_mm[axis] - lattice_.corner_mm[axis]) / lattice_.spacing_mm[axis];
    if (!(along >= -kBeyondBox && along <= lattice_.cells[a] + kBeyondBox)) return std::nullopt;
    const int cell = std::clamp(static_cast<int>(std::floor(along)), 0, lattice_.cells[a] - 1);
    at.cell[a] = cell;
    at.weights[a] = SplineValues(along - cell);
  }
  if (covered_[lattice_.CellIndex(at.cell[0], at.cell[1], at.cell[2])] == 0) return std::nullopt;
  return at;
}

std::optional<Vector3d> FreeFormDeformation::DisplacementAt(const Vector3d& point_mm) const {
  const std::optional<LatticeWeights> at = WeightsAt(point_mm);
  if (!at) return std::nullopt;
  return DisplacementOf(lattice_, controls_mm_, *at);
}

std::optional<FreeFormDeformation::Local> FreeFormDeformation::LocalAt(const Vector3d& point_mm) const {
  const std::optional<LatticeWeights> at = WeightsAt(point_mm);
  if (!at) return std::nullopt;
  Local local;
  local.displacement_mm = DisplacementOf(lattice_, controls_mm_, *at);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double along = (point_mm[axis] - lattice_.corner_mm[axis]) / lattice_.spacing_mm[axis] - at->cell[a];
    LatticeWeights slope = *at;
    slope.weights[a] = SplineSlopes(along);
    local.gradient.col(axis) = DisplacementOf(lattice_, controls_mm_, slope) / lattice_.spacing_mm[axis];
  }
  return local;
}

absl::StatusOr<FreeFormDeformation::Local> FreeFormDeformation::At(const std::string& field,
                                                                   const Vector3d& point_mm) const {
  std::optional<Local> local = LocalAt(point_mm);
  if (!local) return Refuse(field, PointText(point_mm) + " outside the lattice", "a point that the lattice covers");
  return *std::move(local);
}

FreeFormDeformation FreeFormDeformation::Refined() const {
  FreeFormDeformation refined;
  refined.lattice_ = lattice_.Refined();
  const Index x = lattice_.Controls(0), y = lattice_.Controls(1), z = lattice_.Controls(2);
  refined.controls_mm_ = Halved(controls_mm_, x * y, z, 1);
  refined.controls_mm_ = Halved(refined.controls_mm_, x, y, refined.lattice_.Controls(2));
  refined.controls_mm_ =
      Halved(refined.controls_mm_, 1, x, Index{refined.lattice_.Controls(1)} * refined.lattice_.Controls(2));
  refined.covered_.resize(refined.lattice_.cell_count());
  for (int i = 0; i < refined.lattice_.cells[0]; ++i)
    for (int j = 0; j < refined.lattice_.cells[1]; ++j)
      for (int k = 0; k < refined.lattice_.cells[2]; ++k)
        refined.covered_[refined.lattice_.CellIndex(i, j, k)] = covered_[lattice_.CellIndex(i / 2, j / 2, k / 2)];
  return refined;
}

}  // namespace sixpoint::metrology
