#include "services/runtime/listening_sockets.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/services/runtime/raw_connection.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;
using testing::RawConnection;
using testing::Speaks;

bool HasIpv6() {
  const Descriptor made(socket(AF_INET6, SOCK_STREAM, 0));
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_addr = in6addr_loopback;
  return made.is_open() && bind(made.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

std::string Refusal(const std::string& address) { return std::string(ListenAt(address).status().message()); }

TEST(ListeningSockets, EveryFormOfAnAddressIsListenedOn) {
  for (const char* address : {"127.0.0.1:0", "localhost:0", "dns:///localhost:0", "ipv4:127.0.0.1:0", "0.0.0.0:0"}) {
    const auto sockets = ListenAt(address);
    ASSERT_TRUE(sockets.ok()) << address << ": " << sockets.status();
    const int port = PortOf(sockets->front());
    EXPECT_GT(port, 0) << address;
    for (const Descriptor& socket : *sockets) EXPECT_EQ(PortOf(socket), port) << address;
    EXPECT_TRUE(RawConnection("127.0.0.1:" + std::to_string(port), "", Speaks::kNothing).connected()) << address;
  }
}

TEST(ListeningSockets, Ipv6) {
  if (!HasIpv6()) GTEST_SKIP() << "SKIPPED: this machine has no IPv6";
  for (const char* address : {"[::1]:0", "ipv6:[::1]:0"}) EXPECT_TRUE(ListenAt(address).ok()) << address;
  // Every address is those of IPv4 too.
  const auto every = ListenAt("[::]:0");
  ASSERT_TRUE(every.ok()) << every.status();
  EXPECT_TRUE(RawConnection("127.0.0.1:" + std::to_string(PortOf(every->front())), "", Speaks::kNothing).connected());
}

TEST(ListeningSockets, ATakenPortIsRefused) {
  const auto first = ListenAt("127.0.0.1:0");
  ASSERT_TRUE(first.ok());
  const std::string address = "127.0.0.1:" + std::to_string(PortOf(first->front()));
  EXPECT_EQ(Refusal(address),
            "--listen: " + address + " (Address already in use), want an address of this machine that is free");
}

TEST(ListeningSockets, AUnixSocketLeftBehindIsReplacedAndAFileIsNot) {
  std::string folder = (std::filesystem::temp_directory_path() / "sixpoint-listen-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string address = "unix:" + folder + "/socket";
  for (int i = 0; i < 2; ++i) {
    const auto sockets = ListenAt(address);
    ASSERT_TRUE(sockets.ok()) << sockets.status();
    EXPECT_TRUE(RawConnection(address, "", Speaks::kNothing).connected());
  }
  RemoveUnixSocket(address);
  EXPECT_FALSE(std::filesystem::exists(folder + "/socket"));
  std::ofstream(folder + "/file") << "of somebody";
  EXPECT_THAT(Refusal("unix:" + folder + "/file"), HasSubstr("Address already in use"));
  RemoveUnixSocket("unix:" + folder + "/file");
  EXPECT_TRUE(std::filesystem::exists(folder + "/file"));
  EXPECT_THAT(Refusal("unix:/" + std::string(200, 'x')),
              HasSubstr("a unix socket's name of 201 bytes, want at most 107"));
  std::filesystem::remove_all(folder);
}

TEST(ListeningSockets, AnAbstractUnixSocket) {
  const std::string address = "unix-abstract:sixpoint-" + std::to_string(getpid());
  const auto sockets = ListenAt(address);
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  EXPECT_THAT(Refusal(address), HasSubstr("Address already in use"));
}

TEST(ListeningSockets, WhatIsNoAddressIsRefused) {
  for (const char* address : {"host", ":80", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", "127.0.0.1:7x", "[::1:80",
                              "::1]:80", "::1:80", "unix:", "unix-abstract:", "127.0.0.1:0000000000000000000080"})
    EXPECT_EQ(Refusal(address),
              "--listen: " + std::string(address) + ", want HOST:PORT, [IPV6]:PORT, unix:PATH or unix-abstract:NAME")
        << address;
  EXPECT_THAT(Refusal("no-such-host.invalid:80"), HasSubstr("want a host that can be found"));
  // An address of nobody here: of the networks that are for examples (RFC 5737).
  EXPECT_THAT(Refusal("192.0.2.1:0"), HasSubstr("want an address of this machine that is free"));
}

}  // namespace
}  // namespace sixpoint::runtime
