// Who finds a place, and who is told to come again.
#include "services/runtime/call_gate.h"

#include <gtest/gtest.h>

#include <vector>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

class CallGateTest : public ::testing::Test {
 protected:
  int EntersOf(const std::string& caller, int tries) {
    int entered = 0;
    for (int i = 0; i < tries; ++i) {
      if (auto place = gate_.Enter(caller, context_)) {
        places_.push_back(std::move(*place));
        ++entered;
      }
    }
    return entered;
  }
  OpenConnections connections_{ConnectionLimits()};
  CallGate gate_{CallLimits(), &connections_};
  grpc::ServerContext context_;
  std::vector<CallGate::Place> places_;
};

TEST_F(CallGateTest, OneCallerLeavesRoomForOthers) {
  EXPECT_EQ(EntersOf("users/jane", 100), 48);
  EXPECT_EQ(EntersOf("users/joe", 10), 10);
  EXPECT_EQ(EntersOf("machines/m1", 100), 38);  // 96 in all
  EXPECT_EQ(EntersOf("users/ann", 1), 0);
  places_.clear();
  EXPECT_EQ(EntersOf("users/jane", 100), 48);
}

// However many certificates they make for themselves.
TEST_F(CallGateTest, AllStrangersTogetherHaveAFewPlaces) {
  EXPECT_EQ(EntersOf("", 100), 8);
  EXPECT_EQ(EntersOf("users/jane", 100), 48);
  EXPECT_EQ(EntersOf("users/joe", 100), 40);
}

TEST_F(CallGateTest, TheRefusalSaysWhenToComeAgain) {
  const absl::Status refusal = FromGrpc(CallGate::Refusal());
  EXPECT_TRUE(absl::IsResourceExhausted(refusal));
  EXPECT_TRUE(HasReason(refusal, errors::v1::CALLS_FULL));
  EXPECT_NE(CallGate::Refusal().error_details().find("google.rpc.RetryInfo"), std::string::npos);
}

}  // namespace
}  // namespace sixpoint::runtime
