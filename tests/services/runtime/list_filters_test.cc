#include "services/runtime/list_filters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/pages.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;

TEST(ListFilters, AViewIsBasicUnlessFullIsAsked) {
  EXPECT_FALSE(*WantsFull(list::v1::VIEW_UNSPECIFIED));
  EXPECT_FALSE(*WantsFull(list::v1::VIEW_BASIC));
  EXPECT_TRUE(*WantsFull(list::v1::VIEW_FULL));
  EXPECT_EQ(WantsFull(static_cast<list::v1::View>(9)).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ListFilters, ARangeMayBeOpenAtEitherEnd) {
  list::v1::TimeRange range;
  EXPECT_FALSE(SpanOf("recorded", range)->from.has_value());
  range.mutable_from()->set_seconds(1'795'231'646);
  const auto from = SpanOf("recorded", range);
  ASSERT_TRUE(from.ok()) << from.status();
  EXPECT_EQ(std::chrono::system_clock::to_time_t(*from->from), 1'795'231'646);
  EXPECT_FALSE(from->until.has_value());
  range.mutable_until()->set_seconds(1'795'231'646);
  EXPECT_TRUE(SpanOf("recorded", range).ok());
}

TEST(ListFilters, RefusesARangeThatIsNone) {
  list::v1::TimeRange range;
  range.mutable_until()->set_seconds(7);
  EXPECT_THAT(std::string(SpanOf("recorded", range).status().message()), HasSubstr("recorded.until.seconds: 7"));
  range.mutable_until()->set_seconds(1'795'231'645);
  range.mutable_from()->set_seconds(1'795'231'646);
  EXPECT_THAT(std::string(SpanOf("recorded", range).status().message()), HasSubstr("recorded.until: 1795231645 s"));
  range.mutable_from()->set_nanos(-1);
  EXPECT_THAT(std::string(SpanOf("recorded", range).status().message()), HasSubstr("recorded.from.nanos: -1"));
}

// What a token is tied to: everything but the page itself.
TEST(ListFilters, AnyFilterChangesTheTextOfARequest) {
  plant::v1::ListBladesRequest request;
  const std::string none = FiltersOf(request);
  request.set_page_size(7);
  request.set_page_token("x");
  EXPECT_EQ(FiltersOf(request), none);
  request.set_part("parts/p1");
  const std::string by_part = FiltersOf(request);
  EXPECT_NE(by_part, none);
  request.mutable_recorded()->mutable_from()->set_seconds(1'795'231'646);
  EXPECT_NE(FiltersOf(request), by_part);
}

}  // namespace
}  // namespace sixpoint::runtime
