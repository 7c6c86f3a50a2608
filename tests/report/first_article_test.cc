#include "report/first_article.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/report/sample_report.h"

namespace sixpoint::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(FirstArticle, HasEveryFieldOfTheFormsByNumber) {
  const std::string html = WriteHtml(VaneFirstArticle()).value();
  for (const char* field : {"1. Part Number",
                            "4. FAIR Identifier",
                            "5. Part Revision Level",
                            "8. Additional Changes",
                            "12. Purchase Order Number",
                            "13. Detail FAI",
                            "14. Full FAI",
                            "15. Part Number",
                            "18. FAIR Identifier",
                            "19. Does FAIR Contain",
                            "20. FAIR Verified By",
                            "25. Date",
                            "26. Comments",
                            "5. Material or Process Name",
                            "10. Certificate of Conformance Number",
                            "11. Functional Test Procedure Number",
                            "12. Acceptance Report Number",
                            "5. Char. No.",
                            "6. Reference Location",
                            "7. Characteristic Designator",
                            "8. Requirement",
                            "9. Results",
                            "10. Designed / Qualified Tooling",
                            "11. Nonconformance Number"})
    EXPECT_THAT(html, HasSubstr(field));
  // Of two that are not conform one has no number yet.
  EXPECT_THAT(html, HasSubstr("not given yet"));
  EXPECT_THAT(html, HasSubstr("NC-2026-044"));
}

TEST(FirstArticle, SaysNoNonconformanceOnlyWhereAllIsConform) {
  FirstArticle f;
  EXPECT_EQ(NonconformanceOf(f), Nonconformance::kOpen);
  FirstArticle::Line line;
  line.characteristic.value = 1, line.characteristic.verdict = Verdict::kConform;
  f.form3 = {line};
  EXPECT_EQ(NonconformanceOf(f), Nonconformance::kNo);
  f.form3.emplace_back();
  EXPECT_EQ(NonconformanceOf(f), Nonconformance::kOpen);
  f.form3[1].characteristic.value = 2, f.form3[1].characteristic.verdict = Verdict::kNotConform;
  EXPECT_EQ(NonconformanceOf(f), Nonconformance::kYes);
}

TEST(FirstArticle, DataHasNullsWhereNothingIsGivenOrMeasured) {
  const std::string text = WriteJson(VaneFirstArticle()).value();
  EXPECT_EQ(text, WriteJson(VaneFirstArticle()).value());
  const nlohmann::json json = nlohmann::json::parse(text);
  EXPECT_EQ(json["form_1"]["1_part_number"], "vane-4711");
  EXPECT_EQ(json["form_1"]["19_contains_nonconformance"], true);
  EXPECT_EQ(json["form_1"]["20_verified_by"], "J. Doe");
  EXPECT_TRUE(json["form_1"]["22_reviewed_by"].is_null());
  EXPECT_TRUE(json["form_1"]["23_date"].is_null());
  EXPECT_EQ(json["form_2"]["materials"].size(), 2u);
  const auto& missing = json["form_3"]["characteristics"][6]["9_result"];
  EXPECT_TRUE(missing["value"].is_null());
  EXPECT_EQ(missing["verdict"], "NOT_MEASURED");
  EXPECT_EQ(missing["reason"], "no pin stands in it");
}

TEST(FirstArticle, IsRefusedOrTamedLikeAReport) {
  FirstArticle f = VaneFirstArticle();
  f.form3[0].characteristic.value.reset();
  EXPECT_THAT(std::string(WritePdf(f).status().message()), HasSubstr("form3[0]."));
  f = VaneFirstArticle();
  f.part_number = f.form3[0].number = f.form2.materials[0].name = "<b>\xff" + std::string(65536, 'x');
  EXPECT_THAT(WriteHtml(f).value(), Not(HasSubstr("<b>?")));
  EXPECT_TRUE(WritePdf(f).ok());
  EXPECT_TRUE(WriteJson(f).ok());
  f.form3.resize(kMostRows + 1);
  EXPECT_THAT(std::string(WriteJson(f).status().message()), HasSubstr("rows"));
  EXPECT_EQ(WritePdf(VaneFirstArticle()).value(), WritePdf(VaneFirstArticle()).value());
  EXPECT_TRUE(WritePdf(FirstArticle()).ok());
}

}  // namespace
}  // namespace sixpoint::report
