#include "refusal/refusal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Refuse, NamesFieldValueAndWanted) {
  const absl::Status refusal = Refuse("scan.profile_pitch_mm", -0.025, "> 0");
  EXPECT_EQ(refusal.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(refusal.message(), "scan.profile_pitch_mm: -0.025, want > 0");
  EXPECT_EQ(Refuse("a", std::nan(""), "a number").message(), "a: NaN, want a number");
  EXPECT_EQ(Refuse("a", "", "a name").message(), "a: empty, want a name");
}

TEST(Refuse, DoesNotRepeatAHostileValue) {
  const std::string message(Refuse("name", std::string(100000, 'x') + "\n{\"level\"", "a name").message());
  EXPECT_LT(message.size(), 200u);
  EXPECT_THAT(std::string(Refuse("name", "a\nb\x1b[31m", "a name").message()), HasSubstr("a?b?[31m"));
}

TEST(Refuse, DoesNotCutACharacterInTwo) {
  const std::string value = std::string(116, 'x') + "\xc3\xa4xxx";  // the cut would come between the two bytes
  const absl::Status refusal = Refuse("name", value, "a name");
  EXPECT_EQ(ViolationsOf(refusal).front().value, std::string(116, 'x') + "...");
  EXPECT_EQ(Under("", refusal), refusal);
}

TEST(ViolationsOf, GivesBackWhatWasRefusedWhateverItsTextLooksLike) {
  const Violation odd{"nc_template", "line 3: \"G0: X1, want Y\"", "one marker: a block, want no more"};
  EXPECT_THAT(ViolationsOf(Refuse({odd, {"b", "2", "1"}})), ElementsAre(odd, Violation{"b", "2", "1"}));
  EXPECT_EQ(Refuse({{"a", "1", "2"}, {"b", "2", "1"}}).message(), "a: 1, want 2; b: 2, want 1");
}

TEST(ViolationsOf, IsEmptyForWhatIsNoRefusal) {
  EXPECT_THAT(ViolationsOf(absl::OkStatus()), IsEmpty());
  EXPECT_THAT(ViolationsOf(absl::InvalidArgumentError("a: 1, want 2")), IsEmpty());
}

TEST(Under, PutsThePrefixBeforeEveryField) {
  const absl::Status kernel = Refuse({{"six_points", "5 points", "6"}, {"name", "empty", "a name"}});
  const absl::Status refusal = Under("part.", kernel);
  EXPECT_EQ(refusal.message(), "part.six_points: 5 points, want 6; part.name: empty, want a name");
  EXPECT_THAT(ViolationsOf(refusal),
              ElementsAre(Violation{"part.six_points", "5 points", "6"}, Violation{"part.name", "empty", "a name"}));
}

TEST(Under, LeavesEveryOtherStatusAsItIs) {
  EXPECT_TRUE(Under("part.", absl::OkStatus()).ok());
  EXPECT_EQ(Under("part.", absl::NotFoundError("gone")), absl::NotFoundError("gone"));
}

TEST(Refusals, JoinInTheirOrder) {
  Refusals refusals;
  EXPECT_TRUE(refusals.status().ok());
  refusals.Add(Refuse("a", 1, "2")).Add(absl::OkStatus()).Add(Under("b.", Refuse("c", 3, "4")));
  EXPECT_EQ(refusals.status().message(), "a: 1, want 2; b.c: 3, want 4");
}

TEST(Refusals, AreAHundredAtMost) {
  Refusals refusals;
  for (int i = 0; i < 100'000; ++i) refusals.Add(Refuse("f" + std::to_string(i), "1", "2"));
  const std::vector<Violation> told = ViolationsOf(refusals.status());
  ASSERT_EQ(told.size(), 100u);
  EXPECT_EQ(told.back().field, "f99");
}

TEST(Refusals, AreOutweighedByAFailure) {
  Refusals refusals;
  refusals.Add(Refuse("a", 1, "2")).Add(absl::UnavailableError("away")).Add(absl::InternalError("broken"));
  EXPECT_EQ(refusals.status(), absl::UnavailableError("away"));
}

TEST(ViolationLines, CrossAPipeAndBack) {
  const absl::Status refusal = Refuse({{"cad.solid", "2 of them\n", "1"}, {"cad.unit_mm", "", "> 0"}});
  EXPECT_THAT(ViolationsOfLines(ViolationLines(ViolationsOf(refusal))),
              ElementsAre(Violation{"cad.solid", "2 of them?", "1"}, Violation{"cad.unit_mm", "empty", "> 0"}));
}

TEST(ViolationLines, OfAnythingElseAreNone) {
  EXPECT_THAT(ViolationsOfLines(""), IsEmpty());
  EXPECT_THAT(ViolationsOfLines("killed by signal 9\n"), IsEmpty());
  EXPECT_THAT(ViolationsOfLines("a\nb\nc"), IsEmpty());
}

}  // namespace
}  // namespace sixpoint
