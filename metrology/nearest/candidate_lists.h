// Lists of candidates, packed: of a million triangles they would be most of what a surface holds in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/nearest/candidates.h"

namespace sixpoint::metrology {

// An item takes two bytes where all of its list are less than 65,536 apart (neighbours are, in the tree's order), else four; a group's
// distance one. Read by any number of threads.
class CandidateLists {
 public:
  // No group's distance is more than farthest_mm, which is more than 0: one that is would be told as no more than it.
  explicit CandidateLists(float farthest_mm) : step_mm_(farthest_mm / kDistanceSteps) {}

  // Adds one: its items in whole groups, and the distance of each group.
  void Add(const std::vector<std::uint32_t>& items, const std::vector<float>& group_distances_mm);
  // Adds those of another, whose distances are told in the same steps.
  void Append(const CandidateLists& other);
  void Reserve(std::size_t list_count, std::size_t unit_count);
  void Clear();

  std::size_t size() const { return lists_.size(); }
  // That all take: one for a group of four, two for one whose items take four bytes.
  std::size_t unit_count() const { return steps_.size(); }
  std::size_t memory_bytes() const;

  CandidateList operator[](std::size_t list) const;

 private:
  static constexpr float kDistanceSteps = 255;
  struct List {
    std::uint32_t first_unit, least_item;
    bool wide;
  };
  float step_mm_;
  std::vector<List> lists_;
  // kCandidateGroup for each unit; of a wide list first the lower halves of all its items, then the upper.
  std::vector<std::uint16_t> halves_;
  // One for each unit; of a wide list those in the first half tell its groups' distances.
  std::vector<std::uint8_t> steps_;
};

}  // namespace sixpoint::metrology
