#include "cli/batch_document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(BatchFromDocument, ReadsAFile) {
  const auto batch = BatchFromDocument(nlohmann::json::parse(R"({"registrations": [
    {"blade": "SN-1", "scans": ["a", "scans/b"], "method": "six-point"},
    {"blade": "SN-2", "scans": ["c"], "method": "local", "axis_tables": true}]})"));
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->requests_size(), 2);
  EXPECT_EQ(batch->requests(0).blade(), "blades/SN-1");
  EXPECT_THAT(batch->requests(0).scans(), ElementsAre("scans/a", "scans/b"));
  EXPECT_EQ(batch->requests(0).method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_FALSE(batch->requests(0).apply_axis_tables());
  EXPECT_TRUE(batch->requests(1).apply_axis_tables());

  const auto wrong = BatchFromDocument(nlohmann::json::parse(R"({"registrations": [
    {"blade": "SN-1", "scans": [], "method": "guess", "tables": true}]})"));
  const std::string message(wrong.status().message());
  EXPECT_THAT(message, HasSubstr("registrations[0].scans"));
  EXPECT_THAT(message, HasSubstr("registrations[0].method: \"guess\", want one of local"));
  EXPECT_THAT(message, HasSubstr("tables"));
  EXPECT_FALSE(BatchFromDocument(nlohmann::json::parse(R"({"registrations": []})")).ok());
}

TEST(BatchFromDocument, ReadsHowToFitWithDefaults) {
  const auto batch = BatchFromDocument(nlohmann::json::parse(R"({
    "defaults": {"method": "best-fit", "not_in": ["ball:0,0,0:5"], "coarse": true, "weights": [1, 0.5]},
    "registrations": [
      {"blade": "SN-1", "scans": ["a", "b"]},
      {"blade": "SN-2", "scans": ["c"], "method": "local", "in": ["holes:G1:3", "box:0,0,0:1,1,1"], "not_in": ["ball:1,0,0:2"],
       "coarse": false, "weights": [2], "free": ["turn-x", "shift-z"]},
      {"blade": "SN-3", "scans": ["d"], "method": "allowance", "least_stock_mm": -0.2, "greatest_stock_mm": 4,
       "patch_mm": 2, "least_points": 9}]})"));
  ASSERT_TRUE(batch.ok()) << batch.status();
  const auto& first = batch->requests(0);
  EXPECT_EQ(first.method(), registration::v1::METHOD_BEST_FIT);
  EXPECT_TRUE(first.options().coarse_start());
  EXPECT_EQ(first.options().regions_out(0).ball().radius_mm(), 5);
  EXPECT_THAT(first.options().scan_weights(), ElementsAre(1, 0.5));
  const auto& second = batch->requests(1);
  EXPECT_EQ(second.method(), registration::v1::METHOD_LOCAL);
  EXPECT_FALSE(second.options().coarse_start());
  EXPECT_EQ(second.options().regions_in(0).hole_group().group(), "G1");
  ASSERT_EQ(second.options().regions_out_size(), 1);
  EXPECT_EQ(second.options().regions_out(0).ball().radius_mm(), 2);
  EXPECT_THAT(second.options().scan_weights(), ElementsAre(2));
  EXPECT_THAT(second.options().degrees_of_freedom(),
              ElementsAre(registration::v1::FREEDOM_TURN_X, registration::v1::FREEDOM_SHIFT_Z));
  const auto& allowance = batch->requests(2).options().allowance();
  EXPECT_EQ(allowance.least_stock_mm(), -0.2);
  EXPECT_EQ(allowance.greatest_stock_mm(), 4);
  EXPECT_EQ(allowance.patch_mm(), 2);
  EXPECT_EQ(allowance.least_points(), 9);

  const auto wrong = BatchFromDocument(nlohmann::json::parse(R"({
    "defaults": {"weights": [0], "scans": ["a"]},
    "registrations": [{"blade": "SN-1", "scans": ["a"], "free": ["turn-w"], "in": ["cone:1"], "coarse": 1, "guess": 2}]})"));
  const std::string message(wrong.status().message());
  for (const char* line : {"defaults.weights[0]: 0, want", "defaults.scans", "registrations[0].method",
                           "registrations[0].free[0]: \"turn-w\", want one of turn-x",
                           "registrations[0].in[0]: \"cone:1\", want box:X,Y,Z", "registrations[0].coarse: 1, want",
                           "registrations[0].guess"})
    EXPECT_THAT(message, HasSubstr(line));
}

}  // namespace
}  // namespace sixpoint::cli
