// The provider's file, and its keys as they are fetched from a real https server.
#include "services/plant/identity_provider.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdio.h>

#include <algorithm>
#include <thread>

#include "services/plant/key_set_fetch.h"
#include "services/runtime/errors.h"
#include "tests/services/plant/provider_tokens.h"

namespace sixpoint::plant {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr char kBegin[] =
    "issuer: https://id.plant.example\nclient_id: sixpoint\nroles:\n  turbine-engineers: engineer\n";

TEST(IdentityProviderConfig, IsReadAsItStands) {
  const ProviderTokens files;
  const auto config =
      ReadIdentityProviderConfig(files.Config(
          std::string(kBegin) + "  turbine-readers: mes-reader\nkeys_url: https://id.plant.example/keys\n"
                                "name_claim: short_name\nroles_claim: roles\nca_file: /etc/ca.pem\n"
                                // The gateway's.
                                "authorization_url: https://id.plant.example/a\ntoken_url: https://id.plant.example/t\n"
                                "client_secret_file: /etc/secret\ndisplay_name: x\nscope: openid\nasks_again: false\n"
                                "persons:\n  f3a1: users/jane\n  00b7: users/joe\n"));
  ASSERT_TRUE(config.ok()) << config.status();
  EXPECT_EQ(config->policy.issuer, "https://id.plant.example");
  EXPECT_EQ(config->policy.client_id, "sixpoint");
  EXPECT_EQ(config->policy.name_claim, "short_name");
  EXPECT_EQ(config->policy.roles_claim, "roles");
  EXPECT_EQ(config->policy.roles.at("turbine-readers"), identity::Role::kMesReader);
  EXPECT_EQ(config->policy.roles.size(), 2u);
  EXPECT_EQ(config->keys_url, "https://id.plant.example/keys");
  EXPECT_EQ(config->ca_file, "/etc/ca.pem");
  const IdentityProvider provider(*config);
  EXPECT_EQ(provider.PersonOf("f3a1"), "users/jane");
  EXPECT_EQ(provider.PersonOf("00b7"), "users/joe");
  EXPECT_EQ(provider.PersonOf("F3A1"), std::nullopt);
}

TEST(IdentityProviderConfig, WhatIsOddIsRefusedByItsKey) {
  const ProviderTokens files;
  const std::string url = "keys_url: https://id.plant.example/keys\n";
  for (const auto& [lines, sentence] : std::vector<std::pair<std::string, std::string>>{
           {kBegin + url + "isuer: x\n", "isuer, want a key that"},
           {kBegin + url + "client_id: other\n", "client_id: twice"},
           {kBegin, "keys_url: empty, want it or keys_file"},
           {kBegin + url + "keys_file: /etc/keys.json\n", "want it or keys_file, and not both"},
           {std::string(kBegin) + "keys_url: http://id.plant.example/keys\n", "want https://"},
           {std::string(kBegin) + "keys_url: file:///etc/passwd\n", "want https://"},
           {"issuer: http://id\nclient_id: x\nkeys_file: k\nroles: {a: admin}\n", "issuer: http://id, want https://"},
           {"issuer: https://id\nclient_id: x\nkeys_file: k\n", "roles: empty"},
           {"issuer: https://id\nclient_id: x\nkeys_file: k\nroles: {a: service}\n", "roles.a: service, want engineer"},
           {"issuer: https://id\nclient_id: x\nkeys_file: k\nroles: {a: gateway}\n", "roles.a: gateway, want engineer"},
           {"issuer: https://id\nclient_id: x\nkeys_file: k\nroles: {a: boss}\n", "roles.a: boss"},
           {"issuer: https://id\nclient_id: x\nkeys_file: k\nroles: admin\n", "roles"},
           {kBegin + url + "persons: {a: jane}\n", "persons.a: jane, want users/NAME"},
           {kBegin + url + "persons: {a: machines/m1}\n", "persons.a: machines/m1, want users/NAME"},
           {kBegin + url + "persons: {a: users/jane, b: users/jane}\n", "persons.b: users/jane, another subject's too"},
           {kBegin + url + "persons: {a: users/jane, a: users/joe}\n", "persons: a twice"},
           {kBegin + url + "persons: users/jane\n", "persons"},
           {"issuer: [https://id]\nclient_id: x\n", "issuer: not one value"},
           {"[]", "want keys and values"},
           {"issuer: {x\n", "want YAML"}}) {
    const absl::Status refused = ReadIdentityProviderConfig(files.Config(lines)).status();
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << lines;
    EXPECT_THAT(std::string(refused.message()), HasSubstr(sentence)) << lines;
  }
  EXPECT_TRUE(absl::IsInvalidArgument(ReadIdentityProviderConfig("/nowhere").status()));
}

class IdentityProviderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
    ASSERT_TRUE(files_.Make());
    server_ =
        popen((ProviderTokens::Source("tests/services/plant/identity_provider_server") + " " + files_.folder().string())
                  .c_str(),
              "w");
    ASSERT_NE(server_, nullptr);
    const auto end = std::chrono::steady_clock::now() + seconds(30);
    while (!fs::exists(files_.folder() / "port") && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(fs::exists(files_.folder() / "port"));
  }
  void TearDown() override {
    if (server_ != nullptr) pclose(server_);
  }

  std::string Url(const std::string& path) const { return "https://localhost:" + files_.Text("port") + path; }
  std::string CaFile() const { return (files_.folder() / "ca.pem").string(); }
  std::ptrdiff_t AskedCount() const {
    const std::string asked = files_.Text("asked");
    return std::count(asked.begin(), asked.end(), '\n');
  }
  IdentityProvider Provider(const std::string& path = "/keys", const std::string& ca_file = "own") {
    IdentityProviderConfig config;
    config.policy.issuer = "https://id.plant.example";
    config.policy.client_id = "sixpoint";
    config.policy.roles = {{"turbine-engineers", identity::Role::kEngineer}};
    config.keys_url = Url(path);
    config.ca_file = ca_file == "own" ? CaFile() : ca_file;
    return IdentityProvider(config, [this] { return now_; });
  }

  const ProviderTokens files_;
  FILE* server_ = nullptr;
  std::chrono::steady_clock::time_point now_ = std::chrono::steady_clock::now();
};

TEST_F(IdentityProviderTest, KeysAreFetchedOnceAndKept) {
  IdentityProvider provider = Provider();
  for (const char* name : {"good.rs256", "good.es256", "good.ps256", "good.rs256"}) {
    const auto person = provider.Judge(files_.Text(name), "n-1");
    EXPECT_TRUE(person.ok()) << name << ": " << person.status();
  }
  EXPECT_EQ(AskedCount(), 1);
  now_ += seconds(3601);
  EXPECT_TRUE(provider.Judge(files_.Text("good.rs256"), "n-1").ok());
  EXPECT_EQ(AskedCount(), 2);
}

TEST_F(IdentityProviderTest, OfAnUnknownKeyTheyAreFetchedAgainOnceAMinute) {
  fs::rename(files_.folder() / "keys.json", files_.folder() / "all.json");
  fs::copy(files_.folder() / "one_key.json", files_.folder() / "keys.json");
  IdentityProvider provider = Provider();
  EXPECT_TRUE(provider.Judge(files_.Text("good.rs256"), "n-1").ok());
  fs::rename(files_.folder() / "all.json", files_.folder() / "keys.json");  // the provider has new ones
  for (int i = 0; i < 20; ++i)
    EXPECT_TRUE(absl::IsUnauthenticated(provider.Judge(files_.Text("good.es256"), "n-1").status()));
  EXPECT_EQ(AskedCount(), 1);
  now_ += seconds(61);
  EXPECT_TRUE(provider.Judge(files_.Text("good.es256"), "n-1").ok());
  EXPECT_EQ(AskedCount(), 2);
  for (int i = 0; i < 20; ++i)
    EXPECT_TRUE(absl::IsUnauthenticated(provider.Judge(files_.Text("bad.kid_sql"), "n-1").status()));
  EXPECT_EQ(AskedCount(), 2);
}

// Who is not the provider, by its certificate, is not believed, and neither is what it sends elsewhere or too much of.
TEST_F(IdentityProviderTest, KeysComeFromTheProviderAloneAndAreSmall) {
  for (const auto& [path, ca_file] :
       std::vector<std::pair<std::string, std::string>>{{"/keys", "/etc/ssl/certs/ca-certificates.crt"},
                                                        {"/keys", "/nowhere"},
                                                        {"/elsewhere", "own"},
                                                        {"/huge", "own"}}) {
    IdentityProvider provider = Provider(path, ca_file);
    const absl::Status away = provider.Judge(files_.Text("good.rs256"), "n-1").status();
    EXPECT_TRUE(runtime::HasReason(away, errors::v1::IDENTITY_PROVIDER_AWAY)) << path << ca_file << away;
  }
  const std::string by_number =
      "https://127.0.0.1:" + files_.Text("port") + "/keys";  // its certificate names another host
  EXPECT_TRUE(absl::IsUnavailable(FetchByHttps(by_number, CaFile(), 1 << 20, seconds(5)).status()));
  for (const std::string url : {"http://localhost:1/", "file:///etc/hostname", "gopher://localhost/", ""})
    EXPECT_TRUE(absl::IsUnavailable(FetchByHttps(url, CaFile(), 1 << 20, seconds(5)).status())) << url;
}

// Keys that were had stay for a day where the provider is away; where none were had, it is asked again soon.
TEST_F(IdentityProviderTest, AProviderThatIsAwayLocksNobodyOutAtOnce) {
  IdentityProvider provider = Provider(), never = Provider("/huge");
  EXPECT_TRUE(provider.Judge(files_.Text("good.rs256"), "n-1").ok());
  fs::remove(files_.folder() / "keys.json");
  std::ofstream(files_.folder() / "keys.json") << "nothing";
  now_ += seconds(2 * 3600);
  EXPECT_TRUE(provider.Judge(files_.Text("good.rs256"), "n-1").ok());
  now_ += seconds(24 * 3600);
  EXPECT_TRUE(absl::IsUnavailable(provider.Judge(files_.Text("good.rs256"), "n-1").status()));
  const auto before = AskedCount();
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(absl::IsUnavailable(never.Judge(files_.Text("good.rs256"), "n-1").status()));
  EXPECT_EQ(AskedCount(), before + 1);
  now_ += seconds(6);
  EXPECT_TRUE(absl::IsUnavailable(never.Judge(files_.Text("good.rs256"), "n-1").status()));
  EXPECT_EQ(AskedCount(), before + 2);
}

}  // namespace
}  // namespace sixpoint::plant
