// `sixpoint up` where other hosts are to reach the plant: clients are told addresses that they can use, and nobody comes in without a
// certificate of its authority.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "services/runtime/call.h"
#include "services/runtime/credentials.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

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
  // What somebody who speaks no TLS, or shows no certificate, is told by the plant service.
  grpc::Status AskAt(const std::string& host, const std::shared_ptr<grpc::ChannelCredentials>& credentials) const {
    const auto channel = grpc::CreateChannel(At(host), credentials);
    plant::v1::ListMachinesResponse machines;
    return plant::v1::PlantService::NewStub(channel)->ListMachines(runtime::ContextFor(10).get(), {}, &machines);
  }
  void ExpectClosedToStrangersAt(const std::string& host) {
    EXPECT_EQ(AskAt(host, grpc::InsecureChannelCredentials()).error_code(), grpc::StatusCode::UNAVAILABLE);
    const auto nobody = runtime::ChannelCredentialsOf(data() + "/certificates");
    ASSERT_TRUE(nobody.ok()) << nobody.status();
    EXPECT_EQ(AskAt(host, *nobody).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  }
  // A folder of credentials, of `sixpoint certs issue` with these words.
  std::string Issue(const std::string& who, const std::vector<std::string>& more) {
    const std::string out = (folder_ / fs::path(who).filename()).string();
    std::vector<std::string> words = {"certs", "issue", who, "--folder", out, "--data", data()};
    words.insert(words.end(), more.begin(), more.end());
    const Answer issued = Run(words);
    EXPECT_EQ(issued.exit_code, 0) << issued.text;
    return out;
  }
  Answer RunAs(const std::string& identity, std::vector<std::string> words) {
    for (const std::string& word : {std::string("--identity"), identity, std::string("--server"), At("127.0.0.1")})
      words.push_back(word);
    return Run(words);
  }
  // By area, as `sixpoint status` reads them in the services' folders.
  std::map<std::string, std::string> Serials() {
    const auto status = nlohmann::json::parse(Run({"status", "--data", data(), "--json"}).text, nullptr, false);
    std::map<std::string, std::string> serials;
    for (const auto& service : status["services"]) serials[service["area"]] = service["certificate"]["serial"];
    return serials;
  }
  static std::string Example(const std::string& name) {
    const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
    return std::string(source == nullptr ? "." : source) + "/docs/examples/" + name;
  }
};

TEST_F(LocalPlantTest, IsSeededOnceAndAsksBeforeItIsSeededBesideRealThings) {
  ASSERT_EQ(Up().exit_code, 0);
  const Answer seeded = Run({"seed", "--data", data(), "--blades", "12", "--machines", "5", "--months", "4"});
  ASSERT_EQ(seeded.exit_code, 0) << seeded.text;
  EXPECT_THAT(seeded.text, HasSubstr("12, with 24 scans and 36 results"));
  const Answer shown = RunAs(data() + "/certificates/local", {"blade", "show", "SEED-1-00000003"});
  EXPECT_EQ(shown.exit_code, 0) << shown.text;
  EXPECT_THAT(shown.text, HasSubstr("CONFORM"));
  EXPECT_THAT(Run({"seed", "--data", data(), "--blades", "12"}).text, HasSubstr("sown in this plant already"));
  ASSERT_EQ(RunAs(data() + "/certificates/local", {"machine", "add", Example("machine.yaml")}).exit_code, 0);
  const Answer refused = Run({"seed", "--data", data(), "--blades", "12", "--seed", "2", "--json"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.text, HasSubstr("FAILED_PRECONDITION"));
  EXPECT_THAT(refused.text, HasSubstr("which was not seeded, want an empty plant"));
}

TEST_F(LocalPlantTest, IsReachedWhereItWasToldToListen) {
  const Answer refused = Up({"--listen", "10.255.255.1"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.text, HasSubstr("--listen: 10.255.255.1, want an address of this machine"));
  EXPECT_FALSE(fs::exists(data()));

  const Answer up = Up({"--listen", "127.0.0.2"});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  ExpectAllReachedAt("127.0.0.2");
  EXPECT_EQ(Run({"machine", "list", "--server", At("127.0.0.1")}).exit_code, 3);
  const auto status = nlohmann::json::parse(Run({"status", "--data", data(), "--json"}).text, nullptr, false);
  EXPECT_EQ(status["loopback_only"], true);
  EXPECT_EQ(status["services"][0]["address"], At("127.0.0.2"));
  ExpectClosedToStrangersAt("127.0.0.2");

  const std::optional<std::string> outer = OuterAddress();
  if (!outer) GTEST_SKIP() << "SKIPPED from here on: this machine has no address but loopback ones";
  const Answer off_loopback = Up({"--listen", *outer});
  ASSERT_EQ(off_loopback.exit_code, 0) << off_loopback.text;
  ExpectAllReachedAt(*outer);
  ExpectClosedToStrangersAt(*outer);
}

// The page and HTTP: plain on loopback, elsewhere over TLS by the plant's own certificate, by a proxy, or not at all.
TEST_F(LocalPlantTest, HasAGatewayAsItWasToldTo) {
  const auto fetch = [&](const std::string& url) {
    return ShellOutput("curl -s --noproxy '*' --max-time 10 --cacert " + data() + "/certificates/authority.pem " + url);
  };
  const auto url = [&] {
    return nlohmann::json::parse(Run({"status", "--data", data(), "--json"}).text, nullptr, false)["gateway"].value(
        "url", "");
  };
  const auto at = [&](const std::string& host) { return host + ":" + std::to_string(port_ + 80); };
  const fs::path page = folder_ / "page";
  fs::create_directories(page / "assets");
  std::ofstream(page / "index.html") << "<p>page";
  std::ofstream(page / "assets" / "a.js") << "'use strict'";
  ASSERT_EQ(Up({"--web", page.string()}).exit_code, 0);
  // Nobody is alarmed by a first start's log.
  EXPECT_THAT(ReadFile(data() + "/log/postgres.log"), Not(AnyOf(HasSubstr("FATAL"), HasSubstr("ERROR"))));
  EXPECT_EQ(url(), "http://" + at("127.0.0.1"));
  EXPECT_EQ(fetch(url()), "<p>page");
  EXPECT_EQ(fetch(url() + "/assets/a.js"), "'use strict'");
  EXPECT_EQ(fetch(url() + "/session"), "{}");
  // It is seen where the others are, by who may.
  const std::string metrics = fetch("https://127.0.0.1:" + std::to_string(port_ + 26) + "/metrics --cert " + data() +
                                    "/certificates/local/identity.pem");
  EXPECT_THAT(metrics, HasSubstr("sixpoint_build_info{area=\"gateway\""));
  EXPECT_THAT(fetch("https://127.0.0.1:" + std::to_string(port_ + 26) + "/metrics"), HasSubstr("CERTIFICATE_MISSING"));

  ASSERT_EQ(Up({"--listen", "127.0.0.1", "--http", "proxied", "--http-port", std::to_string(port_ + 90)}).exit_code, 0);
  EXPECT_THAT(ReadFile(data() + "/supervisord.conf"), HasSubstr(" --behind-proxy"));
  EXPECT_EQ(fetch(url() + "/session"), "{}");
  EXPECT_THAT(url(), HasSubstr(std::to_string(port_ + 90)));
  ASSERT_EQ(Up({"--http", "none"}).exit_code, 0);
  EXPECT_THAT(Run({"status", "--data", data()}).text, Not(HasSubstr("gateway")));
  EXPECT_THAT(Run({"doctor", "--data", data()}).text, HasSubstr("0 wrong"));

  const std::optional<std::string> outer = OuterAddress();
  if (!outer) GTEST_SKIP() << "SKIPPED from here on: this machine has no address but loopback ones";
  ASSERT_EQ(Up({"--http", "direct", "--http-port", std::to_string(port_ + 80), "--listen", *outer}).exit_code, 0);
  EXPECT_EQ(url(), "https://" + at(*outer));
  EXPECT_EQ(fetch(url() + "/session"), "{}");
  // The cookie of who comes so is for encrypted ways alone; a certificate made anew is shown at once.
  const std::string shown =
      "echo | openssl s_client -connect " + at(*outer) + " 2>/dev/null | openssl x509 -noout -serial";
  const std::string before = ShellOutput(shown);
  ASSERT_EQ(Run({"certs", "renew", "--all", "--data", data()}).exit_code, 0);
  for (int i = 0; i < 50 && ShellOutput(shown) == before; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_NE(ShellOutput(shown), before);
  EXPECT_EQ(fetch(url() + "/session"), "{}");
}

// The name that clients use is not one that the services could bind.
TEST_F(LocalPlantTest, IsAnnouncedByAnotherName) {
  const Answer up = Up({"--listen", "0.0.0.0", "--announce", "127.0.0.3"});
  ASSERT_EQ(up.exit_code, 0) << up.text;
  ExpectAllReachedAt("127.0.0.1");
  ExpectAllReachedAt("127.0.0.3");
  // By a name that its certificate does not hold it is not believed, and that is said.
  const Answer unnamed = Run({"machine", "list", "--server", At("127.0.0.2")});
  EXPECT_EQ(unnamed.exit_code, 3);
  EXPECT_THAT(unnamed.text, HasSubstr("next: the plant's certificate is for other hosts"));
  const auto endpoints = nlohmann::json::parse(
      Run({"call", "PlantService/ListEndpoints", "--server", At("127.0.0.1")}).text, nullptr, false);
  ASSERT_EQ(endpoints["endpoints"].size(), 6u);
  for (const auto& endpoint : endpoints["endpoints"])
    EXPECT_EQ(endpoint["address"].get<std::string>().rfind("127.0.0.3:", 0), 0u) << endpoint;
}

// A second user: what his roles let him, until his certificate is taken back.
TEST_F(LocalPlantTest, LetsInWhomItsAuthorityKnowsAsHisRolesSay) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string mes = Issue("users/mes", {"--role", "mes-reader"});
  EXPECT_EQ(RunAs(mes, {"machine", "list", "--json"}).text, "[]\n");
  const Answer denied = RunAs(mes, {"machine", "add", Example("machine.yaml")});
  EXPECT_EQ(denied.exit_code, 1);
  EXPECT_THAT(denied.text, HasSubstr("error: PERMISSION_DENIED (ROLE_MISSING)"));
  EXPECT_THAT(denied.text, HasSubstr("next: ask who runs the plant for a certificate with the role"));

  ASSERT_EQ(Run({"certs", "revoke", "users/mes", "--data", data()}).exit_code, 0);
  const Answer revoked = RunAs(mes, {"machine", "list"});
  EXPECT_EQ(revoked.exit_code, 1);
  EXPECT_THAT(revoked.text, HasSubstr("error: UNAUTHENTICATED (CERTIFICATE_REVOKED)"));
  EXPECT_THAT(revoked.text, HasSubstr("next: look at the certificate that you show: sixpoint certs show"));
  // The same folder with a new certificate counts again.
  EXPECT_EQ(RunAs(Issue("users/mes", {"--role", "mes-reader"}), {"machine", "list", "--json"}).text, "[]\n");

  const Answer nobody = RunAs((folder_ / "nowhere").string(), {"machine", "list"});
  EXPECT_EQ(nobody.exit_code, 1);
  EXPECT_THAT(nobody.text, HasSubstr("no certificate to show to the plant"));
}

// The machine knows nothing of the plant but its address.
TEST_F(LocalPlantTest, AFirstCertificateComesByACodeThatIsGoodOnce) {
  ASSERT_EQ(Up().exit_code, 0);
  const auto offered = nlohmann::json::parse(
      Run({"certs", "offer", "machines/m1", "--data", data(), "--server", At("127.0.0.1"), "--json"}).text, nullptr,
      false);
  ASSERT_TRUE(offered.is_object());
  const std::string code = offered["code"], out = (folder_ / "m1").string();
  const auto take = [&](const std::string& said, const std::string& folder) {
    return Run({"certs", "take", "--server", At("127.0.0.1"), "--code", said, "--folder", folder});
  };
  EXPECT_THAT(take("ABCD", out).text, HasSubstr("--code"));
  const Answer taken = take(code, out);
  ASSERT_EQ(taken.exit_code, 0) << taken.text;
  EXPECT_THAT(taken.text, HasSubstr("took the certificate of machines/m1"));
  EXPECT_EQ(RunAs(out, {"part", "list", "--json"}).text, "[]\n");
  EXPECT_THAT(RunAs(out, {"machine", "list"}).text, HasSubstr("ROLE_MISSING"));
  EXPECT_THAT(RunAs(out, {"certs", "fetch"}).text, HasSubstr("RENEWAL_NOT_OFFERED"));
  EXPECT_THAT(take(code, out).text, HasSubstr("--folder: " + out));
  const Answer again = take(code, out + "-again");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.text, HasSubstr("CODE_NOT_VALID"));
  EXPECT_THAT(again.text, HasSubstr("next: ask who runs the plant for another code"));
}

// What runs takes the new certificates by itself, and nobody's call fails for it.
TEST_F(LocalPlantTest, RenewsItsCertificatesWithoutARestart) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::map<std::string, std::string> before = Serials();
  const std::string running = Pid("all");
  EXPECT_THAT(Run({"certs", "renew", "--data", data()}).text, Not(HasSubstr("yes")));
  EXPECT_EQ(Serials(), before);

  std::atomic<bool> over{false};
  std::atomic<int> failed_count{0}, count{0};
  std::thread calls([&] {
    const auto credentials = runtime::ChannelCredentialsOf(data() + "/certificates/local").value();
    for (; !over; ++count)
      if (const grpc::Status asked = AskAt("127.0.0.1", credentials); !asked.ok() && ++failed_count == 1)
        std::printf("failed: %s\n", asked.error_message().c_str());
  });
  const Answer renewed = Run({"certs", "renew", "--all", "--data", data()});
  std::this_thread::sleep_for(std::chrono::seconds(4));  // services look for new files once a second
  over = true;
  calls.join();
  ASSERT_EQ(renewed.exit_code, 0) << renewed.text;
  EXPECT_EQ(failed_count, 0) << "of " << count;
  EXPECT_GT(count, 10);
  for (const auto& [area, serial] : Serials()) EXPECT_NE(serial, before.at(area)) << area;
  EXPECT_EQ(Pid("all"), running);

  // They show the new ones: with the old ones taken back the services still know each other.
  for (const auto& [area, serial] : before)
    EXPECT_EQ(Run({"certs", "revoke", serial, "--data", data()}).exit_code, 0) << area;
  ExpectAllReachedAt("127.0.0.1");
  EXPECT_EQ(Run({"status", "--data", data()}).exit_code, 0);
}

}  // namespace
}  // namespace sixpoint::testing
