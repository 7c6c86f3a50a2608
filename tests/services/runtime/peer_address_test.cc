#include "services/runtime/peer_address.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <cstring>

namespace sixpoint::runtime {
namespace {

sockaddr_storage V4(const char* address, std::uint16_t port) {
  sockaddr_storage peer{};
  auto& in = reinterpret_cast<sockaddr_in&>(peer);
  in.sin_family = AF_INET;
  in.sin_port = htons(port);
  EXPECT_EQ(inet_pton(AF_INET, address, &in.sin_addr), 1);
  return peer;
}

sockaddr_storage V6(const char* address, std::uint16_t port) {
  sockaddr_storage peer{};
  auto& in = reinterpret_cast<sockaddr_in6&>(peer);
  in.sin6_family = AF_INET6;
  in.sin6_port = htons(port);
  EXPECT_EQ(inet_pton(AF_INET6, address, &in.sin6_addr), 1);
  return peer;
}

TEST(PeerAddress, ANameHasItsAddresssKey) {
  for (const sockaddr_storage& peer :
       {V4("10.0.0.1", 4000), V6("2001:db8::1", 4000), V6("::1", 1), V6("::ffff:10.0.0.1", 7)})
    EXPECT_EQ(PeerKey(GrpcName(peer)), PeerKey(peer)) << GrpcName(peer);
  EXPECT_EQ(GrpcName(V4("10.0.0.1", 4000)), "ipv4:10.0.0.1:4000");
  EXPECT_EQ(GrpcName(V6("2001:db8::1", 4000)), "ipv6:%5B2001:db8::1%5D:4000");
  EXPECT_EQ(GrpcName(V6("::ffff:10.0.0.1", 7)), "ipv4:10.0.0.1:7");
}

TEST(PeerAddress, OnePeerIsAnAddressOrAnIpv6Network) {
  EXPECT_EQ(PeerKey("ipv4:10.0.0.1:4000"), PeerKey("ipv4:10.0.0.1:5000"));
  EXPECT_NE(PeerKey("ipv4:10.0.0.1:4000"), PeerKey("ipv4:10.0.0.2:4000"));
  EXPECT_EQ(PeerKey("ipv6:%5B2001:db8:0:1::1%5D:4000"), PeerKey("ipv6:%5B2001:db8:0:1:ffff::2%5D:5000"));
  EXPECT_NE(PeerKey("ipv6:%5B2001:db8:0:1::1%5D:4000"), PeerKey("ipv6:%5B2001:db8:0:2::1%5D:4000"));
  EXPECT_EQ(PeerKey("ipv6:%5B::ffff:10.0.0.1%5D:4000"), PeerKey("ipv4:10.0.0.1:4000"));
  EXPECT_EQ(PeerKey("ipv6:%5Bfe80::1%25eth0%5D:4000"), PeerKey("ipv6:%5Bfe80::2%5D:4000"));
  EXPECT_EQ(PeerKey("unix:"), PeerKey("unix:/tmp/socket"));
}

TEST(PeerAddress, AnUnknownNameIsItsOwnPeer) {
  EXPECT_EQ(PeerKey("vsock:3:4000"), "vsock:3");
  EXPECT_NE(PeerKey("ipv4:nonsense:1"), PeerKey("ipv4:other:1"));
}

}  // namespace
}  // namespace sixpoint::runtime
