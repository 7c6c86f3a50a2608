// The event service's handlers on a fake journal: no PostgreSQL. What crashes, crowds and slow readers do is in event_service_test.cc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/plant/event_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/support/call.h"
#include "tests/support/fake_events.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::plant {
namespace {

using namespace std::chrono_literals;
using sixpoint::testing::Call;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EventHandlersTest : public ::testing::Test {
 protected:
  using Stub = v1::EventService::Stub;
  static EventServiceOptions Quick() {
    EventServiceOptions options;
    options.heartbeat = 200ms;
    return options;
  }
  ~EventHandlersTest() override { service_.Stop(); }
  void Record(int count) {
    for (int i = 0; i < count; ++i) journal_->Record("policy", "policies/p" + std::to_string(i));
  }
  // What a watch tells until its last message holds `most` names, or how it ended.
  absl::StatusOr<std::vector<std::string>> Watched(const v1::WatchEventsRequest& request, std::size_t most) {
    const auto context = runtime::ContextFor(30);
    const auto reader = stub_->WatchEvents(context.get(), request);
    std::vector<std::string> names;
    v1::WatchEventsResponse response;
    while (names.size() < most && reader->Read(&response))
      for (const v1::Event& event : response.events()) names.push_back(event.entry().name());
    const bool has_all = names.size() >= most;
    if (has_all) context->TryCancel();
    const absl::Status ended = runtime::FromGrpc(reader->Finish());
    if (!has_all) return ended;
    return names;
  }

  std::shared_ptr<testing::FakeEvents> journal_ = std::make_shared<testing::FakeEvents>();
  EventService service_{journal_, journal_, Quick()};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::EventService::NewStub(server_.Connect());
};

TEST_F(EventHandlersTest, TellsWhatWasAndWhatComes) {
  Record(3);
  v1::WatchEventsRequest request;
  request.set_after_sequence(1);
  const auto were = Watched(request, 2);
  ASSERT_TRUE(were.ok()) << were.status();
  EXPECT_THAT(*were, ElementsAre("policies/p1", "policies/p2"));
  std::thread later([this] {
    std::this_thread::sleep_for(100ms);
    journal_->Record("policy", "policies/later");
  });
  request.set_after_sequence(3);
  const auto comes = Watched(request, 1);
  later.join();
  ASSERT_TRUE(comes.ok()) << comes.status();
  EXPECT_THAT(*comes, ElementsAre("policies/later"));
}

TEST_F(EventHandlersTest, PagesForWhoAsksNowAndThen) {
  Record(7);
  v1::ListEventsRequest request;
  request.set_page_size(3);
  std::vector<std::string> names;
  std::vector<int> sizes;
  bool is_newest = false;
  while (!is_newest) {
    const auto page = Call(*stub_, &Stub::ListEvents, request);
    ASSERT_TRUE(page.ok()) << page.status();
    for (const v1::Event& event : page->events()) names.push_back(event.entry().name());
    sizes.push_back(page->events_size());
    is_newest = page->is_newest();
    request.set_after_sequence(page->looked_at_sequence());
  }
  EXPECT_THAT(sizes, ElementsAre(3, 3, 1));
  EXPECT_THAT(names, ElementsAre("policies/p0", "policies/p1", "policies/p2", "policies/p3", "policies/p4",
                                 "policies/p5", "policies/p6"));
  request.set_page_size(-1);
  EXPECT_TRUE(absl::IsInvalidArgument(Call(*stub_, &Stub::ListEvents, request).status()));
}

TEST_F(EventHandlersTest, WhatIsAskedForWronglyIsRefusedWithWhatWasWanted) {
  Record(1);
  v1::WatchEventsRequest request;
  request.set_after_sequence(2);
  request.mutable_filter()->add_kinds("blade");
  request.mutable_filter()->add_kinds("inspektion");
  request.mutable_filter()->set_machine("blades/sn1");
  request.mutable_filter()->add_verdicts("conform");
  const std::string refused(Watched(request, 1).status().message());
  EXPECT_THAT(refused, HasSubstr("after_sequence: 2, want 0 to 1"));
  EXPECT_THAT(refused, HasSubstr("filter.kinds[1]: inspektion, want one of "));
  EXPECT_THAT(refused, HasSubstr("filter.machine: blades/sn1"));
  EXPECT_THAT(refused, HasSubstr("filter.verdicts[0]: conform"));
  request.Clear();
  request.set_after_sequence(-1);
  EXPECT_TRUE(absl::IsInvalidArgument(Watched(request, 1).status()));
}

TEST_F(EventHandlersTest, SaysWhatTheStoreSays) {
  Record(1);
  journal_->Fail(absl::UnavailableError("database: away"));
  EXPECT_TRUE(absl::IsUnavailable(Call(*stub_, &Stub::ListEvents, v1::ListEventsRequest()).status()));
  EXPECT_TRUE(absl::IsUnavailable(Watched({}, 1).status()));
  journal_->Fail(absl::OkStatus());
  EXPECT_EQ(Call(*stub_, &Stub::ListEvents, v1::ListEventsRequest())->events_size(), 1);
}

}  // namespace
}  // namespace sixpoint::plant
