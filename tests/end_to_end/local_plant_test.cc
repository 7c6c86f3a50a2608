// `sixpoint up` where other hosts are to reach the plant: clients are told addresses that they can use.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "tests/end_to_end/plant_on_this_machine.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;

// An address of this machine's that is not a loopback one.
std::optional<std::string> OuterAddress() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return std::nullopt;
  std::optional<std::string> found;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET || (one->ifa_flags & IFF_LOOPBACK) != 0 ||
        (one->ifa_flags & IFF_UP) == 0)
      continue;
    char text[INET_ADDRSTRLEN];
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text, sizeof text) != nullptr) found = text;
  }
  freeifaddrs(all);
  return found;
}

class LocalPlantTest : public PlantOnThisMachine {
 protected:
  // Every service, found by the plant's address on that host; the last one calls others itself.
  void ExpectAllReachedAt(const std::string& host) {
    for (const char* noun : {"machine", "scan", "calibration", "registration", "correction", "inspection"}) {
      const Answer answer = Run({noun, "list", "--json", "--server", At(host)});
      EXPECT_EQ(answer.exit_code, 0) << answer.text;
      EXPECT_EQ(answer.text, "[]\n");
    }
    const Answer asked =
        Run({"register", "--blade", "none", "--scans", "none", "--method", "local", "--server", At(host)});
    EXPECT_EQ(asked.exit_code, 1) << asked.text;
    EXPECT_NE(asked.text.find("blades/none, want one that the plant knows"), std::string::npos) << asked.text;
  }
};

TEST_F(LocalPlantTest, IsReachedWhereItWasToldToListen) {
  const Answer refused = Up({"--listen", "10.255.255.1"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.text.find("--insecure"), std::string::npos) << refused.text;
  EXPECT_FALSE(fs::exists(data()));

  const Answer up = Up({"--listen", "127.0.0.2"});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  ExpectAllReachedAt("127.0.0.2");
  EXPECT_EQ(Run({"machine", "list", "--server", At("127.0.0.1")}).exit_code, 3);
  const auto status = nlohmann::json::parse(Run({"status", "--data", data(), "--json"}).text, nullptr, false);
  EXPECT_EQ(status["loopback_only"], true);
  EXPECT_EQ(status["services"][0]["address"], At("127.0.0.2"));

  const std::optional<std::string> outer = OuterAddress();
  if (!outer) GTEST_SKIP() << "SKIPPED from here on: this machine has no address but loopback ones";
  const Answer insecure = Up({"--listen", *outer, "--insecure"});
  ASSERT_EQ(insecure.exit_code, 0) << insecure.text;
  EXPECT_NE(insecure.text.find("warning: INSECURE"), std::string::npos) << insecure.text;
  ExpectAllReachedAt(*outer);
}

// The name that clients use is not one that the services could bind.
TEST_F(LocalPlantTest, IsAnnouncedByAnotherName) {
  const Answer up = Up({"--listen", "0.0.0.0", "--announce", "127.0.0.3", "--insecure"});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  ExpectAllReachedAt("127.0.0.2");
  const auto endpoints = nlohmann::json::parse(
      Run({"call", "PlantService/ListEndpoints", "--server", At("127.0.0.1")}).text, nullptr, false);
  ASSERT_EQ(endpoints["endpoints"].size(), 6u);
  for (const auto& endpoint : endpoints["endpoints"])
    EXPECT_EQ(endpoint["address"].get<std::string>().rfind("127.0.0.3:", 0), 0u) << endpoint;
}

}  // namespace
}  // namespace sixpoint::testing
