// What one client of the sign-in by the identity provider may hold of what all share.
#include <gtest/gtest.h>

#include <future>
#include <vector>

#include "services/gateway/code_exchange.h"
#include "services/gateway/used_tickets.h"

namespace sixpoint::gateway {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using std::chrono::system_clock;
using Use = UsedTickets::Use;

constexpr char kAnn[] = "10.0.0.1", kBob[] = "10.0.0.2", kEve[] = "2001:db8::1", kEveToo[] = "2001:db8::9:2";

TEST(UsedTickets, ATicketCountsOnceAndIsForgottenWithItsTime) {
  UsedTickets used;
  const auto now = system_clock::now();
  const SignInTicket first = SignInTickets::New("/", now), second = SignInTickets::New("/", now);
  EXPECT_EQ(used.Take(first, kAnn, now), Use::kFirst);
  EXPECT_EQ(used.Take(second, kAnn, now), Use::kFirst);
  for (const auto later : {seconds(0), seconds(1), seconds(600)}) {
    EXPECT_EQ(used.Take(first, kAnn, now + later), Use::kAgain);
    EXPECT_EQ(used.Take(second, kBob, now + later), Use::kAgain);
  }
  // Who reads tickets refuses it from here on.
  EXPECT_EQ(used.Take(first, kAnn, now + seconds(601)), Use::kFirst);
}

TEST(UsedTickets, WhereThereIsNoRoomNothingIsForgottenBeforeItsTime) {
  UsedTickets used(/*most=*/6, /*most_of_peer=*/4);
  const auto now = system_clock::now();
  std::vector<SignInTicket> tickets;
  for (int i = 0; i < 8; ++i) tickets.push_back(SignInTickets::New("/", now + minutes(i)));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(used.Take(tickets[i], kAnn, now), Use::kFirst);
  EXPECT_EQ(used.Take(tickets[4], kAnn, now), Use::kFull);  // of one client
  EXPECT_EQ(used.Take(tickets[4], kBob, now), Use::kFirst);
  EXPECT_EQ(used.Take(tickets[5], kBob, now), Use::kFirst);
  EXPECT_EQ(used.Take(tickets[6], kBob, now), Use::kFull);  // of all
  for (int i = 0; i < 6; ++i) EXPECT_EQ(used.Take(tickets[i], kBob, now), Use::kAgain);
  // The oldest one's time is over: room for one, of whichever client.
  const auto later = now + SignInTickets::kLast + seconds(1);
  EXPECT_EQ(used.Take(tickets[6], kAnn, later), Use::kFirst);
  EXPECT_EQ(used.Take(tickets[7], kBob, later), Use::kFull);
  EXPECT_EQ(used.Take(tickets[1], kBob, later), Use::kAgain);
}

TEST(CodeWorkers, OneClientHasHalfOfThePlaces) {
  CodeWorkers workers;
  std::vector<std::shared_ptr<CodeWorkers::Place>> anns, eves;
  for (int i = 0; i < 4; ++i) {
    anns.push_back(workers.Take(kAnn));
    eves.push_back(workers.Take(i % 2 == 0 ? kEve : kEveToo));  // one network is one client
    ASSERT_NE(anns.back(), nullptr) << i;
    ASSERT_NE(eves.back(), nullptr) << i;
    if (i < 3) continue;
    EXPECT_EQ(workers.Take(kAnn), nullptr);
    EXPECT_EQ(workers.Take("::ffff:10.0.0.1"), nullptr);
    EXPECT_EQ(workers.Take(kBob), nullptr);  // of all
  }
  eves.pop_back();
  EXPECT_EQ(workers.Take(kAnn), nullptr);
  auto bobs = workers.Take(kBob);
  ASSERT_NE(bobs, nullptr);
  EXPECT_EQ(workers.Take(kEve), nullptr);
  // It is held while its job runs, and no longer.
  std::promise<void> go_on;
  workers.Begin(std::move(bobs), [&go_on] { go_on.get_future().wait(); });
  EXPECT_EQ(workers.Take(kEve), nullptr);
  go_on.set_value();
  std::shared_ptr<CodeWorkers::Place> free;
  for (const auto end = system_clock::now() + seconds(10); free == nullptr && system_clock::now() < end;)
    free = workers.Take(kEve);
  EXPECT_NE(free, nullptr);
  workers.Stop();
  anns.clear();
  EXPECT_EQ(workers.Take(kAnn), nullptr);
}

}  // namespace
}  // namespace sixpoint::gateway
