#include "services/runtime/peer_shares.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <vector>

namespace sixpoint::runtime {
namespace {

TEST(PeerShares, OnePeerHoldsItsShareAndOthersTheirs) {
  PeerShares shares(2);
  std::vector<PeerShares::Share> held;
  for (const char* peer : {"ipv4:10.0.0.1:4000", "ipv4:10.0.0.1:4001", "ipv4:10.0.0.2:4000", "ipv6:%5B::1%5D:4000",
                           "ipv6:%5B::1%5D:4001", "unix:"}) {
    auto share = shares.Take(peer);
    ASSERT_TRUE(share.has_value()) << peer;
    held.push_back(*std::move(share));
  }
  EXPECT_FALSE(shares.Take("ipv4:10.0.0.1:4002").has_value());
  EXPECT_FALSE(shares.Take("ipv6:%5B::1%5D:4002").has_value());
  EXPECT_TRUE(shares.Take("ipv4:10.0.0.2:4001").has_value());
  held.clear();
  EXPECT_TRUE(shares.Take("ipv4:10.0.0.1:4002").has_value());
}

TEST(PeerShares, WhoWaitsGetsWhatHisPeerGivesBackAndNobodyElseDoes) {
  PeerShares shares(1);
  std::optional<PeerShares::Share> held = shares.Take("ipv4:10.0.0.1:4000");
  ASSERT_TRUE(held.has_value());
  const auto take = [&](const char* peer, std::chrono::milliseconds patience, const std::atomic<bool>& goes_on) {
    return shares.Take(peer, std::chrono::steady_clock::now() + patience, [&] { return goes_on.load(); });
  };
  const std::atomic<bool> on_and_on{true};
  std::atomic<bool> alive{true};
  EXPECT_FALSE(take("ipv4:10.0.0.1:4001", std::chrono::milliseconds(30), on_and_on).has_value());
  auto gone = std::async(std::launch::async,
                         [&] { return take("ipv4:10.0.0.1:4001", std::chrono::seconds(30), alive).has_value(); });
  auto next = std::async(std::launch::async,
                         [&] { return take("ipv4:10.0.0.1:4002", std::chrono::seconds(30), on_and_on).has_value(); });
  // Another peer's is another's to give.
  EXPECT_TRUE(shares.Take("ipv4:10.0.0.2:4000").has_value());
  alive = false;
  EXPECT_FALSE(gone.get());
  held.reset();
  EXPECT_TRUE(next.get());
  EXPECT_TRUE(shares.Take("ipv4:10.0.0.1:4000").has_value());
}

}  // namespace
}  // namespace sixpoint::runtime
