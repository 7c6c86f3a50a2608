#include "metrology/parallel/loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "metrology/parallel/keep_going.h"

namespace sixpoint::metrology {
namespace {

constexpr int kThreadCounts[] = {0, 1, 2, 3, 8};

TEST(Loops, EachIndexIsVisitedOnce) {
  for (const int threads : kThreadCounts) {
    for (const std::size_t count : {0, 1, 2, 1000}) {
      std::vector<std::atomic<int>> visits(count);
      ForEach(count, threads, [&](std::size_t i) { ++visits[i]; });
      for (const auto& visit : visits) EXPECT_EQ(visit, 1);
    }
  }
}

TEST(Loops, ChunksHaveTheirSizeWhateverTheThreads) {
  for (const int threads : kThreadCounts) {
    std::vector<std::pair<std::size_t, std::size_t>> chunks(3);
    ForEachChunk(25, 10, threads, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      chunks.at(chunk) = {begin, end};
    });
    EXPECT_EQ(chunks[0], std::make_pair(std::size_t{0}, std::size_t{10}));
    EXPECT_EQ(chunks[1], std::make_pair(std::size_t{10}, std::size_t{20}));
    EXPECT_EQ(chunks[2], std::make_pair(std::size_t{20}, std::size_t{25}));
  }
}

TEST(Loops, ASumOverChunksHasTheSameBitsOnAnyNumberOfThreads) {
  const auto sum = [](int threads) {
    const auto of_chunk = [](std::size_t begin, std::size_t end) {
      double here = 0;
      for (std::size_t i = begin; i < end; ++i) here += std::sin(static_cast<double>(i));
      return here;
    };
    double all = 0;
    for (const double here : OfEachChunk<double>(100'000, 64, threads, of_chunk)) all += here;
    return all;
  };
  const double alone = sum(1);
  for (int repeat = 0; repeat < 20; ++repeat)
    for (const int threads : kThreadCounts) EXPECT_EQ(sum(threads), alone);
}

TEST(Loops, PartsCoverTheListInOrder) {
  for (const int threads : kThreadCounts) {
    std::vector<std::size_t> part_of(1001, 99);
    InParts(part_of.size(), threads, [&](std::size_t begin, std::size_t end, std::size_t part) {
      for (std::size_t i = begin; i < end; ++i) part_of[i] = part;
    });
    EXPECT_TRUE(std::is_sorted(part_of.begin(), part_of.end()));
    EXPECT_EQ(part_of.front(), 0u);
    EXPECT_EQ(part_of.back(), PartCount(threads) - 1);
  }
}

TEST(Loops, LoopsMayStandInsideLoops) {
  std::atomic<int> visits = 0;
  ForEach(8, 4, [&](std::size_t) { ForEach(100, 4, [&](std::size_t) { ++visits; }); });
  EXPECT_EQ(visits, 800);
}

TEST(Loops, WhatABodyThrowsComesOut) {
  for (const int threads : kThreadCounts)
    EXPECT_THROW(ForEach(100, threads,
                         [](std::size_t i) {
                           if (i == 57) throw std::runtime_error("57");
                         }),
                 std::runtime_error);
}

TEST(KeepGoing, AsksNoMoreAfterTheFirstNo) {
  int asked = 0;
  const std::function<bool()> ask = [&] { return ++asked < 3; };
  KeepGoing keep_going(ask);
  ForEach(100, 4, [&](std::size_t) { keep_going(); });
  EXPECT_TRUE(keep_going.stopped());
  EXPECT_EQ(asked, 3);
}

TEST(KeepGoing, GoesOnWhereNobodyAsks) {
  const std::function<bool()> nobody;
  KeepGoing keep_going(nobody);
  EXPECT_TRUE(keep_going());
  EXPECT_FALSE(keep_going.stopped());
}

}  // namespace
}  // namespace sixpoint::metrology
