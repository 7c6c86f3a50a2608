#include "metrology/registration/seen_sides.h"

#include <absl/status/status.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

#include "metrology/parallel/keep_going.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

constexpr double kPiecePart = 1.0 / 16;  // of a cell's area
constexpr double kBeside = 0.5;          // of a normal along an axis, from which its points may count to that side
constexpr std::size_t kPiecesPerQuestion = 65'536;  // whether to go on

double AreaOf(const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2; }

// A place in a piece, as likely anywhere in it: the middles of slivers that lie side by side all lie in one line.
class Places {
 public:
  Vector3d In(const Triangle& t) {
    double u = Next(), v = Next();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
  }

 private:
  // SplitMix64.
  double Next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
    z = (z ^ z >> 27) * 0x94d049bb133111eb;
    return static_cast<double>((z ^ z >> 31) >> 11) * 0x1p-53;
  }
  std::uint64_t state_ = 0;
};

class Looked {
 public:
  Looked(const Surface& surface, const std::vector<PatchKey>& seen, double cell_mm, const FitOptions& options)
      : centroid_mm_(surface.centroid_mm()),
        seen_(seen.begin(), seen.end()),
        cell_mm_(cell_mm),
        options_(options),
        keep_going_(options.keep_going) {
    for (int k = 0; k < 6; ++k) sides_[static_cast<std::size_t>(k)].direction[k / 2] = k % 2 == 0 ? 1 : -1;
  }

  // Halved across its longest edge until it is small.
  void Add(const Triangle& t, const Vector3d& normal) {
    if (keep_going_.stopped()) return;
    if (AreaOf(t) > kPiecePart * cell_mm_ * cell_mm_) {
      std::size_t longest = 0;
      for (std::size_t k = 1; k < 3; ++k)
        if ((t[(k + 1) % 3] - t[k]).squaredNorm() > (t[(longest + 1) % 3] - t[longest]).squaredNorm()) longest = k;
      const Vector3d &from = t[longest], &to = t[(longest + 1) % 3], &tip = t[(longest + 2) % 3];
      const Vector3d middle = (from + to) / 2;
      Add({from, middle, tip}, normal);
      Add({middle, to, tip}, normal);
      return;
    }
    if (++pieces_ % kPiecesPerQuestion == 0 && !keep_going_()) return;
    const Vector3d at = places_.In(t);
    if (!InRegions(options_, at)) return;
    SeenSide& side = sides_[static_cast<std::size_t>(SideOf(normal))];
    const double area = AreaOf(t);
    side.area_mm2 += area;
    if (Seen(at - centroid_mm_, normal))
      side.seen_mm2 += area;
    else
      side.unseen_about_mm += area * at;
  }

  bool stopped() const { return keep_going_.stopped(); }

  std::vector<SeenSide> Sides() const {
    std::vector<SeenSide> found;
    for (SeenSide side : sides_) {
      if (!(side.area_mm2 > 0)) continue;
      const double unseen_mm2 = side.area_mm2 - side.seen_mm2;
      if (unseen_mm2 > 1e-9 * side.area_mm2)
        side.unseen_about_mm /= unseen_mm2;
      else
        side.seen_mm2 = side.area_mm2;
      found.push_back(side);
    }
    return found;
  }

 private:
  // In a cell with a point that looks the same way (never one of the other way: an edge may be thinner than a cell), or in the next one
  // along that way: a bent surface is not in the cells of its triangles everywhere.
  bool Seen(const Vector3d& from_centroid_mm, const Vector3d& normal) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(normal[axis]) < kBeside) continue;
      const Vector3d looks = Vector3d::Unit(axis) * normal[axis];
      for (const double step : {0.0, -1.0, 1.0}) {
        const Vector3d at = from_centroid_mm + step * cell_mm_ * Vector3d::Unit(axis);
        if (seen_.count(PatchKeyOf(at, looks, cell_mm_)) > 0) return true;
      }
    }
    return false;
  }

  const Vector3d centroid_mm_;
  const std::unordered_set<PatchKey> seen_;
  const double cell_mm_;
  const FitOptions& options_;
  std::array<SeenSide, 6> sides_;
  Places places_;
  KeepGoing keep_going_;
  std::size_t pieces_ = 0;
};

}  // namespace

absl::StatusOr<std::vector<SeenSide>> SeenSides(const Surface& surface, const std::vector<PatchKey>& seen,
                                                double cell_mm, const FitOptions& options) {
  Looked looked(surface, seen, cell_mm, options);
  const TriangleMesh& mesh = surface.mesh();
  for (const TriangleCorners& corners : mesh.triangles) {
    Triangle t;
    for (std::size_t k = 0; k < 3; ++k) t[k] = mesh.vertices_mm[corners[k]];
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    if (normal.norm() > 0) looked.Add(t, normal.normalized());
  }
  if (looked.stopped()) return absl::CancelledError("registration: stopped by its caller");
  return looked.Sides();
}

}  // namespace sixpoint::metrology
