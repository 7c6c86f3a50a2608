#include "services/runtime/pages.h"

#include <google/protobuf/wrappers.pb.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sixpoint/list/v1/list.pb.h"

namespace sixpoint::runtime {
namespace {

TEST(Pages, ATokenLeadsBackToItsPlace) {
  const auto page = PageOf("blades/sn1|pins", 10, TokenAfter("blades/sn1|pins", 42));
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_EQ(page->before_sequence, 42);
  EXPECT_EQ(page->size, 10);
}

TEST(Pages, RefuseATokenOfOtherFiltersOrNone) {
  const std::string token = TokenAfter("blades/sn1", 42);
  for (const auto& [filters, bad] : {std::pair<std::string, std::string>{"blades/sn2", token},
                                     {"blades/sn1", token + "x"},
                                     {"blades/sn1", "x"},
                                     {"blades/sn1", TokenAfter("blades/sn1", 0)}}) {
    const auto page = PageOf(filters, 10, bad);
    ASSERT_FALSE(page.ok()) << bad;
    EXPECT_NE(std::string(page.status().message()).find("page_token"), std::string::npos);
  }
}

TEST(Pages, APageByIdBeginsBehindItsToken) {
  const auto page = IdPageOf("parts/p1", 10, TokenAfterId("parts/p1", "SN-0001"));
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_EQ(page->after_id, "SN-0001");
  EXPECT_EQ(IdPageOf("parts/p1", 10, "")->after_id, "");
  for (const std::string& bad : {TokenAfterId("parts/p2", "SN-0001"), TokenAfterId("parts/p1", ""),
                                 TokenAfterId("parts/p1", "../x"), std::string("SN-0001")})
    EXPECT_FALSE(IdPageOf("parts/p1", 10, bad).ok()) << bad;
}

struct PagedRow {
  std::int64_t sequence;
  std::size_t bytes;
};
list::v1::TimeRange NoRange(const PagedRow&) { return {}; }

TEST(Pages, TheLastRowIsToldWhereAnotherPageFollows) {
  const std::vector<PagedRow> rows = {{3, 0}, {2, 0}, {1, 0}};
  google::protobuf::RepeatedPtrField<list::v1::TimeRange> out;
  const auto last = AddPage(rows, 2, NoRange, &out);
  ASSERT_TRUE(last.ok() && *last != nullptr);
  EXPECT_EQ((*last)->sequence, 2);
  EXPECT_EQ(out.size(), 2);
  EXPECT_EQ(*AddPage(rows, 3, NoRange, &out), nullptr);
  EXPECT_EQ(out.size(), 5);
  const auto damaged = [](const PagedRow&) -> absl::StatusOr<list::v1::TimeRange> { return absl::DataLossError("x"); };
  EXPECT_EQ(AddPage(rows, 2, damaged, &out).status().code(), absl::StatusCode::kDataLoss);
}

// What a client of another language takes, unless told otherwise, is 4 MiB.
TEST(Pages, EndBeforeTheyAreTooManyBytes) {
  const std::vector<PagedRow> rows = {{5, std::size_t{4} << 20}, {4, 1 << 20}, {3, 1 << 20}, {2, 1 << 20}, {1, 9}};
  const auto of_size = [](const PagedRow& row) {
    google::protobuf::StringValue value;
    value.set_value(std::string(row.bytes, 'x'));
    return value;
  };
  google::protobuf::RepeatedPtrField<google::protobuf::StringValue> first, second;
  EXPECT_EQ((**AddPage(rows, 5, of_size, &first)).sequence, 5) << "one message is a page, whatever its size";
  const std::vector<PagedRow> rest(rows.begin() + 1, rows.end());
  EXPECT_EQ((**AddPage(rest, 5, of_size, &second)).sequence, 3);
  EXPECT_EQ(second.size(), 2);
}

TEST(Pages, SizesAreBounded) {
  EXPECT_EQ(PageOf("", 0, "")->size, 100);
  EXPECT_EQ(PageOf("", 5000, "")->size, 1000);
  EXPECT_FALSE(PageOf("", -1, "").ok());
}

}  // namespace
}  // namespace sixpoint::runtime
