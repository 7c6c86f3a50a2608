#include "cli/calibrate_probe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "services/calibration/calibrate.h"
#include "services/calibration/messages.h"
#include "services/calibration/rows.h"
#include "tests/cli/example.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

absl::Status RefusalOfReadings(const std::string& yaml) {
  const std::string path = ::testing::TempDir() + "/probe_readings.yaml";
  std::ofstream(path) << yaml;
  return LoadProbeReadings(path).status();
}

// The example's own truth: scale 1.0007, offset (12.31, -7.42, -150.27).
TEST(CalibrateProbe, TheExampleCalibratesAndReadsAsATable) {
  const auto request = LoadProbeReadings(Example("probe_readings.yaml"));
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->readings_size(), 27);
  EXPECT_EQ(request->moved_readings_size(), 27);
  const auto measured = calibration::ProbeReadingsOf(*request);
  ASSERT_TRUE(measured.ok()) << measured.status();
  calibration::ProbeInputs inputs;
  inputs.measured = *measured;
  const auto result = calibration::Calibrate(*request, inputs);
  ASSERT_TRUE(result.ok()) << result.status();
  const calibration::v1::ProbeCalibration probe =
      calibration::ToProto(calibration::RowOf(*request, inputs, *result)).value().probe();
  EXPECT_NEAR(probe.scale(), 1.0007, 4 * probe.scale_standard_uncertainty());
  EXPECT_NEAR(probe.offset_mm().z_mm(), -150.27, 4 * std::sqrt(probe.covariance().values(35)));
  EXPECT_EQ(probe.noise_factor(), 1);
  const std::string text = ProbeText(probe);
  std::cout << text;
  for (const char* part : {"standard uncertainty", "approach x", "offset z", "scale", "beam direction", "urad",
                           "block block-45: residual rms", "condition number", "check: block moved", "F3"})
    EXPECT_THAT(text, HasSubstr(part));
}

TEST(CalibrateProbe, EveryOddFieldIsSaidAtOnce) {
  const absl::Status status = RefusalOfReadings(
      "block: b\nnoise_um: -1\nleast_displacement_inch: 0\nleast_displacement_mm: -5\n"
      "faces: [{face: F1, nominal_normal: [0, 0, 0], touched_mm: [[0, 0, 0], [1, 0, 0]]}]\n"
      "readings: [{face: F1, position_mm: [0, 0, .nan], displacement_mm: x}]\n");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  for (const char* part :
       {"noise_um: -1", "least_displacement_inch", "greatest_displacement_mm", "faces[0].nominal_normal",
        "faces[0].touched_mm", "readings[0].position_mm", "readings[0].displacement_mm"})
    EXPECT_THAT(std::string(status.message()), HasSubstr(part));
}

}  // namespace
}  // namespace sixpoint::cli
