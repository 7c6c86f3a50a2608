// What the database keeps of a calibration's drift (migrations/V0027), beside what the trend's own code makes of the same rows.
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/studies/drift.h"
#include "services/calibration/trend.h"
#include "storage/calibration_store.h"
#include "storage/fleet.h"
#include "tests/support/registered.h"
#include "tests/support/sample_calibrations.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::calibration {
namespace {

using std::chrono::hours;
using testing::Soon;

class KeptDrift : public ::testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
    testing::RegisterMachine(*transaction, "m1");
    ASSERT_TRUE(transaction->Commit().ok());
  }
  storage::CalibrationRow Record(storage::CalibrationRow row) {
    row.calibration_id = storage::NewUuid();
    row.machine_id = "m1";
    row.valid_from = std::chrono::system_clock::now() - hours(1);
    row.valid_until = row.valid_from + hours(24 * 90);
    row.requested_by = "engineer";
    row.software_version = "test";
    storage::RecordEntry entry;
    entry.kind = "calibration";
    entry.name = row.name();
    entry.machine = "m1";
    entry.software_version = "test";
    const auto recorded =
        storage::CalibrationsIn(database_.database())->Record({"area.Call", "", "request"}, row, entry, Soon());
    EXPECT_TRUE(recorded.ok()) << recorded.status();
    return row;
  }
  std::optional<storage::DriftRow> Kept(const storage::CalibrationRow& row) {
    const auto now = std::chrono::system_clock::now();
    const auto fleet =
        storage::FleetIn(database_.database())
            ->Fleet({"m1", "", 10, {storage::SummaryPeriod::kHour, now, now}, storage::Reader::Everything()}, Soon());
    EXPECT_TRUE(fleet.ok()) << fleet.status();
    for (const storage::MachineCalibrationRow& one : fleet->calibrations)
      if (one.calibration_id == row.calibration_id) return one.drift;
    ADD_FAILURE() << row.calibration_id << " is not in force";
    return std::nullopt;
  }
  void ExpectSameParameters(const storage::CalibrationRow& row) {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
    const auto rows = transaction->Execute(
        "SELECT parameter, value, standard_uncertainty FROM calibration_parameters($1) ORDER BY position_index",
        storage::Params().Uuid(row.calibration_id));
    ASSERT_TRUE(rows.ok()) << rows.status();
    const std::vector<CalibratedParameter> wanted = ParametersOf(row);
    ASSERT_EQ(static_cast<std::size_t>(rows->count()), wanted.size());
    for (int i = 0; i < rows->count(); ++i) {
      const CalibratedParameter& one = wanted[static_cast<std::size_t>(i)];
      EXPECT_EQ(rows->Text(i, 0), one.name);
      // The same sums in another order.
      EXPECT_NEAR(rows->Real(i, 1), one.value, 1e-12 * (1 + std::abs(one.value))) << one.name;
      EXPECT_NEAR(rows->Real(i, 2), one.standard_uncertainty, 1e-9 * one.standard_uncertainty) << one.name;
    }
  }
  // Of two rows, by the code of the trend.
  void ExpectDrift(const storage::CalibrationRow& earlier, const storage::CalibrationRow& later) {
    const std::optional<storage::DriftRow> kept = Kept(later);
    ASSERT_TRUE(kept.has_value());
    EXPECT_EQ(kept->earlier_id, earlier.calibration_id);
    const auto before = ParametersOf(earlier), after = ParametersOf(later);
    double worst = -1;
    std::vector<std::string> flagged;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (!(before[i].standard_uncertainty > 0) || !(after[i].standard_uncertainty > 0)) continue;
      const auto drift = metrology::AssessDrift(
          {{0, before[i].value, before[i].standard_uncertainty}, {1, after[i].value, after[i].standard_uncertainty}},
          {});
      ASSERT_TRUE(drift.ok());
      worst = std::max(worst, std::abs(drift->steps[0].ratio));
      if (drift->step_alarm) flagged.push_back(after[i].name);
    }
    EXPECT_NEAR(kept->ratio, worst, 1e-9 * worst);
    EXPECT_EQ(kept->flagged_parameters, flagged);
  }
  testing::ThrowawayDatabase database_;
};

TEST_F(KeptDrift, OfASensor) {
  const storage::CalibrationRow first = Record(testing::SampleSensorCalibration());
  ExpectSameParameters(first);
  EXPECT_FALSE(Kept(first).has_value()) << "there is none before it";
  storage::CalibrationRow moved = first;
  moved.sensor->t_sm_mm[1] += 10 * std::sqrt(first.sensor->covariance[28]);
  moved.sensor->beta_deg += 2 * first.sensor->beta_standard_uncertainty_deg;
  const storage::CalibrationRow second = Record(moved);
  ExpectSameParameters(second);
  ExpectDrift(first, second);
  EXPECT_EQ(Kept(second)->parameter, "t_sm_y_mm");
  EXPECT_EQ(Kept(second)->flagged_parameters, std::vector<std::string>{"t_sm_y_mm"});
}

TEST_F(KeptDrift, OfAxesThatLeanAnyWay) {
  // a near each of the machine's axes: the basis across it is another one each time.
  const std::vector<std::array<double, 3>> near = {
      {0.01, 0.99985, -0.014}, {0.9998, 0.012, 0.016}, {-0.02, 0.017, 0.99965}};
  storage::CalibrationRow earlier;
  for (const std::array<double, 3>& direction : near) {
    storage::CalibrationRow row = testing::SampleRotationCalibration();
    const double length = std::hypot(direction[0], direction[1], direction[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      row.rotation->a_direction[i] = direction[i] / length;
      row.rotation->b_direction[i] = direction[(i + 1) % 3] / length;
    }
    // Not a multiple of the unit matrix, so that a row taken for another would be seen.
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j)
        row.rotation->covariance[8 * i + j] = 1e-10 * (i == j ? 2.0 + static_cast<double>(i) : 0.3);
    row = Record(row);
    ExpectSameParameters(row);
    if (!earlier.calibration_id.empty()) ExpectDrift(earlier, row);
    earlier = row;
  }
}

}  // namespace
}  // namespace sixpoint::calibration
