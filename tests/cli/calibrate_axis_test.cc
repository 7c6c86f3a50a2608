#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "cli/calibration_documents.h"
#include "cli/reports.h"
#include "services/calibration/calibrate.h"
#include "services/calibration/messages.h"
#include "services/calibration/rows.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// The example has no noise but the rounding of its figures.
TEST(CalibrateAxis, ANoiselessRunShowsItsSmallUncertainties) {
  const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
  ASSERT_NE(source, nullptr);
  const auto run = LoadAxisRun(std::string(source) + "/docs/examples/axis_run.yaml", "A");
  ASSERT_TRUE(run.ok()) << run.status();
  const auto readings = calibration::ReadingsOf(*run);
  ASSERT_TRUE(readings.ok()) << readings.status();
  calibration::v1::CharacteriseAxisRequest request;
  request.set_axis("A");
  calibration::AxisInputs inputs;
  inputs.readings = *readings;
  const auto result = calibration::Calibrate(request, inputs);
  ASSERT_TRUE(result.ok()) << result.status();
  storage::CalibrationRow row = calibration::RowOf(request, inputs, *result);
  row.axis->beyond_limits_count = 216;
  calibration::v1::Calibration made;
  made.set_name("calibrations/x");
  made.set_kind(calibration::v1::CALIBRATION_KIND_AXIS);
  made.set_state(calibration::v1::CALIBRATION_STATE_SUPERSEDED);
  made.set_superseded_by("calibrations/y");
  *made.mutable_axis() = calibration::ToProto(row).value().axis();
  const std::string text = CalibrationText(made);
  for (const char* part : {"calibrations/x: axis A of", "superseded by calibrations/y",
                           "306 readings, 216 of them beyond", "reversal error                               0.015000",
                           "mean error                                   0.000000",
                           "periodic error, amplitude every 10.0000 deg", "table: 2080 values each way"})
    EXPECT_THAT(text, HasSubstr(part));
  // No uncertainty of nothing; the mean error, 1e-15 deg, is shown as what is known of it.
  EXPECT_THAT(text, Not(HasSubstr("0.000000\n")));
  EXPECT_THAT(text, Not(HasSubstr("e-15")));
}

}  // namespace
}  // namespace sixpoint::cli
