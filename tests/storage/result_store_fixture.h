// Each store of results, PostgreSQL's and the fake that handlers are tested on, for suites that run on both.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "storage/corrections.h"
#include "storage/inspections.h"
#include "storage/registrations.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_assessments.h"
#include "tests/support/fake_deviations.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/fake_machining_passes.h"
#include "tests/support/fake_reconstructions.h"
#include "tests/support/fake_repairs.h"
#include "tests/support/fake_results.h"
#include "tests/support/fake_sections.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"

namespace sixpoint::storage {

// A row that all of the plant's foreign keys hold for.
template <typename Row>
Row OfTheJudgedPlant(Row row = {}) {
  row.blade_serial = "sn1";
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = "p1";
  row.part_revision = 1;
  row.requested_by = "operator";
  row.software_version = "test";
  return row;
}

inline const std::string& JudgedRegistrationId() {
  static const std::string id = std::string(sixpoint::testing::kRegistration).substr(14);
  return id;
}

// The same of what rests on calibrations.
template <typename Row>
Row RegisteredOnThePlant(Row row = {}) {
  row = OfTheJudgedPlant(std::move(row));
  row.sensor_calibration_id = std::string(sixpoint::testing::kSensorCalibration).substr(13);
  row.rotation_calibration_id = std::string(sixpoint::testing::kRotationCalibration).substr(13);
  return row;
}

// The same of what rests on the plant's registration and its scans.
template <typename Row>
Row MeasuredOnThePlant(Row row) {
  row = RegisteredOnThePlant(std::move(row));
  row.registration_id = JudgedRegistrationId();
  row.scan_ids = {"s0", "s1"};
  return row;
}

// A filter of its own, and whether a list under it holds the aggregate's row.
template <typename Filter>
using OwnFilters = std::vector<std::pair<Filter, bool>>;
template <typename Filter>
Filter FilterBy(std::string Filter::*member, const std::string& word) {
  Filter filter;
  filter.*member = word;
  return filter;
}

// What most aggregates have in common.
template <typename RowOf, typename FilterOf, typename StoreOf = ResultStore<RowOf, FilterOf>>
struct StoredAggregate {
  using Row = RowOf;
  using Filter = FilterOf;
  using Store = StoreOf;
  static constexpr bool kRestsOnCalibrations = true;  // says so itself
  static void Prepare(sixpoint::testing::JudgedPlant*) {}
  static OwnFilters<Filter> Filters() { return {}; }
};

struct StoredRegistrations : StoredAggregate<RegistrationRow, RegistrationFilter> {
  static constexpr auto kId = &Row::registration_id;
  static constexpr auto kIn = RegistrationsIn;
  static constexpr char kKind[] = "registration";
  static std::shared_ptr<Store> Fake() {
    return std::make_shared<sixpoint::testing::FakeResults<Row, Filter>>(
        kId, [](const Row& row, const Filter& filter) { return sixpoint::testing::IsListed(row, filter); });
  }
  static Row Make() {
    Row row = RegisteredOnThePlant<Row>();
    row.method = "SIX_POINT";
    row.outcome = "NOT_CONVERGED";
    row.weakest_direction = std::vector<double>(6, 0.4);
    row.condition_number = 44;
    row.weakest_standard_uncertainty_um = 1;
    return row;
  }
};

struct StoredCorrections : StoredAggregate<CorrectionRow, CorrectionFilter> {
  static constexpr auto kId = &Row::correction_id;
  static constexpr auto kIn = CorrectionsIn;
  static constexpr char kKind[] = "correction";
  static std::shared_ptr<Store> Fake() {
    return std::make_shared<sixpoint::testing::FakeResults<Row, Filter>>(
        kId, [](const Row& row, const Filter& filter) { return sixpoint::testing::IsListed(row, filter); });
  }
  static Row Make() {
    Row row = RegisteredOnThePlant<Row>();
    row.registration_id = JudgedRegistrationId();
    row.nc_template = "X1 (SIXPOINT G1/H1)";
    row.nc_program = "X2 (SIXPOINT G1/H1)";
    row.release = "AUTOMATIC";
    row.envelope_translation_mm = 2;
    row.envelope_rotation_deg = 3;
    row.valid_until = Instant(std::chrono::seconds(2'000'000'000));
    return row;
  }
};

struct StoredInspections : StoredAggregate<InspectionRow, InspectionFilter> {
  static constexpr auto kId = &Row::inspection_id;
  static constexpr auto kIn = InspectionsIn;
  static constexpr char kKind[] = "inspection";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeInspections>(); }
  static Row Make() { return MeasuredOnThePlant(sixpoint::testing::SampleInspection()); }
  static OwnFilters<Filter> Filters() {
    return {{FilterBy(&Filter::verdict, "NOT_MEASURED"), true},
            {FilterBy(&Filter::verdict, "CONFORM"), false},
            {FilterBy(&Filter::work_order, "WO-1"), false}};
  }
};

struct StoredDeviations : StoredAggregate<DeviationMapRow, DeviationFilter, DeviationStore> {
  static constexpr auto kId = &Row::deviation_id;
  static constexpr auto kIn = DeviationsIn;
  static constexpr char kKind[] = "deviation";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeDeviations>(); }
  static Row Make() { return MeasuredOnThePlant(sixpoint::testing::SampleDeviation()); }
  static OwnFilters<Filter> Filters() {
    return {{FilterBy(&Filter::verdict, "CONFORM"), true}, {FilterBy(&Filter::verdict, "NOT_CONFORM"), false}};
  }
};

struct StoredSections : StoredAggregate<SectionMeasurementRow, SectionFilter, SectionStore> {
  static constexpr auto kId = &Row::section_measurement_id;
  static constexpr auto kIn = SectionsIn;
  static constexpr char kKind[] = "section";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeSections>(); }
  static Row Make() { return MeasuredOnThePlant(sixpoint::testing::SampleSections()); }
};

struct StoredReconstructions : StoredAggregate<ReconstructionRow, ReconstructionFilter, ReconstructionStore> {
  static constexpr auto kId = &Row::reconstruction_id;
  static constexpr auto kIn = ReconstructionsIn;
  static constexpr char kKind[] = "reconstruction";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeReconstructions>(); }
  static Row Make() { return MeasuredOnThePlant(sixpoint::testing::SampleReconstruction()); }
  static OwnFilters<Filter> Filters() {
    return {{FilterBy(&Filter::outcome, "RECONSTRUCTED"), true}, {FilterBy(&Filter::outcome, "INFEASIBLE"), false}};
  }
};

struct StoredMachiningPasses : StoredAggregate<MachiningPassRow, MachiningPassFilter, MachiningPassStore> {
  static constexpr auto kId = &Row::pass_id;
  static constexpr auto kIn = MachiningPassesIn;
  static constexpr char kKind[] = "machining_pass";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeMachiningPasses>(); }
  static Row Make() {
    Row row = MeasuredOnThePlant(sixpoint::testing::SampleMachiningPass());
    row.correction_id = row.reconstruction_id = JudgedRegistrationId();  // anything that is recorded
    return row;
  }
  static OwnFilters<Filter> Filters() {
    return {{FilterBy(&Filter::outcome, "DONE"), true}, {FilterBy(&Filter::outcome, "SCRAP"), false}};
  }
};

struct StoredRepairs : StoredAggregate<RepairRow, RepairFilter, RepairStore> {
  static constexpr auto kId = &Row::repair_id;
  static constexpr auto kIn = RepairsIn;
  static constexpr char kKind[] = "repair";
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeRepairs>(); }
  static Row Make() {
    Row row = MeasuredOnThePlant(sixpoint::testing::SampleRepair());
    row.applied.leading_in_part_mm = {1, 2, 3};
    return row;
  }
};

struct StoredAssessments : StoredAggregate<AssessmentRow, AssessmentFilter> {
  static constexpr bool kRestsOnCalibrations = false;
  static constexpr auto kId = &Row::assessment_id;
  static constexpr auto kIn = AssessmentsIn;
  static constexpr char kKind[] = "assessment";
  static void Prepare(sixpoint::testing::JudgedPlant* plant) {
    Transaction transaction = sixpoint::testing::Must(plant->database.database()->Begin(sixpoint::testing::Soon()));
    sixpoint::testing::PutDrawingOf(transaction, "p1", "d1");
    sixpoint::testing::Must(transaction.Commit());
  }
  static std::shared_ptr<Store> Fake() { return std::make_shared<sixpoint::testing::FakeAssessments>(); }
  static Row Make() {
    Row row = OfTheJudgedPlant(sixpoint::testing::SampleAssessment());
    row.drawing_id = "d1";
    row.results = {sixpoint::testing::kRegistration};  // anything that is recorded
    return row;
  }
  static OwnFilters<Filter> Filters() {
    Filter first = FilterBy(&Filter::drawing_id, "d1"), second = first;
    first.drawing_revision = 1;
    second.drawing_revision = 2;
    return {{first, true},
            {second, false},
            {FilterBy(&Filter::drawing_id, "d2"), false},
            {FilterBy(&Filter::verdict, "NOT_CONFORM"), true},
            {FilterBy(&Filter::verdict, "CONFORM"), false}};
  }
};

template <typename Aggregate>
class ResultStoreTest : public ::testing::Test {
 protected:
  using Row = typename Aggregate::Row;
  using Filter = typename Aggregate::Filter;
  using Store = typename Aggregate::Store;

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
  static absl::StatusOr<Row> Record(Store& store, const Row& row, const std::string& request_id = "",
                                    const std::string& bytes = "request") {
    return store.Record({"area.Call", request_id, bytes}, row, EntryOf(row), sixpoint::testing::Soon());
  }
  static std::vector<std::string> Ids(const Store& store, const Filter& filter, std::int64_t before, int limit) {
    const auto rows = store.List(filter, before, limit, sixpoint::testing::Soon());
    EXPECT_TRUE(rows.ok()) << rows.status();
    if (!rows.ok()) return {};
    std::vector<std::string> ids;
    for (const Row& row : *rows) ids.push_back(row.*Aggregate::kId);
    return ids;
  }
  // Each test runs on both; it is told how many rows are there already.
  template <typename Test>
  void OnBoth(const Test& test) {
    {
      SCOPED_TRACE("the fake");
      const std::shared_ptr<Store> fake = Aggregate::Fake();
      test(*fake, 0);
    }
    SCOPED_TRACE("PostgreSQL");
    sixpoint::testing::JudgedPlant plant;
    Aggregate::Prepare(&plant);
    const std::shared_ptr<Store> store = Aggregate::kIn(plant.database.database());
    // The plant of the tests holds one registration already.
    const auto before = store->List({}, 0, 1, sixpoint::testing::Soon());
    ASSERT_TRUE(before.ok()) << before.status();
    test(*store, static_cast<int>(before->size()));
  }
};

}  // namespace sixpoint::storage
