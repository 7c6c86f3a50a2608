// Triangles among which the nearest of some points is, listed so that few of them need be looked at.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "metrology/nearest/near_lanes.h"

namespace sixpoint::metrology {

constexpr std::uint32_t kCandidateGroup = 4;

// Items of the tree, about from near to far, in groups (the last filled up with an item of the list), as CandidateLists keeps them.
struct CandidateList {
  const std::uint16_t* low;   // of an item, counted from the least
  const std::uint16_t* high;  // what is above; null where nothing is
  std::uint32_t least_item;
  std::uint32_t group_count;
  const std::uint8_t* steps;  // by group
  float step_mm;

  std::uint32_t item_count() const { return kCandidateGroup * group_count; }
  std::uint32_t item(std::uint32_t k) const {
    return least_item + (high == nullptr ? 0 : static_cast<std::uint32_t>(high[k]) << 16) + low[k];
  }
  // To the nearest of the group and those after it, at least; from where the list's distances are counted.
  float group_distance_mm(std::uint32_t group) const { return static_cast<float>(steps[group]) * step_mm; }
};

struct Candidates {
  Eigen::Vector3d centre;  // about which points are measured, and from which distances are counted
  float width_mm;          // no query is farther from it
  CandidateList list;
};

// How far off a distance to it in single precision may be, of points up to width_mm from where its corner is counted from.
float ToleranceOf(const TriangleShape& shape, const Eigen::Vector3f& corner_mm, float width_mm);

// Of a triangle with its first corner at the origin.
TriangleShape ShapeOf(const Eigen::Vector3d& ab, const Eigen::Vector3d& ac);

}  // namespace sixpoint::metrology
