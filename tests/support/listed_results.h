// What every service's lists of results do (services/runtime/recorded_results.h), asked of one service's.
#pragma once

#include <absl/status/statusor.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "refusal/refusal.h"

namespace sixpoint::testing {

// Of a list's answer.
template <typename Messages>
std::vector<std::string> ListedNames(const Messages& messages) {
  std::vector<std::string> names;
  for (const auto& message : messages) names.push_back(message.name());
  return names;
}

// The field that is refused, and no other.
inline std::string RefusedField(const absl::Status& status) {
  const std::vector<Violation> violations = ViolationsOf(status);
  return violations.size() == 1 ? violations.front().field : "no field: " + status.ToString();
}

// recorded: names of all that is there, in the order in which it was recorded. list(request) gives the answer, messages_in(answer) what
// is listed.
template <typename Request, typename List, typename MessagesIn>
void ExpectPagesNewestFirst(const std::vector<std::string>& recorded, const List& list, const MessagesIn& messages_in) {
  Request request;
  request.set_page_size(2);
  std::vector<std::string> listed;
  do {
    const auto page = list(request);
    ASSERT_TRUE(page.ok()) << page.status();
    const std::vector<std::string> names = ListedNames(messages_in(*page));
    ASSERT_FALSE(names.empty());
    EXPECT_LE(names.size(), 2u);
    listed.insert(listed.end(), names.begin(), names.end());
    ASSERT_LE(listed.size(), recorded.size());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, std::vector<std::string>(recorded.rbegin(), recorded.rend()));
}

// What every list of results refuses, each by its field.
template <typename Request, typename List>
void ExpectListRefusals(const List& list) {
  const auto field = [&](const std::function<void(Request*)>& ask) {
    Request request;
    ask(&request);
    return RefusedField(list(request).status());
  };
  EXPECT_EQ(field([](Request* r) { r->set_blade("parts/p1"); }), "blade");
  EXPECT_EQ(field([](Request* r) { r->set_machine("blades/sn1"); }), "machine");
  EXPECT_EQ(field([](Request* r) { r->set_part("blades/sn1"); }), "part");
  EXPECT_EQ(field([](Request* r) { r->set_calibration("blades/sn1"); }), "calibration");
  EXPECT_EQ(field([](Request* r) {
              r->mutable_recorded()->mutable_from()->set_seconds(1'800'000'000);
              r->mutable_recorded()->mutable_until()->set_seconds(1'700'000'000);
            }),
            "recorded.until");
  EXPECT_EQ(field([](Request* r) { r->set_view(static_cast<decltype(r->view())>(7)); }), "view");
  EXPECT_EQ(field([](Request* r) { r->set_page_size(-1); }), "page_size");
  EXPECT_EQ(field([](Request* r) { r->set_page_token("of another list"); }), "page_token");
}

}  // namespace sixpoint::testing
