// Points of an outline in their order, found from points in none.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/sections/samples.h"

namespace sixpoint::metrology {

// A polygon, counter-clockwise and closed: its last point is followed by its first.
struct PointChain {
  std::vector<Eigen::Vector2d> points_mm;
  std::vector<bool> gap_before;  // nothing was seen between the point before and this one
  double spacing_mm = 0;         // points are no nearer than that
  std::vector<double> at_mm;     // of each along the chain, over gaps too
  double length_mm = 0;
};

struct ChainOptions {
  double spacing_mm = 0;  // of the chain: beyond what noise and lean scatter points across it
  double gap_mm = 0;      // points farther apart are not joined; 0: farther than points at random would be
};

// Points thinned to the spacing, then the shortest joints first (each point has at most two), then what pieces are left by their nearest ends.
// INVALID_ARGUMENT: too few points, several outlines of which none is the only great one.
absl::StatusOr<PointChain> ChainOf(const std::vector<SectionSample>& samples, const ChainOptions& options);

// Of a closed polygon that is known; turned counter-clockwise, points that are the same left out.
absl::StatusOr<PointChain> ChainOfLoop(const std::vector<Eigen::Vector2d>& loop_mm);

// A sample's place beside the chain.
struct ChainedSample {
  double at_mm = 0, height_mm = 0;  // along; outward
  std::uint32_t sample = 0;
};
// In the order of the chain. Those farther off than the reach are left out; strays counts them.
std::vector<ChainedSample> Chained(const std::vector<SectionSample>& samples, const PointChain& chain, double reach_mm,
                                   std::int64_t* strays);

// Moves each point of the chain to the median height of the samples about it: a chain goes through samples, and so through outliers.
void Settle(const std::vector<ChainedSample>& chained, PointChain* chain);

}  // namespace sixpoint::metrology
