#include "cli/plant_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

std::string RefusalOfSettings(const std::string& text) {
  return std::string(ParseSettings("plant.json", text).status().message());
}

TEST(PlantSettings, AreReadAsTheyWereWritten) {
  PlantSettings settings;
  settings.base_port = 8400;
  settings.metrics_port = 9100;
  settings.listen = "0.0.0.0";
  settings.announce = "plant.example";
  settings.blob_store = "s3:///etc/sixpoint/s3.yaml";
  settings.oidc = "/etc/sixpoint/oidc.yaml";
  const auto read = ParseSettings("plant.json", SettingsText(settings));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->base_port, 8400);
  EXPECT_EQ(read->MetricsPort(), 9100);
  EXPECT_EQ(read->listen, "0.0.0.0");
  EXPECT_EQ(read->announce, "plant.example");
  EXPECT_EQ(read->blob_store, "s3:///etc/sixpoint/s3.yaml");
  EXPECT_EQ(read->oidc, "/etc/sixpoint/oidc.yaml");
}

TEST(PlantSettings, OfAnEmptyFileAreTheUsualOnes) {
  const auto read = ParseSettings("plant.json", "{}");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(SettingsText(*read), SettingsText(PlantSettings()));
}

TEST(PlantSettings, AreHeldAgainstWhatTheCommandLineMaySay) {
  EXPECT_THAT(RefusalOfSettings("[]"), HasSubstr("plant.json: "));
  EXPECT_THAT(RefusalOfSettings("{\"base_port\": 65001}"),
              HasSubstr("base_port: 65001, want a whole number from 1024 to 65000"));
  EXPECT_THAT(RefusalOfSettings("{\"base_port\": \"7400\"}"), HasSubstr("want a whole number"));
  EXPECT_THAT(RefusalOfSettings("{\"listen\": \"0.0.0.0\"}"), HasSubstr("--listen: 0.0.0.0, want --announce too"));
  EXPECT_THAT(RefusalOfSettings("{\"listen\": \"127.0.0.1 --x\"}"), HasSubstr("want an IP address or a host name"));
  EXPECT_THAT(RefusalOfSettings("{\"colour\": \"green\"}"), HasSubstr("colour: unknown, want one of base_port"));
}

TEST(PlantSettings, SayWhereAPlantIsSeen) {
  EXPECT_EQ(ParseSettings("plant.json", "{\"base_port\": 8400}")->MetricsPort(), 8420);
  EXPECT_EQ(ParseSettings("plant.json", "{\"metrics_port\": 0}")->MetricsPort(), 0);
  for (const int own : {7395, 7400, 7405})
    EXPECT_THAT(RefusalOfSettings("{\"metrics_port\": " + std::to_string(own) + "}"),
                HasSubstr("--metrics-port: " + std::to_string(own) + ", want 0 for none, or the first of seven ports"));
  for (const int beside : {7393, 7406})
    EXPECT_EQ(RefusalOfSettings("{\"metrics_port\": " + std::to_string(beside) + "}"), "");
  EXPECT_THAT(RefusalOfSettings("{\"metrics_port\": 80}"), HasSubstr("--metrics-port: 80, want 0 for none"));
  EXPECT_THAT(RefusalOfSettings("{\"metrics_port\": 65001}"),
              HasSubstr("metrics_port: 65001, want a whole number from 0 to"));
}

TEST(PlantSettings, OfAReleaseBeforeMutualTlsAreRead) {
  const auto read = ParseSettings("plant.json", "{\"listen\": \"10.1.2.3\", \"insecure\": true}");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->listen, "10.1.2.3");
  EXPECT_THAT(SettingsText(*read), ::testing::Not(HasSubstr("insecure")));
}

// It becomes words of supervisord's configuration, where a blank, a % or a new line would be more than a path.
TEST(PlantSettings, ABlobStoreIsOneWord) {
  for (const char* oidc : {"relative.yaml", "/a b", "/a%(x)s", "/a;b"}) {
    PlantSettings settings;
    settings.oidc = oidc;
    EXPECT_THAT(std::string(CheckSettings(settings).message()), HasSubstr("--oidc: " + std::string(oidc)));
  }
  for (const char* blob_store : {"s3://relative.yaml", "s3:///a b", "s3:///a%(x)s", "s3:///a;b", "s3://", "disk"}) {
    PlantSettings settings;
    settings.blob_store = blob_store;
    EXPECT_THAT(std::string(CheckSettings(settings).message()),
                HasSubstr(std::string(blob_store) + ", want postgresql"));
  }
}

}  // namespace
}  // namespace sixpoint::cli
