#include "metrology/nearest/candidate_lists.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr float kFarthestMm = 1.2f;

struct Plain {
  std::vector<std::uint32_t> items;
  std::vector<float> distances_mm;
};
const Plain kNear{{70000, 70003, 69999, 70000, 135534, 70001, 70000, 70000},
                  {0, 0.3f}};  // 65,535 from the least to the greatest
const Plain kAlmostNear{{5, 65541, 5, 5}, {0.7f}};
const Plain kWide{{5, 65541, 0xfffffffe, 5}, {kFarthestMm}};
const Plain kNothing{};

void ExpectThat(const CandidateList& list, const Plain& plain) {
  ASSERT_EQ(list.group_count, plain.distances_mm.size());
  ASSERT_EQ(list.item_count(), plain.items.size());
  for (std::uint32_t k = 0; k < plain.items.size(); ++k) EXPECT_EQ(list.item(k), plain.items[k]) << k;
  for (std::uint32_t g = 0; g < plain.distances_mm.size(); ++g) {
    EXPECT_LE(list.group_distance_mm(g), plain.distances_mm[g]);
    EXPECT_GE(list.group_distance_mm(g) + list.step_mm, plain.distances_mm[g]);
  }
}

void Add(const Plain& plain, CandidateLists* lists) { lists->Add(plain.items, plain.distances_mm); }

TEST(CandidateLists, AreReadAsTheyWereAddedAndDistancesAsNeverMore) {
  CandidateLists lists(kFarthestMm), others(kFarthestMm);
  for (const Plain* plain : {&kWide, &kNear, &kNothing}) Add(*plain, &lists);
  for (const Plain* plain : {&kNear, &kAlmostNear, &kWide}) Add(*plain, &others);
  lists.Append(others);
  ASSERT_EQ(lists.size(), 6u);
  EXPECT_EQ(lists.unit_count(), 2u + 2u + 0u + 2u + 2u + 2u);
  std::size_t at = 0;
  for (const Plain* plain : {&kWide, &kNear, &kNothing, &kNear, &kAlmostNear, &kWide}) {
    SCOPED_TRACE(at);
    ExpectThat(lists[at++], *plain);
  }
}

TEST(CandidateLists, EveryDistanceIsReadAsNeverMore) {
  CandidateLists lists(kFarthestMm);
  const auto expect_of = [&](float distance_mm) {
    const Plain plain{{1, 2, 3, 4}, {distance_mm}};
    lists.Clear();
    Add(plain, &lists);
    ExpectThat(lists[0], plain);
  };
  for (int i = 0; i <= 100000; ++i) expect_of(kFarthestMm * static_cast<float>(i) / 100000);
  // Just below a step, where the quotient is rounded up to it.
  const float step_mm = lists[0].step_mm;
  for (int i = 1; i <= 255; ++i) expect_of(std::nextafter(static_cast<float>(i) * step_mm, 0.f));
}

}  // namespace
}  // namespace sixpoint::metrology
