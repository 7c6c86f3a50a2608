// What every ResultStore does, of PostgreSQL's and of the fake that handlers are tested on.
#include "storage/result_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "storage/corrections.h"
#include "storage/deviations.h"
#include "storage/inspections.h"
#include "storage/machining_passes.h"
#include "storage/reconstructions.h"
#include "storage/registrations.h"
#include "storage/repairs.h"
#include "storage/sections.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/fake_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeResults;
using sixpoint::testing::JudgedPlant;
using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A row that all of a plant's foreign keys hold for.
template <typename Row>
Row RowOfThePlant() {
  Row row;
  row.blade_serial = "sn1";
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = "p1";
  row.part_revision = 1;
  row.sensor_calibration_id = std::string(sixpoint::testing::kSensorCalibration).substr(13);
  row.rotation_calibration_id = std::string(sixpoint::testing::kRotationCalibration).substr(13);
  row.requested_by = "operator";
  row.software_version = "test";
  return row;
}

struct Registrations {
  using Row = RegistrationRow;
  using Filter = RegistrationFilter;
  static constexpr auto kId = &Row::registration_id;
  static constexpr auto kIn = RegistrationsIn;
  static constexpr char kKind[] = "registration";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.method = "SIX_POINT";
    row.outcome = "NOT_CONVERGED";
    row.weakest_direction = std::vector<double>(6, 0.4);
    return row;
  }
};

struct Corrections {
  using Row = CorrectionRow;
  using Filter = CorrectionFilter;
  static constexpr auto kId = &Row::correction_id;
  static constexpr auto kIn = CorrectionsIn;
  static constexpr char kKind[] = "correction";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.nc_template = "X1 (SIXPOINT G1/H1)";
    row.nc_program = "X2 (SIXPOINT G1/H1)";
    row.release = "AUTOMATIC";
    row.envelope_translation_mm = 2;
    row.envelope_rotation_deg = 3;
    row.valid_until = Instant(std::chrono::seconds(2'000'000'000));
    return row;
  }
};

struct Inspections {
  using Row = InspectionRow;
  using Filter = InspectionFilter;
  static constexpr auto kId = &Row::inspection_id;
  static constexpr auto kIn = InspectionsIn;
  static constexpr char kKind[] = "inspection";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "SIX_POINT";
    row.verdict = "NOT_MEASURED";
    row.decision_rule = "rule";
    row.deviation_point_count = 1;
    row.scan_ids = {"s0"};
    return row;
  }
};

struct Deviations {
  using Row = DeviationMapRow;
  using Filter = DeviationFilter;
  static constexpr auto kId = &Row::deviation_id;
  static constexpr auto kIn = DeviationsIn;
  static constexpr char kKind[] = "deviation";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "BEST_FIT";
    row.patch_mm = row.patch_count = 1;
    row.compared_count = 1;
    row.budget_sources = {"points"};
    row.budget_um = {1};
    row.patches_sha256 = std::string(64, '0');
    row.computed_on = "test";
    row.scan_ids = {"s0"};
    row.regions = {DeviationRegionRow()};
    row.regions.front().area_mm2 = 1;
    row.patches = {{0, 0, 0}, {0, 0, 1}, {1}, {NAN}, {NAN}, {0}};
    return row;
  }
};

struct Sections {
  using Row = SectionMeasurementRow;
  using Filter = SectionFilter;
  static constexpr auto kId = &Row::section_measurement_id;
  static constexpr auto kIn = SectionsIn;
  static constexpr char kKind[] = "section";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "BEST_FIT";
    row.half_width_mm = 0.1;
    row.reference_section = "50 %";
    row.outlines_sha256 = std::string(64, '0');
    row.computed_on = "x86-64";
    return row;
  }
};

struct Reconstructions {
  using Row = ReconstructionRow;
  using Filter = ReconstructionFilter;
  static constexpr auto kId = &Row::reconstruction_id;
  static constexpr auto kIn = ReconstructionsIn;
  static constexpr char kKind[] = "reconstruction";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "BEST_FIT";
    row.applied = {0.5, 1.5, 4, 2, 4, 3};
    row.outcome = "NOT_DETERMINED";
    row.remark = "too little was seen";
    row.taken_count = row.patch_count = 1;
    row.patches_sha256 = std::string(64, '0');
    row.computed_on = "x86-64";
    row.scan_ids = {"s0"};
    row.patches = {{0, 0, 0}, {0, 0, 1}, {1}, {NAN}, {0}};
    return row;
  }
};

template <typename Aggregate>
class ResultStoreTest : public ::testing::Test {
 protected:
  using Row = typename Aggregate::Row;
  using Filter = typename Aggregate::Filter;
  using Store = ResultStore<Row, Filter>;

  static Row New() {
    Row row = Aggregate::Make();
    row.*Aggregate::kId = NewUuid();
    return row;
  }
  static RecordEntry EntryOf(const Row& row) {
    RecordEntry entry;
    entry.kind = Aggregate::kKind;
    entry.name = entry.kind + "s/" + row.*Aggregate::kId;
    entry.blade = row.blade_serial;
    entry.machine = row.machine_id;
    entry.software_version = "test";
    return entry;
  }
  absl::StatusOr<Row> Record(Store& store, const Row& row, const std::string& request_id = "",
                             const std::string& bytes = "request") {
    return store.Record({"area.Call", request_id, bytes}, row, EntryOf(row), Soon());
  }
  std::vector<std::string> Ids(const Store& store, const Filter& filter, std::int64_t before, int limit) {
    const auto rows = store.List(filter, before, limit, Soon());
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::vector<std::string> ids;
    for (const Row& row : *rows) ids.push_back(row.*Aggregate::kId);
    return ids;
  }
  // Each test runs on both.
  template <typename Test>
  void OnBoth(const Test& test) {
    {
      SCOPED_TRACE("the fake");
      FakeResults<Row, Filter> fake(Aggregate::kId, [](const Row& row, const Filter& filter) {
        return filter.blade_serial.empty() || row.blade_serial == filter.blade_serial;
      });
      test(static_cast<Store&>(fake), 0);
    }
    SCOPED_TRACE("PostgreSQL");
    JudgedPlant plant;
    const std::shared_ptr<Store> store = Aggregate::kIn(plant.database.database());
    // The plant of the tests holds one registration already.
    const auto before = store->List({}, 0, 1, Soon());
    ASSERT_TRUE(before.ok()) << before.status();
    test(*store, static_cast<int>(before->size()));
  }
};

struct MachiningPasses {
  using Row = MachiningPassRow;
  using Filter = MachiningPassFilter;
  static constexpr auto kId = &Row::pass_id;
  static constexpr auto kIn = MachiningPassesIn;
  static constexpr char kKind[] = "machining_pass";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = row.correction_id = row.reconstruction_id =
        std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "BEST_FIT";
    row.number = 1;
    row.outcome = "NOT_DETERMINED";
    row.remark = "too little was seen";
    row.taken_count = row.patch_count = 1;
    row.patches_sha256 = std::string(64, '0');
    row.computed_on = "x86-64";
    row.scan_ids = {"s0"};
    row.patches = {{0, 0, 0}, {0, 0, 1}, {1}, {NAN}, {0}};
    return row;
  }
};

struct Repairs {
  using Row = RepairRow;
  using Filter = RepairFilter;
  static constexpr auto kId = &Row::repair_id;
  static constexpr auto kIn = RepairsIn;
  static constexpr char kKind[] = "repair";
  static Row Make() {
    Row row = RowOfThePlant<Row>();
    row.registration_id = std::string(sixpoint::testing::kRegistration).substr(14);
    row.method = "BEST_FIT";
    row.applied = {2, 30, 38, 1, 6, 40, "POLYNOMIAL", true, {1, 2, 3}, 5, 5, 0, 50, 0.5, 0.1, 1, 10, 1, 1.2, 50};
    row.determination = RepairDeterminationRow{0.99, 0.98, 0.97, 0.96};
    row.below_line_count = 1;
    row.step_over_mm = 0.3;
    row.lap_count = 2;
    row.place_count = 4;
    row.path_length_mm = 1;
    row.removal.place_count_below_line = 1;
    row.contours_sha256 = row.path_sha256 = std::string(64, '0');
    row.computed_on = "x86-64";
    row.scan_ids = {"s0"};
    row.sections = {{4, "LEFT_OUT", "the trailing end was not seen", {}, {}, {}, {}}};
    row.contours = {{{0, 0, 0}, {1}, {-2}}};
    row.laps = {{30, 0.1, {0, 0, 0}, {0, 0, 1}}, {30, 0, {0, 0, 0}, {0, 0, 1}}};
    return row;
  }
};

using Aggregates = ::testing::Types<Registrations, Corrections, Inspections, Deviations, Sections, Reconstructions,
                                    MachiningPasses, Repairs>;
TYPED_TEST_SUITE(ResultStoreTest, Aggregates);

TYPED_TEST(ResultStoreTest, WhatIsRecordedIsFoundWithItsSequenceAndTime) {
  this->OnBoth([this](auto& store, int) {
    const auto row = this->New();
    const auto recorded = this->Record(store, row);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const auto found = store.Find(row.*TypeParam::kId, Soon());
    ASSERT_TRUE(found.ok() && found->has_value()) << found.status();
    EXPECT_EQ((**found).recorded.sequence, recorded->recorded.sequence);
    EXPECT_EQ((**found).recorded.recorded_at, recorded->recorded.recorded_at);
    EXPECT_GT((**found).recorded.sequence, 0);
    EXPECT_LT(std::chrono::abs((**found).recorded.recorded_at - std::chrono::system_clock::now()),
              std::chrono::minutes(5));
    EXPECT_EQ((**found).requested_by, "operator");
    for (const std::string& id : {NewUuid(), std::string("no-uuid")}) {
      const auto none = store.Find(id, Soon());
      ASSERT_TRUE(none.ok()) << none.status();
      EXPECT_FALSE(none->has_value());
    }
  });
}

TYPED_TEST(ResultStoreTest, TheSameRequestIsRecordedOnce) {
  this->OnBoth([this](auto& store, int held_count) {
    const auto first = this->Record(store, this->New(), kSomeUuid);
    ASSERT_TRUE(first.ok()) << first.status();
    const std::string id = (*first).*TypeParam::kId;
    EXPECT_EQ((**store.FindRecorded({"area.Call", kSomeUuid, "request"}, Soon())).*TypeParam::kId, id);
    EXPECT_EQ((*this->Record(store, this->New(), kSomeUuid)).*TypeParam::kId, id);
    EXPECT_EQ(this->Record(store, this->New(), kSomeUuid, "another").status().code(), absl::StatusCode::kAlreadyExists);
    EXPECT_FALSE(store.FindRecorded({"area.Other", kSomeUuid, "request"}, Soon())->has_value());
    EXPECT_EQ(static_cast<int>(this->Ids(store, {}, 0, 10).size()), held_count + 1);
  });
}

TYPED_TEST(ResultStoreTest, WithoutARequestIdNothingIsKept) {
  this->OnBoth([this](auto& store, int held_count) {
    ASSERT_TRUE(this->Record(store, this->New()).ok());
    ASSERT_TRUE(this->Record(store, this->New()).ok());
    EXPECT_FALSE(store.FindRecorded({"area.Call", "", "request"}, Soon())->has_value());
    EXPECT_EQ(static_cast<int>(this->Ids(store, {}, 0, 10).size()), held_count + 2);
  });
}

TYPED_TEST(ResultStoreTest, ListsNewestFirstFromBelowASequenceAndByBlade) {
  this->OnBoth([this](auto& store, int) {
    std::vector<std::string> ids;
    for (int i = 0; i < 3; ++i) {
      const auto row = this->New();
      ASSERT_TRUE(this->Record(store, row).ok());
      ids.push_back(row.*TypeParam::kId);
    }
    EXPECT_THAT(this->Ids(store, {}, 0, 2), ElementsAre(ids[2], ids[1]));
    const std::int64_t second = (**store.Find(ids[1], Soon())).recorded.sequence;
    EXPECT_THAT(this->Ids(store, {}, second, 1), ElementsAre(ids[0]));
    typename TypeParam::Filter filter;
    filter.blade_serial = "another";
    EXPECT_THAT(this->Ids(store, filter, 0, 10), IsEmpty());
    filter.blade_serial = "sn1";
    EXPECT_THAT(this->Ids(store, filter, 0, 1), ElementsAre(ids[2]));
  });
}

// Of the real one alone: what else the transaction writes.
TEST(PostgresResults, AResultIsInTheJournalAndItsProgramReadBack) {
  JudgedPlant plant;
  const auto store = CorrectionsIn(plant.database.database());
  CorrectionRow row = Corrections::Make();
  row.correction_id = NewUuid();
  row.proof = ProgramProofRow{"1", 12, 0.07, 1e-5};
  row.work_offsets = {{"G54", {}}, {"G55", {1, 2, 3, 4, 5}}};
  RecordEntry entry;
  entry.kind = "correction";
  entry.name = "corrections/" + row.correction_id;
  entry.inputs = {sixpoint::testing::kRegistration};
  entry.software_version = "test";
  const auto recorded = store->Record({"area.Call", "", ""}, row, entry, Soon());
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  EXPECT_EQ((**store->Find(row.correction_id, Soon())).nc_program, row.nc_program);
  EXPECT_EQ(store->List({}, 0, 1, Soon())->front().nc_program, "");
  const CorrectionRow read = **store->Find(row.correction_id, Soon());
  ASSERT_TRUE(read.proof.has_value());
  EXPECT_EQ(read.proof->reader_version, "1");
  EXPECT_EQ(read.proof->pose_count, 12);
  EXPECT_EQ(read.proof->greatest_difference_um, 0.07);
  EXPECT_EQ(read.proof->greatest_tilt_deg, 1e-5);
  ASSERT_EQ(read.work_offsets.size(), 2u);
  EXPECT_EQ(read.work_offsets[0].code, "G54");
  EXPECT_EQ(read.work_offsets[1].offset, (std::array<double, 5>{1, 2, 3, 4, 5}));
  auto transaction = plant.database.database()->Begin(Soon());
  const auto derived = DerivedFrom(*transaction, sixpoint::testing::kRegistration);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, entry.name);
}

}  // namespace
}  // namespace sixpoint::storage
