#include "services/runtime/pages.h"

#include <gtest/gtest.h>

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

TEST(Pages, SizesAreBounded) {
  EXPECT_EQ(PageOf("", 0, "")->size, 100);
  EXPECT_EQ(PageOf("", 5000, "")->size, 1000);
  EXPECT_FALSE(PageOf("", -1, "").ok());
}

}  // namespace
}  // namespace sixpoint::runtime
