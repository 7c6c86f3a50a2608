// Lists of candidates, packed: of a million triangles they would be most of what a surface holds in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metrology/nearest/candidates.h"

namespace sixpoint::metrology {

// An item takes two bytes where all of its list are within 65,536 of each other (neighbours are, in the tree's order), else four; a
// group's distance one. Read by any number of threads.
class CandidateLists {
 public:
  // farthest_mm: of what distances are, more than 0.
  explicit CandidateLists(float farthest_mm = 1) : step_mm_(farthest_mm / kSteps) {}

  // Adds one: its items in whole groups, and the distance of each group.
  void Add(const std::vector<std::uint32_t>& items, const std::vector<float>& group_distances_mm);
  // Adds those of another with the same farthest_mm.
  void Append(const CandidateLists& other);
  void Reserve(std::size_t list_count, std::size_t slot_count);
  void Clear();

  std::size_t size() const { return lists_.size(); }
  std::size_t slot_count() const {
    return steps_.size();
  }  // that all take: one for a group, two for one of four bytes an item
  std::size_t memory_bytes() const;

  CandidateList operator[](std::size_t list) const;

 private:
  static constexpr float kSteps = 255;
  struct List {
    std::uint32_t first_slot, least_item;
    bool wide;
  };
  float step_mm_;
  std::vector<List> lists_;
  std::vector<std::uint16_t>
      halves_;  // of items: kCandidateGroup of each slot; of a wide list first all lower halves, then all upper
  std::vector<std::uint8_t> steps_;  // by slot; of a wide list the first half of them is in use
};

}  // namespace sixpoint::metrology
