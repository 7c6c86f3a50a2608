#include "services/runtime/peers.h"

#include <gtest/gtest.h>

namespace sixpoint::runtime {
namespace {

TEST(Peers, AreWhereTheyAreSaidToBeOrWhereTheyUsuallyAre) {
  ServerOptions options;
  options.peers = {{"plant", "10.0.0.1:80"}};
  EXPECT_EQ(PeerAddress(options, "plant"), "10.0.0.1:80");
  EXPECT_EQ(PeerAddress(options, "ingest"), "127.0.0.1:7401");
}

}  // namespace
}  // namespace sixpoint::runtime
