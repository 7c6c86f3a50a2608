// Whether a session was ended, as a service remembers it.
#include "services/runtime/session_ends.h"

#include <gtest/gtest.h>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

const std::chrono::steady_clock::time_point kBegin{};
const identity::TimePoint kSince = std::chrono::system_clock::from_time_t(1'800'000'000);

identity::Session Of(const std::string& who, microseconds later = microseconds(0)) {
  identity::Session session;
  session.person = identity::IdentityOf(who, {identity::Role::kEngineer}).value();
  session.since = kSince + later;
  return session;
}

TEST(SessionEnds, ASessionThatBeganBeforeItsEndIsOver) {
  SessionEnds ends;
  ends.Keep({{"users/jane", kSince}}, kBegin);
  EXPECT_TRUE(HasReason(ends.Check(Of("users/jane", microseconds(-1)), kBegin), errors::v1::SESSION_ENDED));
  EXPECT_TRUE(HasReason(ends.Check(Of("users/jane"), kBegin), errors::v1::SESSION_ENDED));
  EXPECT_TRUE(ends.Check(Of("users/jane", microseconds(1)), kBegin).ok());
  EXPECT_TRUE(ends.Check(Of("users/joe", microseconds(-1)), kBegin).ok());
  ends.Keep({}, kBegin);
  EXPECT_TRUE(ends.Check(Of("users/jane"), kBegin).ok());
}

// A service that has not heard for ten seconds, or not yet, does not know.
TEST(SessionEnds, WhatIsNotKnownDoesNotCount) {
  SessionEnds ends;
  EXPECT_TRUE(HasReason(ends.Check(Of("users/jane"), kBegin), errors::v1::SERVICE_NOT_READY));
  ends.Keep({}, kBegin);
  EXPECT_TRUE(ends.Check(Of("users/jane"), kBegin + SessionEnds::kKnownFor).ok());
  EXPECT_TRUE(HasReason(ends.Check(Of("users/jane"), kBegin + SessionEnds::kKnownFor + milliseconds(1)),
                        errors::v1::SERVICE_NOT_READY));
}

// A read that fails leaves what was known, until it is too old.
TEST(SessionEnds, ADatabaseThatIsAwayChangesNothing) {
  SessionEnds ends;
  const auto now = std::chrono::steady_clock::now();
  ends.Keep({{"users/jane", kSince}}, now);
  const auto nowhere = storage::Database::Open("host=/nowhere dbname=none", 1);
  ends.Read(nowhere.get(), std::chrono::steady_clock::now() + milliseconds(100));
  EXPECT_TRUE(HasReason(ends.Check(Of("users/jane"), now), errors::v1::SESSION_ENDED));
  EXPECT_TRUE(ends.Check(Of("users/joe"), now).ok());
}

}  // namespace
}  // namespace sixpoint::runtime
