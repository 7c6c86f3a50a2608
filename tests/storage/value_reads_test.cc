// What a ValueReader tells of recorded inspections, PostgreSQL's and the fake that handlers are tested on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "storage/inspection_values.h"
#include "tests/storage/result_store_fixture.h"
#include "tests/support/registered.h"
#include "tests/support/rows_of_m1.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class ValueReads : public ResultStoreTest<StoredInspections> {
 protected:
  // Of these holes, none of which was measured.
  static InspectionRow WithHoles(const std::vector<std::string>& names, const std::string& serial = "sn1") {
    InspectionRow row = New();
    row.blade_serial = serial;
    row.holes.clear();
    for (const std::string& name : names) {
      row.holes.push_back(sixpoint::testing::SampleInspection().holes[1]);
      row.holes.back().hole_name = name;
    }
    return row;
  }
  // The same hole measured: its position is in, its inclination is out.
  static void Measure(InspectionHoleRow* hole) {
    hole->verdict = hole->inclination_verdict = "NOT_CONFORM";
    hole->position_verdict = "CONFORM";
    hole->reason.clear();
    hole->measured = InspectionHoleRow::Measured{0.02, 1.5, 10, 0.25, {1, 2, 3}, {0, 0, 1}, 0.4};
  }
  static std::vector<HoleValuesRow> Read(const ValueReader& reader, ValueFilter filter = {}, std::int64_t before = 0,
                                         int inspection_limit = 10) {
    filter.reader = Reader::Everything();
    const auto values = reader.Values(filter, before, inspection_limit, Soon());
    EXPECT_TRUE(values.ok()) << values.status();
    return values.value_or(std::vector<HoleValuesRow>());
  }
  // "2 H1": the hole, and at which place its inspection is among those.
  static std::vector<std::string> Told(const std::vector<HoleValuesRow>& values,
                                       const std::vector<InspectionRow>& inspections) {
    std::vector<std::string> told;
    for (const HoleValuesRow& value : values)
      for (std::size_t i = 0; i < inspections.size(); ++i)
        if (inspections[i].inspection_id == value.inspection_id)
          told.push_back(std::to_string(i) + " " + value.hole_name);
    return told;
  }
  // Each test runs on both.
  static void OnBothReaders(const std::function<void(InspectionStore& store, const ValueReader& reader)>& test) {
    {
      SCOPED_TRACE("the fake");
      const auto inspections = std::make_shared<sixpoint::testing::FakeInspections>();
      test(*inspections, sixpoint::testing::FakeValues(inspections));
    }
    SCOPED_TRACE("PostgreSQL");
    sixpoint::testing::JudgedPlant plant;
    Transaction transaction = sixpoint::testing::Must(plant.database.database()->Begin(Soon()));
    for (const char* serial : {"sn2", "other1"}) sixpoint::testing::RegisterBlade(transaction, serial, "p1");
    sixpoint::testing::Must(transaction.Commit());
    test(*InspectionsIn(plant.database.database()), *ValuesIn(plant.database.database()));
  }
};

TEST_F(ValueReads, AHoleIsToldAsItWasRecordedWithWhatItsInspectionSays) {
  OnBothReaders([](InspectionStore& store, const ValueReader& reader) {
    InspectionRow row = WithHoles({"H2", "H1"});
    Measure(&row.holes[0]);
    const auto recorded = Record(store, row);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const std::vector<HoleValuesRow> values = Read(reader);
    ASSERT_THAT(values, SizeIs(2));
    const HoleValuesRow &measured = values[0], &not_measured = values[1];
    EXPECT_EQ(measured.sequence, recorded->recorded.sequence);
    EXPECT_EQ(measured.recorded_at, recorded->recorded.recorded_at);
    EXPECT_EQ(measured.inspection_id, row.inspection_id);
    EXPECT_EQ(measured.blade_serial, "sn1");
    EXPECT_EQ(measured.machine_id, "m1");
    EXPECT_EQ(measured.machine_revision, 1);
    EXPECT_EQ(measured.part_id, "p1");
    EXPECT_EQ(measured.part_revision, 1);
    EXPECT_EQ(measured.method, "SIX_POINT");
    EXPECT_EQ(measured.group_name, "G1");
    EXPECT_EQ(measured.hole_name, "H2");
    EXPECT_EQ(measured.position_verdict, "CONFORM");
    EXPECT_EQ(measured.inclination_verdict, "NOT_CONFORM");
    EXPECT_EQ(measured.position_error_mm, 0.02);
    EXPECT_EQ(measured.inclination_error_deg, 1.5);
    EXPECT_EQ(measured.position_expanded_uncertainty_um, 10);
    EXPECT_EQ(measured.inclination_expanded_uncertainty_deg, 0.25);
    EXPECT_EQ(measured.position_tolerance_mm, 0.1);
    EXPECT_EQ(measured.inclination_tolerance_deg, 1);
    EXPECT_EQ(not_measured.hole_name, "H1");
    EXPECT_EQ(not_measured.position_verdict, "NOT_MEASURED");
    EXPECT_FALSE(not_measured.position_error_mm || not_measured.inclination_error_deg ||
                 not_measured.position_expanded_uncertainty_um || not_measured.inclination_expanded_uncertainty_deg);
    EXPECT_EQ(not_measured.position_tolerance_mm, 0.1);
  });
}

TEST_F(ValueReads, TheLimitIsOfInspectionsAndThoseOfNoHoleCount) {
  OnBothReaders([](InspectionStore& store, const ValueReader& reader) {
    const std::vector<InspectionRow> rows = {WithHoles({"H1", "H2"}), WithHoles({}), WithHoles({"H1", "H2"})};
    std::vector<std::int64_t> sequences;
    for (const InspectionRow& row : rows) {
      const auto recorded = Record(store, row);
      ASSERT_TRUE(recorded.ok()) << recorded.status();
      sequences.push_back(recorded->recorded.sequence);
    }
    EXPECT_THAT(Told(Read(reader), rows), ElementsAre("2 H1", "2 H2", "0 H1", "0 H2"));
    EXPECT_THAT(Told(Read(reader, {}, 0, 1), rows), ElementsAre("2 H1", "2 H2"));
    EXPECT_THAT(Told(Read(reader, {}, 0, 2), rows), ElementsAre("2 H1", "2 H2"));
    EXPECT_THAT(Told(Read(reader, {}, sequences[2]), rows), ElementsAre("0 H1", "0 H2"));
    EXPECT_THAT(Read(reader, {}, sequences[2], 1), IsEmpty());
    EXPECT_THAT(Read(reader, {}, sequences[0]), IsEmpty());
  });
}

TEST_F(ValueReads, OfOneHoleOnlyInspectionsThatHaveItCount) {
  OnBothReaders([](InspectionStore& store, const ValueReader& reader) {
    const std::vector<InspectionRow> rows = {WithHoles({"H1", "H2"}), WithHoles({"H1"}), WithHoles({"H2", "H1"})};
    for (const InspectionRow& row : rows) ASSERT_TRUE(Record(store, row).ok());
    ValueFilter filter;
    filter.group_name = "G1";
    filter.hole_name = "H2";
    EXPECT_THAT(Told(Read(reader, filter), rows), ElementsAre("2 H2", "0 H2"));
    EXPECT_THAT(Told(Read(reader, filter, 0, 2), rows), ElementsAre("2 H2", "0 H2"));
    EXPECT_THAT(Told(Read(reader, filter, 0, 1), rows), ElementsAre("2 H2"));
    filter.group_name = "G2";
    EXPECT_THAT(Read(reader, filter), IsEmpty());
  });
}

TEST_F(ValueReads, ListsByWhatIsAskedFor) {
  OnBothReaders([](InspectionStore& store, const ValueReader& reader) {
    const std::vector<InspectionRow> rows = {WithHoles({"H1"}), WithHoles({"H1"}, "sn2"), WithHoles({"H1"}, "other1")};
    std::vector<Recorded> recorded;
    for (const InspectionRow& row : rows) {
      const auto kept = Record(store, row);
      ASSERT_TRUE(kept.ok()) << kept.status();
      recorded.push_back(kept->recorded);
    }
    const auto by = [&](std::string ValueFilter::*member, const std::string& word) {
      ValueFilter filter;
      filter.*member = word;
      return Told(Read(reader, filter), rows);
    };
    using F = ValueFilter;
    for (const std::string& rests_on : {rows[0].sensor_calibration_id, rows[0].rotation_calibration_id})
      EXPECT_THAT(by(&F::calibration_id, rests_on), SizeIs(3)) << rests_on;
    EXPECT_THAT(by(&F::calibration_id, rows[0].inspection_id), IsEmpty());
    EXPECT_THAT(by(&F::blade_serial, "sn2"), ElementsAre("1 H1"));
    EXPECT_THAT(by(&F::blade_serial, "sn"), IsEmpty());
    EXPECT_THAT(by(&F::serial_prefix, "sn"), ElementsAre("1 H1", "0 H1"));
    EXPECT_THAT(by(&F::serial_prefix, "sn2"), ElementsAre("1 H1"));
    EXPECT_THAT(by(&F::serial_prefix, "%"), IsEmpty());
    for (const auto& [member, is] :
         {std::pair(&F::part_id, "p1"), std::pair(&F::machine_id, "m1"), std::pair(&F::verdict, "NOT_MEASURED")}) {
      EXPECT_THAT(by(member, is), SizeIs(3)) << is;
      EXPECT_THAT(by(member, "another"), IsEmpty()) << is;
    }
    ValueFilter span;
    span.recorded = {recorded[2].recorded_at, recorded[2].recorded_at + std::chrono::microseconds(1)};
    EXPECT_THAT(Told(Read(reader, span), rows), ::testing::Contains("2 H1"));
    span.recorded = {recorded[2].recorded_at + std::chrono::microseconds(1), std::nullopt};
    EXPECT_THAT(Read(reader, span), IsEmpty());
  });
}

// Whatever else is asked for: an older one does not stand for it.
TEST_F(ValueReads, TheNewestOfABladeIsTheNewestOfAllItHas) {
  OnBothReaders([](InspectionStore& store, const ValueReader& reader) {
    std::vector<InspectionRow> rows = {WithHoles({"H1"}), WithHoles({"H1"}, "sn2"), WithHoles({"H1"})};
    rows[0].verdict = "UNDECIDABLE";
    for (const InspectionRow& row : rows) ASSERT_TRUE(Record(store, row).ok());
    ValueFilter filter;
    filter.only_newest = true;
    EXPECT_THAT(Told(Read(reader, filter), rows), ElementsAre("2 H1", "1 H1"));
    filter.verdict = "UNDECIDABLE";
    EXPECT_THAT(Read(reader, filter), IsEmpty());
    filter.only_newest = false;
    EXPECT_THAT(Told(Read(reader, filter), rows), ElementsAre("0 H1"));
  });
}

// Of the real one alone: that an axis' table was applied is told by the registration, which fakes of other results do not know.
TEST_F(ValueReads, WhatRestsOnAnAxisTableIsFoundByIt) {
  sixpoint::testing::JudgedPlant plant;
  Database* const database = plant.database.database();
  plant.Characterise(false, {0, 0.001}, {0, 0.001}, 0.0001);
  RegistrationRow registration = StoredRegistrations::Make();
  registration.registration_id = NewUuid();
  RegistrationAngleRow& angle = registration.angles.emplace_back();
  angle.axis = plant.plant.machine.kinematics().part_side(0).axis();
  angle.characterisation_id = sixpoint::testing::IdOf(sixpoint::testing::kACharacterisation);
  const RecordEntry entry =
      sixpoint::testing::EntryOfM1("registrations/" + registration.registration_id, {}, registration.blade_serial);
  const auto registered = RegistrationsIn(database)->Record({"area.Call", "", ""}, registration, entry, Soon());
  ASSERT_TRUE(registered.ok()) << registered.status();
  const std::shared_ptr<InspectionStore> store = InspectionsIn(database);
  std::vector<InspectionRow> rows = {WithHoles({"H1"}), WithHoles({"H1"})};
  rows[1].registration_id = registration.registration_id;
  for (const InspectionRow& row : rows) ASSERT_TRUE(Record(*store, row).ok());
  ValueFilter filter;
  filter.calibration_id = angle.characterisation_id;
  EXPECT_THAT(Told(Read(*ValuesIn(database), filter), rows), ElementsAre("1 H1"));
  InspectionFilter of_inspections;
  of_inspections.calibration_id = angle.characterisation_id;
  of_inspections.reader = Reader::Everything();
  const auto listed = store->List(of_inspections, 0, 10, Soon());
  ASSERT_TRUE(listed.ok()) << listed.status();
  ASSERT_THAT(*listed, SizeIs(1));
  EXPECT_EQ((*listed)[0].inspection_id, rows[1].inspection_id);
}

// Of the real one alone.
TEST_F(ValueReads, WhoIsNotClearedSeesNoValueOfACustomersPart) {
  sixpoint::testing::ThrowawayDatabase database;
  const auto calibrations = sixpoint::testing::PutCalibratedMachine(database.database());
  for (const char* word : {"open", "acme"}) {
    const auto part =
        sixpoint::testing::PutCustomersPart(database.database(), word, word == std::string("acme"), calibrations);
    InspectionRow row = sixpoint::testing::ResultOf(
        sixpoint::testing::IdOf(part.part), sixpoint::testing::IdOf(part.blade), calibrations, WithHoles({"H1"}));
    row.registration_id = sixpoint::testing::IdOf(part.registration);
    row.scan_ids = {sixpoint::testing::IdOf(part.scan)};
    const RecordEntry entry =
        sixpoint::testing::EntryOfM1("inspections/" + row.inspection_id, {part.registration}, row.blade_serial);
    const auto recorded = InspectionsIn(database.database())->Record({"area.Call", "", ""}, row, entry, Soon());
    ASSERT_TRUE(recorded.ok()) << recorded.status();
  }
  const auto seen_by_jane = [&](const std::string& hole) {
    ValueFilter filter;
    filter.reader = Reader{"users/jane", false};
    if (!hole.empty()) filter.group_name = "G1";
    filter.hole_name = hole;
    const auto values = ValuesIn(database.database())->Values(filter, 0, 10, Soon());
    EXPECT_TRUE(values.ok()) << values.status();
    std::vector<std::string> blades;
    if (values.ok())
      for (const HoleValuesRow& value : *values) blades.push_back(value.blade_serial);
    return blades;
  };
  for (const char* hole : {"", "H1"}) EXPECT_THAT(seen_by_jane(hole), ElementsAre("open-sn")) << hole;
  sixpoint::testing::Clear(database.database(), "users/jane", "customers/acme");
  for (const char* hole : {"", "H1"}) EXPECT_THAT(seen_by_jane(hole), ElementsAre("acme-sn", "open-sn")) << hole;
}

}  // namespace
}  // namespace sixpoint::storage
