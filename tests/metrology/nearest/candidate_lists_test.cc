#include "metrology/nearest/candidate_lists.h"

#include <gtest/gtest.h>

namespace sixpoint::metrology {
namespace {

constexpr float kFarthestMm = 1.2f;

struct Plain {
  std::vector<std::uint32_t> items;
  std::vector<float> distances_mm;
};
const Plain kNear{{70000, 70003, 69999, 70000, 135534, 70001, 70000, 70000},
                  {0, 0.3f}};  // 65,535 from the least to the greatest
const Plain kWide{{5, 65541, 0xfffffffe, 5}, {kFarthestMm}};
const Plain kNothing{};

void ExpectThat(const CandidateList& list, const Plain& plain) {
  ASSERT_EQ(list.group_count, plain.distances_mm.size());
  ASSERT_EQ(list.item_count(), plain.items.size());
  for (std::uint32_t k = 0; k < plain.items.size(); ++k) EXPECT_EQ(list.item(k), plain.items[k]) << k;
  for (std::uint32_t g = 0; g < plain.distances_mm.size(); ++g) {
    EXPECT_LE(list.group_distance_mm(g), plain.distances_mm[g]);
    EXPECT_GT(list.group_distance_mm(g), plain.distances_mm[g] - 1.001f * kFarthestMm / 255);
  }
}

void Add(const Plain& plain, CandidateLists* lists) { lists->Add(plain.items, plain.distances_mm); }

TEST(CandidateLists, AreReadAsTheyWereAddedAndDistancesAsNeverMore) {
  CandidateLists lists(kFarthestMm), others(kFarthestMm);
  for (const Plain* plain : {&kWide, &kNear, &kNothing}) Add(*plain, &lists);
  for (const Plain* plain : {&kNear, &kWide}) Add(*plain, &others);
  lists.Append(others);
  ASSERT_EQ(lists.size(), 5u);
  EXPECT_EQ(lists.slot_count(), 2u + 2u + 0u + 2u + 2u);
  std::size_t at = 0;
  for (const Plain* plain : {&kWide, &kNear, &kNothing, &kNear, &kWide}) {
    SCOPED_TRACE(at);
    ExpectThat(lists[at++], *plain);
  }
}

TEST(CandidateLists, EveryDistanceIsReadAsNeverMore) {
  CandidateLists lists(kFarthestMm);
  for (int i = 0; i <= 100000; ++i) {
    const Plain plain{{1, 2, 3, 4}, {kFarthestMm * static_cast<float>(i) / 100000}};
    lists.Clear();
    Add(plain, &lists);
    ExpectThat(lists[0], plain);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
