// A section's outline as a smooth curve between corners and gaps.
//
// Section frame, mm. Nodes run counter-clockwise, about the solid; the last one is followed by the first. Thread-safe to read.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace sixpoint::metrology {

inline double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// How a node follows the one before it.
enum class Join : std::uint8_t {
  kSmooth,
  kCorner,  // at the same place, with a normal of its own
  kGap,     // what lies between was not seen
};

struct OutlineNode {
  Eigen::Vector2d point_mm, normal;  // outward, unit
  double at_mm = 0;                  // along the outline, over gaps by their chord
  double lean = 0;                   // how far the surface goes outward for each mm along the plane's normal
  Join before = Join::kSmooth;
};

// A place on the outline: between node `node` and the next one.
struct OutlinePlace {
  std::size_t node = 0;
  double part = 0;  // 0 to 1
};

class Outline {
 public:
  Outline() = default;
  explicit Outline(std::vector<OutlineNode> nodes);

  const std::vector<OutlineNode>& nodes() const { return nodes_; }
  std::size_t size() const { return nodes_.size(); }
  std::size_t Next(std::size_t i) const { return i + 1 == nodes_.size() ? 0 : i + 1; }
  std::size_t Previous(std::size_t i) const { return i == 0 ? nodes_.size() - 1 : i - 1; }
  Join JoinAfter(std::size_t i) const { return nodes_[Next(i)].before; }
  double length_mm() const { return length_mm_; }
  double gap_length_mm() const { return gap_length_mm_; }

  // Between two nodes a cubic that has their points and normals; over a gap its chord.
  Eigen::Vector2d PointAt(const OutlinePlace& place) const;
  Eigen::Vector2d NormalAt(const OutlinePlace& place) const;
  double At(const OutlinePlace& place) const;  // along the outline, mm
  OutlinePlace PlaceAt(double at_mm) const;    // beyond the length: around once more

  // Where the curve is farthest along a direction. Not set: a gap is beside it, so that it may lie there.
  std::optional<OutlinePlace> Farthest(const Eigen::Vector2d& direction) const;
  // The place nearest to a point, gaps left out; from brute force.
  OutlinePlace Nearest(const Eigen::Vector2d& point_mm) const;

  // Each node moved along its normal by so much, its slope changed by d(offset)/d(along); corners follow both their sides.
  Outline Offset(const std::vector<double>& offsets_mm, const std::vector<double>& slopes) const;

 private:
  std::vector<OutlineNode> nodes_;
  double length_mm_ = 0, gap_length_mm_ = 0;
};

// Counter-clockwise by a quarter: of an outward normal the direction in which the outline runs.
inline Eigen::Vector2d LeftOf(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

}  // namespace sixpoint::metrology
