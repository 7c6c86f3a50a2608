// Recorded results as they leave: what the record says that this release does not know leaves as nothing else.
#include "services/inspection/exported.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/sample_results.h"

namespace sixpoint::inspection {
namespace {

using ::testing::HasSubstr;

TEST(Exported, AVerdictOfAnotherReleaseIsNoneThatWasNotMeasured) {
  const auto refused = [](const auto& row) {
    const absl::Status status = Exported(row, nullptr).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("its VERDICT_PROBABLE is none that this release knows"));
  };
  storage::InspectionRow inspection = sixpoint::testing::SampleInspection();
  ASSERT_TRUE(Exported(inspection, nullptr).ok());
  inspection.holes.at(0).position_verdict = "PROBABLE";
  refused(inspection);
  storage::DeviationMapRow map = sixpoint::testing::SampleDeviation();
  ASSERT_TRUE(Exported(map, nullptr)->has_value());
  map.profiles.at(0).verdict = "PROBABLE";
  refused(map);
  map.profiles.clear();
  EXPECT_FALSE(Exported(map, nullptr)->has_value());
  storage::AssessmentRow assessment = sixpoint::testing::SampleAssessment();
  ASSERT_TRUE(Exported(assessment, nullptr).ok());
  assessment.findings.at(0).verdict = "PROBABLE";
  refused(assessment);
}

}  // namespace
}  // namespace sixpoint::inspection
