#include "services/runtime/retry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const absl::Status kAway = absl::UnavailableError("restarting");
const absl::Status kFull = absl::ResourceExhaustedError("full");

class RetryTest : public ::testing::Test {
 protected:
  Retry Limited(double away_s, double full_s) {
    RetryLimits limits;
    limits.away_s = away_s;
    limits.full_s = full_s;
    limits.say = [this](const std::string& text) { said_.push_back(text); };
    return Retry("ingest", limits);
  }
  std::vector<std::string> said_;
};

TEST_F(RetryTest, AnAnswerIsAnAnswer) {
  Retry retry = Limited(10, 10);
  EXPECT_FALSE(retry.TryAgain(absl::OkStatus(), nullptr));
  EXPECT_FALSE(retry.TryAgain(absl::InvalidArgumentError("no"), nullptr));
  EXPECT_FALSE(retry.TryAgain(absl::DeadlineExceededError("late"), nullptr));
  EXPECT_FALSE(retry.TryAgain(absl::InternalError("broken"), nullptr));
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(RetryTest, SaysWhenAServiceIsAwayAndWhenItIsBack) {
  Retry retry = Limited(10, 10);
  EXPECT_TRUE(retry.TryAgain(kAway, nullptr));
  EXPECT_TRUE(retry.TryAgain(absl::AbortedError("another came first"), nullptr));
  EXPECT_FALSE(retry.TryAgain(absl::OkStatus(), nullptr));
  EXPECT_THAT(said_, ElementsAre("ingest is away or full (restarting), trying again", HasSubstr("ingest is back")));
}

TEST_F(RetryTest, AwayAndFullHaveTheirOwnPatience) {
  Retry retry = Limited(0.05, 10);
  EXPECT_TRUE(retry.TryAgain(kFull, nullptr));
  EXPECT_FALSE(retry.TryAgain(kAway, nullptr));
  EXPECT_THAT(said_.back(), HasSubstr("did not answer"));
}

TEST_F(RetryTest, ProgressRenewsPatienceAndPauses) {
  Retry retry = Limited(0.15, 10);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(retry.TryAgain(kAway, nullptr)) << i;
    retry.Progressed();
  }
  EXPECT_TRUE(retry.TryAgain(kAway, nullptr));
  EXPECT_FALSE(retry.TryAgain(kAway, nullptr));  // the second pause would be one of 200 ms
}

TEST_F(RetryTest, NoAttemptBeginsAfterTheDeadline) {
  RetryLimits limits;
  limits.deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
  EXPECT_FALSE(Retry("ingest", limits).TryAgain(kAway, nullptr));
}

TEST_F(RetryTest, WaitsAsLongAsTheServerAsks) {
  const absl::Status full = FromGrpc(ToGrpc(kFull));
  EXPECT_EQ(RetryDelayOf(full), std::chrono::milliseconds(500));
  EXPECT_EQ(RetryDelayOf(kFull), std::chrono::milliseconds(0));
  EXPECT_FALSE(Limited(10, 0.4).TryAgain(full, nullptr));
  EXPECT_TRUE(Limited(10, 0.4).TryAgain(kFull, nullptr));
}

// Nobody listens on port 1; then there is no use in waiting longer than the pause.
TEST_F(RetryTest, WaitsForAConnectionNoLongerThanThePause) {
  const auto channel = grpc::CreateChannel("127.0.0.1:1", grpc::InsecureChannelCredentials());
  Retry retry = Limited(10, 10);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(retry.TryAgain(kAway, channel));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST(NewRequestId, IsAVersionFourUuid) {
  std::set<std::string> seen;
  for (int i = 0; i < 50; ++i) {
    const std::string id = NewRequestId();
    EXPECT_THAT(id, ::testing::MatchesRegex("[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
    EXPECT_TRUE(seen.insert(id).second);
  }
}

}  // namespace
}  // namespace sixpoint::runtime
