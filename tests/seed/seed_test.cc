// A seeded plant holds what it says that was planted, as the database tells it; is the same for the same seed; and is refused where a
// real one is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "seed/seed_plant.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::seed {
namespace {

using ::testing::HasSubstr;
using testing::Soon;
using testing::ThrowawayDatabase;
using ::testing::UnorderedElementsAreArray;

// Few, and yet so many that each kind of thing is planted at least once with this seed (asserted where it is looked at).
Request Small(std::uint64_t seed = 4) {
  Request request;
  request.options = {seed, 400, 10, 4};
  return request;
}

nlohmann::json Seeded(ThrowawayDatabase& plant, const Request& request) {
  const auto planted = SeedPlant(plant.conninfo(), request, [](int) {});
  EXPECT_TRUE(planted.ok()) << planted.status();
  return planted.ok() ? *planted : nlohmann::json();
}

std::vector<std::string> Ask(ThrowawayDatabase& plant, const std::string& sql) {
  auto transaction = plant.database()->Begin(Soon(60));
  EXPECT_TRUE(transaction.ok()) << transaction.status();
  const auto rows = transaction->Execute(sql);
  EXPECT_TRUE(rows.ok()) << rows.status();
  std::vector<std::string> found;
  for (int row = 0; rows.ok() && row < rows->count(); ++row) found.push_back(rows->Text(row, 0));
  return found;
}

std::vector<std::string> Names(const nlohmann::json& list, const char* key = nullptr) {
  std::vector<std::string> names;
  for (const auto& entry : list) names.push_back((key == nullptr ? entry : entry[key]).get<std::string>());
  return names;
}

// One that several tests look at.
class SeededPlantTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = std::make_unique<ThrowawayDatabase>();
    planted_ = std::make_unique<nlohmann::json>(Seeded(*shared_, Small()));
  }
  static void TearDownTestSuite() {
    planted_.reset();
    shared_.reset();
  }
  static std::unique_ptr<ThrowawayDatabase> shared_;
  static std::unique_ptr<nlohmann::json> planted_;
  ThrowawayDatabase& plant = *shared_;
  const nlohmann::json& planted = *planted_;
};
std::unique_ptr<ThrowawayDatabase> SeededPlantTest::shared_;
std::unique_ptr<nlohmann::json> SeededPlantTest::planted_;

TEST_F(SeededPlantTest, HoldsWhatItSaysThatWasPlanted) {
  EXPECT_EQ(Ask(plant, "SELECT count(*)::text FROM blades"), std::vector<std::string>{"400"});
  EXPECT_EQ(Ask(plant,
                "SELECT count(*)::text FROM record_entries WHERE kind IN ('registration', 'correction', 'inspection')"),
            std::vector<std::string>{planted["results"].dump()});
  ASSERT_FALSE(planted["withdrawn_calibrations"].empty());
  EXPECT_THAT(Ask(plant,
                  "SELECT 'calibrations/' || calibration_id FROM calibrations WHERE record_state(calibration_id, "
                  "'calibration') = 'WITHDRAWN'"),
              UnorderedElementsAreArray(Names(planted["withdrawn_calibrations"], "calibration")));
  ASSERT_FALSE(planted["twisted_castings"].empty());
  EXPECT_THAT(Ask(plant, "SELECT blade_serial FROM registrations WHERE outcome = 'NOT_CONVERGED'"),
              UnorderedElementsAreArray(Names(planted["twisted_castings"])));
  ASSERT_FALSE(planted["thick_castings"].empty());
  EXPECT_THAT(Ask(plant, "SELECT blade_serial FROM inspections WHERE verdict = 'NOT_CONFORM' AND rejudges IS NULL"),
              UnorderedElementsAreArray(Names(planted["thick_castings"])));
  ASSERT_FALSE(planted["rejudged"].empty());
  EXPECT_THAT(Ask(plant, "SELECT 'inspections/' || inspection_id FROM inspections WHERE rejudges IS NOT NULL"),
              UnorderedElementsAreArray(Names(planted["rejudged"], "inspection")));
  ASSERT_FALSE(planted["expired_machines"].empty());
  EXPECT_THAT(Ask(plant,
                  "SELECT 'machines/' || machine_id FROM machines m WHERE NOT EXISTS (SELECT 1 FROM calibrations c "
                  "WHERE c.machine_id = m.machine_id AND c.kind = 'sensor' AND "
                  "record_state(c.calibration_id, 'calibration') = 'IN_FORCE')"),
              UnorderedElementsAreArray(Names(planted["expired_machines"])));
  // A machine that drifts is one whose scanner's calibrations walk.
  ASSERT_FALSE(planted["drifting_machines"].empty());
  EXPECT_THAT(Ask(plant,
                  "SELECT 'machines/' || machine_id FROM sensor_calibrations JOIN calibrations USING (calibration_id) "
                  "GROUP BY machine_id HAVING max(t_sm_mm[1]) - min(t_sm_mm[1]) > 0.005"),
              UnorderedElementsAreArray(Names(planted["drifting_machines"], "machine")));
}

TEST_F(SeededPlantTest, SaysOfEverythingThatItIsSeeded) {
  EXPECT_EQ(Ask(plant, "SELECT DISTINCT software_version FROM record_entries"), std::vector<std::string>{"0.1.0+seed"});
  for (const char* ids : {"SELECT blade_serial FROM blades WHERE blade_serial NOT LIKE 'SEED-4-%'",
                          "SELECT machine_id FROM machines WHERE machine_id NOT LIKE 'SEED-4-%'",
                          "SELECT part_id FROM parts WHERE part_id NOT LIKE 'SEED-4-%'"})
    EXPECT_TRUE(Ask(plant, ids).empty()) << ids;
}

TEST_F(SeededPlantTest, HasItsHistoryByTheMachinesClocks) {
  // Of four months of 30 days; in the order of the journal.
  EXPECT_EQ(
      Ask(plant, "SELECT (max(measured_at) - min(measured_at) BETWEEN '110 days' AND '121 days')::text FROM scans"),
      std::vector<std::string>{"true"});
  EXPECT_TRUE(Ask(plant,
                  "SELECT 'late' FROM (SELECT measured_at < lag(measured_at) OVER (ORDER BY record_sequence) AS late "
                  "FROM record_entries WHERE kind = 'scan' AND summary->>'kind' = 'airfoil') s WHERE late")
                  .empty());
}

TEST(SeedTest, TheSameSeedIsTheSameHistoryAndAnotherIsAnother) {
  constexpr char kValues[] =
      "SELECT substr(blade_serial, 8) || group_name || hole_name || h.verdict || position_error_mm FROM "
      "inspection_holes h "
      "JOIN inspections USING (inspection_id) ORDER BY blade_serial, rejudges NULLS FIRST, position_index";
  constexpr char kNumbers[] =
      "SELECT h.verdict || coalesce(position_error_mm, 0) FROM inspection_holes h JOIN inspections i USING "
      "(inspection_id) "
      "WHERE blade_serial LIKE '%-00000000' ORDER BY h.position_index";
  Request request = Small();
  request.options.blade_count = 40;
  ThrowawayDatabase first, second, other;
  Seeded(first, request);
  Seeded(second, request);
  request.options.seed = 8;
  Seeded(other, request);
  EXPECT_FALSE(Ask(first, kValues).empty());
  EXPECT_EQ(Ask(first, kValues), Ask(second, kValues));
  EXPECT_NE(Ask(first, kNumbers), Ask(other, kNumbers));
}

TEST(SeedTest, APlantThatHoldsAnythingElseIsRefused) {
  ThrowawayDatabase plant;
  testing::RegisterUsual(plant.database());
  Request request = Small();
  request.options.blade_count = 10;
  const auto refused = SeedPlant(plant.conninfo(), request, [](int) {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("holds machines/m1@1, which was not seeded"));
  EXPECT_TRUE(Ask(plant, "SELECT blade_serial FROM blades").empty());
  request.into_used_plant = true;
  Seeded(plant, request);
  EXPECT_EQ(Ask(plant, "SELECT blade_serial FROM blades").size(), 10u);
}

TEST(SeedTest, ASeedIsSownOnceAndAnotherBesideIt) {
  ThrowawayDatabase plant;
  Request request = Small();
  request.options.blade_count = 10;
  Seeded(plant, request);
  const auto again = SeedPlant(plant.conninfo(), request, [](int) {});
  ASSERT_FALSE(again.ok());
  EXPECT_THAT(std::string(again.status().message()), HasSubstr("--seed: 4, sown in this plant already"));
  request.options.seed = 8;
  Seeded(plant, request);
  EXPECT_EQ(Ask(plant, "SELECT blade_serial FROM blades").size(), 20u);
}

}  // namespace
}  // namespace sixpoint::seed
