#include "cli/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/app.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

class ConfigTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / "sixpoint_config_test";
    std::filesystem::create_directories(folder_ / "sixpoint");
    setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);
    for (const char* name : {"SIXPOINT_CONFIG", "SIXPOINT_SERVER", "SIXPOINT_IDENTITY"}) unsetenv(name);
  }
  void TearDown() override {
    std::filesystem::remove_all(folder_);
    for (const char* name : {"XDG_CONFIG_HOME", "SIXPOINT_CONFIG", "SIXPOINT_SERVER", "SIXPOINT_IDENTITY"})
      unsetenv(name);
  }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  // What a command line ends up with.
  static std::string ValueOf(std::string Session::*value, std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "sixpoint");
    const int count = static_cast<int>(arguments.size());
    Session session;
    EXPECT_TRUE(ApplyConfig(ConfigFileOf(count, arguments.data()), &session).ok());
    CommandLine line;
    AddCommands(line.root(), &session);
    EXPECT_FALSE(line.Parse(count, arguments.data()).has_value());
    return session.*value;
  }
  static std::string ServerOf(const std::vector<const char*>& arguments) {
    return ValueOf(&Session::server, arguments);
  }
  static std::string IdentityOf(const std::vector<const char*>& arguments) {
    return ValueOf(&Session::identity, arguments);
  }

  std::filesystem::path folder_;
};

TEST_F(ConfigTest, ReadsWhatItHolds) {
  Session session;
  const absl::Status status = ApplyConfig(
      Write("c.yaml", "server: 10.0.0.5:7400\ndata: /srv/plant\nidentity: /srv/jane\njson: true\ndeadline_s: 900\n"),
      &session);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(session.server, "10.0.0.5:7400");
  EXPECT_EQ(session.data, "/srv/plant");
  EXPECT_EQ(session.identity, "/srv/jane");
  EXPECT_TRUE(session.json);
  EXPECT_EQ(session.deadline_s, 900);
}

TEST_F(ConfigTest, StandsBehindTheCommandLineAndTheEnvironment) {
  EXPECT_EQ(ServerOf({"status"}), "127.0.0.1:7400");
  Write("sixpoint/config.yaml", "server: usual:1\n");
  EXPECT_EQ(ServerOf({"status"}), "usual:1");
  const std::string other = Write("other.yaml", "server: other:1\n");
  setenv("SIXPOINT_CONFIG", other.c_str(), 1);
  EXPECT_EQ(ServerOf({"status"}), "other:1");
  const std::string named = Write("named.yaml", "server: named:1\n");
  EXPECT_EQ(ServerOf({"status", "--config", named.c_str()}), "named:1");
  EXPECT_EQ(ServerOf({("--config=" + named).c_str(), "status"}), "named:1");
  setenv("SIXPOINT_SERVER", "environment:1", 1);
  EXPECT_EQ(ServerOf({"status"}), "environment:1");
  EXPECT_EQ(ServerOf({"status", "--server", "given:1"}), "given:1");
}

TEST_F(ConfigTest, SaysWhoseCertificateIsShown) {
  EXPECT_EQ(IdentityOf({"status"}), "");
  Write("sixpoint/config.yaml", "identity: /usual\n");
  EXPECT_EQ(IdentityOf({"status"}), "/usual");
  setenv("SIXPOINT_IDENTITY", "/environment", 1);
  EXPECT_EQ(IdentityOf({"status"}), "/environment");
  EXPECT_EQ(IdentityOf({"status", "--identity", "/given"}), "/given");
}

TEST_F(ConfigTest, RefusesWhatItDoesNotKnow) {
  Session session;
  const std::string file = Write("c.yaml", "servr: a:1\njson: perhaps\ndeadline_s: 0\n");
  const std::string message(ApplyConfig(file, &session).message());
  for (const char* part : {file.c_str(), "servr", "json", "deadline_s"}) EXPECT_THAT(message, HasSubstr(part));
  EXPECT_EQ(ApplyConfig("/nowhere/c.yaml", &session).code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace sixpoint::cli
