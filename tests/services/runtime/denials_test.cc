#include "services/runtime/denials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace sixpoint::runtime {
namespace {

std::int64_t CountOf(const std::vector<storage::Denial>& denials) {
  return std::accumulate(denials.begin(), denials.end(), std::int64_t{0},
                         [](std::int64_t sum, const storage::Denial& one) { return sum + one.count; });
}

TEST(Denials, AlikeOnesAreOneRowWithTheirCount) {
  Denials denials("ingest");
  for (int i = 0; i < 1000; ++i) denials.Add("S/GetScan", "users/jane", "ipv4:1.2.3.4:5", "ROLE_MISSING", "no");
  denials.Add("S/GetScan", "", "ipv4:1.2.3.4:5", "CERTIFICATE_MISSING", "none was shown");
  const auto taken = denials.Take();
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken[0].reason, "CERTIFICATE_MISSING");
  EXPECT_EQ(taken[1].count, 1000);
  EXPECT_EQ(taken[1].area, "ingest");
  EXPECT_LE(taken[1].first_denied_at, taken[1].last_denied_at);
  EXPECT_TRUE(denials.Take().empty());
}

// However many names a stranger thinks of, memory and rows are bounded, and each is counted.
TEST(Denials, AFloodOfNamesIsBoundedAndCountedWhole) {
  Denials denials("ingest");
  for (int i = 0; i < 100'000; ++i)
    denials.Add("S/M", "users/u" + std::to_string(i), "peer", "CERTIFICATE_FOREIGN", "no");
  auto taken = denials.Take();
  EXPECT_EQ(taken.size(), static_cast<std::size_t>(Denials::kRowsAMinute));
  EXPECT_TRUE(denials.Take().empty());  // until the minute is over
  denials.PutBack(taken);
  taken = denials.Take();
  EXPECT_EQ(taken.size(), static_cast<std::size_t>(Denials::kRowsAMinute));
  const auto rest = std::find_if(taken.begin(), taken.end(), [](const auto& one) { return one.method == "*"; });
  ASSERT_NE(rest, taken.end());
  EXPECT_EQ(rest->caller, "");
  // All but those kept apart; what was put back may have found no place of its own.
  EXPECT_GE(rest->count, 100'000 - static_cast<std::int64_t>(Denials::kKept));
  EXPECT_LE(rest->count, 100'000 - static_cast<std::int64_t>(Denials::kKept) + Denials::kRowsAMinute);
  EXPECT_EQ(CountOf(taken), rest->count + Denials::kRowsAMinute - 1);
}

// No database takes them, and what stands beside them would not be written either.
TEST(Denials, BytesThatAreNoTextAreNone) {
  Denials denials("ingest");
  denials.Add("S/M", "users/\xff\xfe", "p\xc0\xaf", "ROLE_MISSING", "said \xed\xa0\x80\x01 and ü");
  const auto taken = denials.Take();
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(taken[0].caller, "users/??");
  EXPECT_EQ(taken[0].peer_address, "p??");
  EXPECT_EQ(taken[0].sentence, "said ???? and ü");
}

TEST(Denials, WhatCouldNotBeWrittenIsWrittenLater) {
  Denials denials("ingest");
  denials.Add("S/M", "users/jane", "peer", "ROLE_MISSING", "no");
  const auto taken = denials.Take();
  denials.PutBack(taken);
  denials.Add("S/M", "users/jane", "peer", "ROLE_MISSING", "no");
  const auto again = denials.Take();
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].count, 2);
}

}  // namespace
}  // namespace sixpoint::runtime
