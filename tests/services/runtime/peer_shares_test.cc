#include "services/runtime/peer_shares.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace sixpoint::runtime
