// Steps of several feet towards where their queries stand on the surface's normal, side by side, each on a patch of its own. Every
// width of vectors gives the same bits.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "metrology/mesh/patch_numbers.h"
#include "metrology/parallel/lane_width.h"
#include "metrology/parallel/lanes.h"

namespace sixpoint::metrology {

struct FootLanes {
  // Lane by lane: what a foot slides on, whose foot it is and where it is.
  PatchNumbers<LaneRow> patch;
  LaneRow query[3], barycentric[3];
  // Not 0: near enough for the stride to learn from the step before.
  LaneRow is_near, last_aside[3], last_aside_squared, stride;
  LaneRow least_barycentric[3];

  // Of the foot there: its place, the unit normal, the query's distance along it, and how far the query is aside of it.
  LaneRow point_mm[3], normal[3], along_mm, aside_mm[3], aside_squared;
  // One step on, before and after it was held to the least coordinates.
  LaneRow next[3];

  void SetPatch(std::size_t lane, const PatchNumbers<double>& numbers);
  void SetQuery(std::size_t lane, const Eigen::Vector3d& query_mm);
  void SetBarycentric(std::size_t lane, const Eigen::Vector3d& coordinates);
};

// Both of the first `count` lanes, and of some beyond.
struct FootSteps {
  void (*look)(std::size_t count, FootLanes* lanes);  // from barycentric to what is found there
  void (*step)(std::size_t count, FootLanes* lanes);  // to `next`, and on to barycentric
};
FootSteps FootStepsOf(LaneWidth width);

}  // namespace sixpoint::metrology
