// A piece of an outline as a polynomial height over its tangent.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

namespace sixpoint::metrology {

// Of one sample, or of the mean of several near each other.
struct FitPoint {
  Eigen::Vector2d point_mm;
  double at_mm = 0;      // along the outline
  double beyond_mm = 0;  // off the plane
  double lean = 0;
  double count = 1;  // of samples
};

// What to fit: points from below to above of a place, no others. Points are ordered; at_mm goes on over length_mm where the outline is closed.
struct FitWindow {
  double at_mm = 0, below_mm = 0, above_mm = 0;
  int degree = 4;
};

struct LocalCurve {
  Eigen::Vector2d point_mm, normal;  // of the curve there; outward
  double curvature_per_mm = 0;       // positive where the solid is convex
  double lean = 0;
  // d(offset along the normal) and d(slope) by each point's height: of points first, first + 1, ... around.
  std::size_t first = 0;
  std::vector<float> by_offset, by_slope;
  double sample_variance_mm2 = 0;  // of one sample, by the residuals
  double freedom = 0;
};

class LocalFit {
 public:
  // length_mm: of the closed outline. lean_known: the points' own; else it is fitted. robust: points far off count less.
  LocalFit(const std::vector<FitPoint>& points, double length_mm, bool lean_known, bool robust)
      : points_(points), length_mm_(length_mm), lean_known_(lean_known), robust_(robust) {}

  // Which points a window holds: first, first + 1, ... around.
  struct Range {
    std::size_t first = 0, count = 0;
  };
  Range WindowOf(const FitWindow& window) const;

  // start_mm and along: a place and the direction of the outline there, about right. Absent: fewer than four points.
  std::optional<LocalCurve> At(const FitWindow& window, const Eigen::Vector2d& start_mm, Eigen::Vector2d along) const;

 private:
  const std::vector<FitPoint>& points_;
  double length_mm_;
  bool lean_known_, robust_;
};

}  // namespace sixpoint::metrology
