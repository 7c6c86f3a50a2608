// What a browser carries while it is at the identity provider.
#include "services/gateway/sign_in_ticket.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

namespace sixpoint::gateway {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using std::chrono::system_clock;

TEST(SignInTicket, HoldsForTenMinutesAtTheGatewayThatMadeIt) {
  const SignInTickets tickets, others;
  const auto now = system_clock::now();
  const SignInTicket ticket = SignInTickets::New("/blades?serial=SN-1&x=ü.%2F", now);
  const std::string text = tickets.TextOf(ticket);
  EXPECT_EQ(text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_."), text.npos);
  for (const auto& [later, holds] : {std::pair{seconds(0), true}, {seconds(599), true}, {seconds(601), false}}) {
    const auto read = tickets.Read(text, now + later);
    ASSERT_EQ(read.has_value(), holds) << later.count();
    if (!holds) continue;
    EXPECT_EQ(read->return_path, ticket.return_path);
    EXPECT_EQ(tickets.SecretsOf(*read).state, tickets.SecretsOf(ticket).state);
  }
  EXPECT_FALSE(tickets.Read(text, now - minutes(20)));  // a clock that was set back
  EXPECT_FALSE(others.Read(text, now));
  EXPECT_NE(others.SecretsOf(ticket).state, tickets.SecretsOf(ticket).state);
}

TEST(SignInTicket, EachLetterOfItCounts) {
  const SignInTickets tickets;
  const auto now = system_clock::now();
  const std::string text = tickets.TextOf(SignInTickets::New("/", now));
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char other : {'A', '.', '\0'}) {
      std::string changed = text;
      if (std::exchange(changed[i], other) == other) continue;
      EXPECT_FALSE(tickets.Read(changed, now)) << i;
    }
    EXPECT_FALSE(tickets.Read(text.substr(0, i), now));
    EXPECT_FALSE(tickets.Read(text.substr(i + 1), now));
  }
  EXPECT_FALSE(tickets.Read(text + "A", now));
  EXPECT_FALSE(tickets.Read(text + "=", now));
}

// Who sees one of them knows none of the others; and no two sign-ins share one.
TEST(SignInTicket, ItsSecretsAreEachItsOwn) {
  const SignInTickets tickets;
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const SignInTicket ticket = SignInTickets::New("/", system_clock::now());
    const SignInSecrets secrets = tickets.SecretsOf(ticket);
    for (const std::string& each : {ticket.random, secrets.state, secrets.nonce, secrets.verifier}) {
      EXPECT_EQ(each.size(), 43u);
      EXPECT_TRUE(seen.insert(each).second);
      EXPECT_EQ(tickets.TextOf(ticket).find(each) == std::string::npos, each != ticket.random);
    }
  }
}

// RFC 7636, appendix B.
TEST(SignInTicket, TheChallengeIsThatOfTheStandard) {
  EXPECT_EQ(ChallengeOf("dBjftJeZ4CVP-mB92K27uhbUJU1p1r_wW1gFWFOEjXk"), "E9Melhoa2OwvFrEMTJguCHaoeK1t8URWbuGJSstw-cM");
}

TEST(SignInTicket, TheWayBackIsAPathOfThisSite) {
  for (const char* own : {"/", "/blades", "/blades/SN-1?a=b&c=//d", "/parts/block-1%20a", "/a?b=/.c"})
    EXPECT_TRUE(IsOwnPath(own)) << own;
  for (const std::string other : {"",
                                  "blades",
                                  "//evil.example",
                                  "///evil.example",
                                  "/\\evil.example",
                                  "/a\\b",
                                  "/a//b",
                                  "/./a",
                                  "/..//a",
                                  "/.",
                                  "/a#b",
                                  "/a b",
                                  "/a\tb",
                                  "/\n/evil.example",
                                  "/ü",
                                  "http://evil.example",
                                  "/session",
                                  "/session/start?return=/",
                                  "?a",
                                  "javascript:alert(1)"})
    EXPECT_FALSE(IsOwnPath(other)) << other;
  EXPECT_TRUE(IsOwnPath("/" + std::string(1023, 'a')));
  EXPECT_FALSE(IsOwnPath("/" + std::string(1024, 'a')));
}

}  // namespace
}  // namespace sixpoint::gateway
