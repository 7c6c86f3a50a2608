#include "metrology/nearest/candidate_lists.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace sixpoint::metrology {

void CandidateLists::Add(const std::vector<std::uint32_t>& items, const std::vector<float>& group_distances_mm) {
  const auto [least, greatest] = std::minmax_element(items.begin(), items.end());
  const bool wide = !items.empty() && *greatest - *least > 0xffff;
  lists_.push_back({static_cast<std::uint32_t>(steps_.size()), items.empty() ? 0 : *least, wide});
  const std::uint32_t least_item = lists_.back().least_item;
  for (const std::uint32_t item : items) halves_.push_back(static_cast<std::uint16_t>((item - least_item) & 0xffff));
  for (const float distance_mm : group_distances_mm) {
    float step = std::min(std::floor(distance_mm / step_mm_), kDistanceSteps);
    if (step * step_mm_ > distance_mm) --step;  // what it is read as is never more
    steps_.push_back(static_cast<std::uint8_t>(step));
  }
  if (!wide) return;
  for (const std::uint32_t item : items) halves_.push_back(static_cast<std::uint16_t>((item - least_item) >> 16));
  steps_.resize(steps_.size() + group_distances_mm.size());
}

void CandidateLists::Append(const CandidateLists& other) {
  assert(other.step_mm_ == step_mm_);
  const auto units = static_cast<std::uint32_t>(steps_.size());
  for (const List& its : other.lists_) lists_.push_back({units + its.first_unit, its.least_item, its.wide});
  halves_.insert(halves_.end(), other.halves_.begin(), other.halves_.end());
  steps_.insert(steps_.end(), other.steps_.begin(), other.steps_.end());
}

void CandidateLists::Reserve(std::size_t list_count, std::size_t unit_count) {
  lists_.reserve(list_count);
  halves_.reserve(kCandidateGroup * unit_count);
  steps_.reserve(unit_count);
}

void CandidateLists::Clear() {
  lists_.clear();
  halves_.clear();
  steps_.clear();
}

std::size_t CandidateLists::memory_bytes() const {
  return lists_.capacity() * sizeof(List) + halves_.capacity() * sizeof(std::uint16_t) + steps_.capacity();
}

CandidateList CandidateLists::operator[](std::size_t list) const {
  const List& its = lists_[list];
  const std::size_t end = list + 1 < lists_.size() ? lists_[list + 1].first_unit : steps_.size();
  const auto units = static_cast<std::uint32_t>(end - its.first_unit);
  const std::uint32_t groups = its.wide ? units / 2 : units;
  const std::uint16_t* low = halves_.data() + std::size_t{kCandidateGroup} * its.first_unit;
  return {low,
          its.wide ? low + std::size_t{kCandidateGroup} * groups : nullptr,
          its.least_item,
          groups,
          steps_.data() + its.first_unit,
          step_mm_};
}

}  // namespace sixpoint::metrology
