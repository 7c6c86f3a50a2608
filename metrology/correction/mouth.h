// A part's surface without the mouth of a hole.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// The line through a path's tips, part frame.
class TipLine {
 public:
  explicit TipLine(Points tips_mm);
  double DistanceMm(const Eigen::Vector3d& point_mm) const;
  // Whether one piece of the line is no farther than that from all three: then from the whole triangle too.
  bool Holds(const std::array<Eigen::Vector3d, 3>& triangle_mm, double reach_mm) const;
  const Eigen::AlignedBox3d& bounds_mm() const { return bounds_mm_; }

 private:
  // Some pieces of the line one after the other: what is far from their box is far from each of them.
  struct Stretch {
    std::size_t first = 0, end = 0;
    Eigen::AlignedBox3d bounds_mm;
  };
  Points tips_mm_;
  Eigen::AlignedBox3d bounds_mm_;
  std::vector<Stretch> stretches_;
};

// The triangles within the box, flat, but what is no farther than the reach from the line. Those that the mouth's rim crosses are halved until they
// are no longer than piece_mm; such a piece stays unless it is wholly in the mouth. Vertices may be several times there. CANCELLED where keep_going (may be empty) says no;
// INVALID_ARGUMENT, with field "mouth", where the rim takes more than so many halvings.
inline constexpr int kMostMouthHalvings = 1'000'000;
absl::StatusOr<TriangleMesh> WithoutMouth(const TriangleMesh& mesh, const TipLine& line, double reach_mm,
                                          double piece_mm, const Eigen::AlignedBox3d& box_mm,
                                          const std::function<bool()>& keep_going = {});

}  // namespace sixpoint::metrology
