// A section as a camber line with the thickness along it: what a repair extrapolates (docs/methods/repair.md).
//
// The medial axis is metrology/sections'; here its circles are filtered, made a smooth line with Chebyshev-spaced stations, and continued to
// the outline. Section frame, mm. Thread-safe; the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "metrology/sections/camber.h"

namespace sixpoint::metrology {

inline constexpr std::size_t kOutlinePoints = 500;  // of each section, as published
inline constexpr std::size_t kCamberStations = 101;

enum class CamberMethod {
  kPublished,  // parabolas through the circles, continued by a line at the trailing edge and a parabola at the leading one
  kBisected,  // each of those places then moved to where it is as far from both sides, until both contacts are about one place
};

struct CamberStation {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  // unit, from leading to trailing
  double radius_mm = 0;                              // half the thickness: of the circle that touches both sides
};

// Why a circle of the medial axis is no part of the camber line.
struct CamberFilters {
  std::size_t one_sided_count = 0;  // its contacts do not lie to both sides of the line
  std::size_t out_of_order_count =
      0;  // a contact lies before that of a circle nearer to the leading end: of another branch
  std::size_t not_ahead_count =
      0;  // its centre lies no farther along than one nearer to the middle: about an end's own centre many lie
  std::size_t off_line_count = 0;  // farther from a parabola through its neighbours than they scatter
};

// Of the camber line beyond its first or last circle to where it leaves the outline.
struct CamberExtension {
  Eigen::Vector2d tip_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d outward = Eigen::Vector2d::UnitX();  // direction at the tip
  std::vector<Eigen::Vector2d> points_mm;              // from the last circle to the tip
};

struct CamberProfile {
  std::vector<CamberStation> stations;  // kCamberStations, Chebyshev-spaced by arc length, both ends included
  double length_mm = 0;                 // of the line from the first to the last circle
  CamberExtension leading, trailing;
  CamberFilters filters;
};

// About kOutlinePoints of the outline, Chebyshev-spaced between its corners and gaps; where it has none between the two points that are farthest
// apart: dense at the ends, where the outline turns.
Outline ChebyshevOutline(const Outline& outline);

// INVALID_ARGUMENT, field "outline": no circle touches two sides, an end was not seen, too few circles remain: no closed airfoil.
absl::StatusOr<CamberProfile> ProfileOf(const Outline& outline, const LeadingHint& hint, CamberMethod method);

// The line at a part of its length, 0 to 1, by a cubic between stations.
CamberStation StationAt(const CamberProfile& profile, double part);

// Chebyshev-Lobatto: places 0 to 1, both ends included.
std::vector<double> ChebyshevPlaces(std::size_t count);

}  // namespace sixpoint::metrology
