#include "cli/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

std::string MessageOf(const Problems& problems) { return std::string(problems.ToStatus().message()); }

TEST(Field, ReadsWhatIsThere) {
  const nlohmann::json json = {{"a", 1.5}, {"b", {1, 2, 3}}, {"c", "text"}, {"d", true}, {"e", 7}};
  Problems problems(false);
  const Field root(&json, "", &problems);
  EXPECT_EQ(root.At("a").Number(), 1.5);
  EXPECT_EQ(root.At("b").Vector3(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(root.At("c").Text(), "text");
  EXPECT_TRUE(root.At("d").Flag());
  EXPECT_EQ(root.At("e").Whole(0, 10), 7);
  EXPECT_TRUE(problems.ToStatus().ok());
}

TEST(Field, NamesAMissingFieldByItsPathOnceAndNothingBelowIt) {
  const nlohmann::json json = {{"machine", {{"id", "m"}}}};
  Problems problems(false);
  Field(&json, "", &problems).At("machine").At("sensor").At("noise_um").Positive();
  EXPECT_EQ(MessageOf(problems), "machine.sensor: missing, want a value");
}

TEST(Field, NamesValueAndWhatWasWanted) {
  const nlohmann::json json = {{"groups", {{{"depth_mm", -1}}, {{"depth_mm", "deep"}}}}};
  Problems problems(false);
  for (const Field& group : Field(&json, "", &problems).At("groups").Items(1, 5)) group.At("depth_mm").Positive();
  EXPECT_THAT(MessageOf(problems), HasSubstr("groups[0].depth_mm: -1, want a number > 0"));
  EXPECT_THAT(MessageOf(problems), HasSubstr("groups[1].depth_mm: \"deep\", want a number > 0"));
}

TEST(Field, RefusesUnknownKeysOnlyInStrictDocuments) {
  const nlohmann::json json = {{"id", "m"}, {"sefty_envelope", 1}};
  Problems lenient(false), strict(true);
  Field(&json, "", &lenient).OnlyKeys({"id", "safety_envelope"});
  Field(&json, "", &strict).OnlyKeys({"id", "safety_envelope"});
  EXPECT_TRUE(lenient.empty());
  EXPECT_EQ(MessageOf(strict), "sefty_envelope: unknown, want one of id, safety_envelope");
}

TEST(Field, RefusesWhatIsNoDirectionNoRigidTransformNoPathInside) {
  const nlohmann::json json = {{"direction", {1, 0, 0.01}},
                               {"mirror", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}}},
                               {"short", {{1, 0, 0, 0}, {0, 1, 0, 0}}},
                               {"climbing", "a/../../b"},
                               {"absolute", "/etc/passwd"},
                               {"id", "a b"}};
  Problems problems(false);
  const Field root(&json, "", &problems);
  root.At("direction").Direction();
  root.At("mirror").RigidTransform();
  root.At("short").RigidTransform();
  EXPECT_EQ(root.At("climbing").PathInside(), "");
  EXPECT_EQ(root.At("absolute").PathInside(), "");
  root.At("id").Id();
  for (const char* name : {"direction", "mirror", "short", "climbing", "absolute", "id"}) {
    EXPECT_THAT(MessageOf(problems), HasSubstr(std::string(name) + ": ")) << name;
  }
}

TEST(Field, RefusesWholeNumbersThatDoNotFit) {
  const nlohmann::json json = {{"huge", std::uint64_t{18446744073709551615u}}, {"half", 0.5}};
  Problems problems(false);
  Field(&json, "", &problems).At("huge").Whole(-10, 10);
  Field(&json, "", &problems).At("half").Whole(-10, 10);
  EXPECT_THAT(MessageOf(problems), HasSubstr("huge: 18446744073709551615"));
  EXPECT_THAT(MessageOf(problems), HasSubstr("half: 0.5"));
}

TEST(ParseJson, RefusesNumbersThatDoublesCannotHold) {
  EXPECT_FALSE(ParseJson("f", R"({"x": 1e999})").ok());
  EXPECT_FALSE(ParseJson("f", R"({"x": NaN})").ok());
  EXPECT_FALSE(ParseJson("f", R"({"x": 1)").ok());
}

TEST(ParseYaml, KeepsQuotedNumbersAndLeadingZerosAsText) {
  const auto json = ParseYaml("f", "a: 007\nb: '7'\nc: 7\nd: -1.5e-3\ne: yes\nf: true\n");
  ASSERT_TRUE(json.ok()) << json.status();
  EXPECT_EQ((*json)["a"], "007");
  EXPECT_EQ((*json)["b"], "7");
  EXPECT_EQ((*json)["c"], 7);
  EXPECT_EQ((*json)["d"], -1.5e-3);
  EXPECT_EQ((*json)["e"], "yes");
  EXPECT_EQ((*json)["f"], true);
}

TEST(ParseYaml, RefusesAliasesThatGrow) {
  std::string text = "a0: &a0 [x,x,x,x,x,x,x,x,x,x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) text += (k > 0 ? "," : "") + before;
    text += "]\n";
  }
  const auto json = ParseYaml("bomb.yaml", text);
  ASSERT_FALSE(json.ok());
  EXPECT_THAT(std::string(json.status().message()), HasSubstr("longer than"));
}

TEST(ParseYaml, RefusesAKeyGivenTwiceAndBrokenText) {
  EXPECT_FALSE(ParseYaml("f", "a: 1\na: 2\n").ok());
  EXPECT_FALSE(ParseYaml("f", "a: [1, 2\n").ok());
}

TEST(WriteFile, ReplacesWholeAndLeavesNothingWhereItCannot) {
  const std::string path = ::testing::TempDir() + "/sixpoint_document_test.txt";
  ASSERT_TRUE(WriteFile(path, "one").ok());
  ASSERT_TRUE(WriteFile(path, "two").ok());
  EXPECT_EQ(*ReadFile(path, 10), "two");
  EXPECT_FALSE(ReadFile(path, 2).ok());
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  EXPECT_FALSE(WriteFile(::testing::TempDir() + "/no/such/folder/x", "x").ok());
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace sixpoint::cli
