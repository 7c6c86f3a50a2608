#include "cli/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

std::string RefusalOfListening(const std::string& listen, const std::string& announce) {
  return std::string(ListenAddressOf(listen, announce).status().message());
}

TEST(ListenAddress, IsAnnouncedAsItListens) {
  for (const char* host : {"127.0.0.1", "127.0.0.2", "::1", "localhost"}) {
    const auto address = ListenAddressOf(host, "");
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_TRUE(address->IsLoopback()) << host;
    EXPECT_EQ(address->announce, host);
    EXPECT_EQ(address->Own(), host);
  }
}

TEST(ListenAddress, MayBeOffLoopback) {
  for (const char* host : {"10.1.2.3", "128.0.0.1", "fe80::1", "plant.example", "127.example"}) {
    const auto address = ListenAddressOf(host, "");
    ASSERT_TRUE(address.ok()) << address.status();
    EXPECT_FALSE(address->IsLoopback()) << host;
  }
}

// Clients compare it with the certificate letter by letter.
TEST(ListenAddress, IsWrittenAsACertificateHasIt) {
  const auto address = ListenAddressOf("0:0:0:0:0:0:0:0", "FE80:0::1");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->listen, "::");
  EXPECT_EQ(address->announce, "fe80::1");
}

// Nobody can connect to "every address".
TEST(ListenAddress, OfEveryAddressWantsAHostForClients) {
  EXPECT_THAT(RefusalOfListening("0.0.0.0", ""), HasSubstr("--announce too"));
  EXPECT_THAT(RefusalOfListening("::", "0.0.0.0"), HasSubstr("--announce: 0.0.0.0, want"));
  const auto address = ListenAddressOf("0.0.0.0", "plant.example");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_EQ(address->announce, "plant.example");
  EXPECT_EQ(address->Own(), "127.0.0.1");
}

// It becomes a word of a command line.
TEST(ListenAddress, IsAHostAndNothingElse) {
  for (const char* host : {"", "10.0.0.1:7400", "10.0.0.256", "a b", "a;b", "%(x)s", "-x", "x-.y", "a..b", ".", "a."})
    EXPECT_THAT(RefusalOfListening(host, ""), HasSubstr("--listen")) << host;
}

TEST(HostAndPort, PutsBracketsRoundIpv6) {
  EXPECT_EQ(HostAndPort("127.0.0.1", 7400), "127.0.0.1:7400");
  EXPECT_EQ(HostAndPort("::1", 7400), "[::1]:7400");
}

}  // namespace
}  // namespace sixpoint::cli
