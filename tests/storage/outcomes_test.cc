// Cut beside predicted, from a real PostgreSQL, with the rights that the inspection service has, and from the fake that handlers are tested on.
#include "storage/outcomes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/cut_blades.h"
#include "tests/support/fake_outcomes.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::CutBlade;
using sixpoint::testing::CutBlades;
using sixpoint::testing::CutNames;
using sixpoint::testing::FakeOutcomes;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class OutcomesTest : public ::testing::Test {
 protected:
  static Outcomes Read(const OutcomeReader& reader, OutcomeFilter filter = {}, int most_blades = 10) {
    if (filter.machine_id.empty()) filter.machine_id = "m1";
    if (filter.reader.identity.empty()) filter.reader = Reader::Everything();
    const auto read = reader.Read(filter, most_blades, Soon());
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *read : Outcomes{};
  }
  // Each test runs on both: on the plant where blades are cut and what reads it.
  template <typename Test>
  static void OnBothPlants(const Test& test) {
    {
      SCOPED_TRACE("the fake");
      FakeOutcomes fake;
      test(fake, fake);
    }
    SCOPED_TRACE("PostgreSQL");
    CutBlades plant;
    const std::unique_ptr<Database> as_inspection = Database::Open(AsRole(plant.database.conninfo(), "inspection"), 1);
    test(plant, *OutcomesIn(as_inspection.get()));
  }
};

TEST_F(OutcomesTest, PutsAHoleAsFoundBesideAsPredicted) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    CutBlade blade{"SN-1", {0.03, 0, 0}};
    blade.reported = true;
    const CutNames names = plant.Cut(blade);
    const Outcomes outcomes = Read(reader);
    ASSERT_THAT(outcomes.blades, SizeIs(1));
    EXPECT_EQ(outcomes.blades[0].inspection_id, names.inspection);
    EXPECT_EQ(outcomes.blades[0].inspection_count, 1);
    EXPECT_FALSE(outcomes.blades[0].is_withdrawn || outcomes.blades[0].is_open || outcomes.is_cut_off);
    ASSERT_THAT(outcomes.holes, SizeIs(4));
    const OutcomeHoleRow& hole = outcomes.holes[3];
    EXPECT_EQ(hole.blade_serial, "SN-1");
    EXPECT_EQ(hole.group_name + "/" + hole.hole_name, "G2/H2");
    EXPECT_EQ(hole.correction_id, names.correction);
    EXPECT_EQ(hole.inspection_id, names.inspection);
    EXPECT_TRUE(hole.is_cut_reported);
    EXPECT_FALSE(hole.is_withdrawn);
    EXPECT_THAT(hole.predicted_start_mm, ElementsAre(10, 5, 20));
    // Part of Ry(20 deg) Rx(-30 deg): machine X is (cos 20, ..) in the part.
    EXPECT_NEAR(hole.found_start_mm[0] - 10, 0.03 * 0.9396926, 1e-8);
    EXPECT_EQ(hole.predicted_axis, hole.found_axis);
    EXPECT_EQ(hole.a_deg, 20);
    EXPECT_EQ(hole.b_deg, -30);
    EXPECT_EQ(hole.machine_revision, 1);
    EXPECT_THAT(hole.zero_from_part, ElementsAre(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0));
    EXPECT_EQ(hole.position_expanded_uncertainty_um, 10);
    EXPECT_EQ(hole.inclination_expanded_uncertainty_deg, 0.1);
    EXPECT_THAT(hole.budget_um, ElementsAre(4, 3));
    EXPECT_THAT(hole.budget_sources, ElementsAre("points of the pin", "sensor calibration"));
    EXPECT_EQ("calibrations/" + hole.sensor_calibration_id, plant.calibrations().sensor);
    EXPECT_EQ("calibrations/" + hole.rotation_calibration_id, plant.calibrations().rotation);
    ASSERT_THAT(outcomes.calibrations, SizeIs(2));
    for (const OutcomeCalibrationRow& calibration : outcomes.calibrations) {
      EXPECT_EQ(calibration.state, "IN_FORCE");
      const bool is_of_axes = "calibrations/" + calibration.calibration_id == plant.calibrations().rotation;
      for (const auto& three :
           {calibration.a_direction, calibration.a_point_mm, calibration.b_direction, calibration.b_point_mm})
        EXPECT_THAT(three, SizeIs(is_of_axes ? 3 : 0));
      if (!is_of_axes) continue;
      EXPECT_THAT(calibration.a_direction, ElementsAre(0, 1, 0));
      EXPECT_THAT(calibration.b_direction, ElementsAre(1, 0, 0));
      EXPECT_THAT(calibration.b_point_mm, ElementsAre(1, 2, 3));
    }
    EXPECT_EQ(outcomes.newest_machine_revision, 1);
  });
}

TEST_F(OutcomesTest, OfABladeTheNewestInspectionCounts) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    plant.Cut({"SN-1", {0.03, 0, 0}});
    const std::string anew = plant.InspectAnew({"SN-1", {0.05, 0, 0}});
    const Outcomes outcomes = Read(reader);
    ASSERT_THAT(outcomes.blades, SizeIs(1));
    EXPECT_EQ(outcomes.blades[0].inspection_id, anew);
    EXPECT_EQ(outcomes.blades[0].inspection_count, 2);
    ASSERT_THAT(outcomes.holes, SizeIs(4));
    EXPECT_NEAR(outcomes.holes[0].found_start_mm[0], 0.05, 1e-9);
  });
}

// A draft that nobody released cut nothing, unless the machine reported that it did; a correction after the pins were scanned neither.
TEST_F(OutcomesTest, AHoleIsOfTheProgramThatCanHaveCutIt) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    CutBlade draft{"SN-1"};
    draft.let_go = false;
    plant.Cut(draft);
    EXPECT_THAT(Read(reader).holes, IsEmpty());
    ASSERT_THAT(Read(reader).blades, SizeIs(1));
    draft.serial = "SN-2";
    draft.reported = true;
    const std::string reported = plant.Cut(draft).correction;
    const CutNames once = plant.Cut({"SN-3"});
    CutBlade later{"SN-3"};
    later.inspected = false;
    plant.Cut(later);
    std::set<std::string> corrections;
    for (const OutcomeHoleRow& hole : Read(reader).holes) corrections.insert(hole.correction_id);
    EXPECT_EQ(corrections, (std::set<std::string>{reported, once.correction}));
  });
}

// A report outweighs a newer program that was let go; of two that were let go the newer one counts.
TEST_F(OutcomesTest, WhatTheMachineReportedCountsBeforeWhatIsNewer) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    CutBlade reported{"SN-1"};
    reported.reported = true;
    reported.inspected = false;
    const std::string cut = plant.Cut(reported).correction;
    plant.Cut({"SN-1"});
    CutBlade older{"SN-2"};
    older.inspected = false;
    plant.Cut(older);
    const std::string newer = plant.Cut({"SN-2"}).correction;
    std::map<std::string, std::set<std::string>> corrections;  // by blade
    for (const OutcomeHoleRow& hole : Read(reader).holes) corrections[hole.blade_serial].insert(hole.correction_id);
    EXPECT_THAT(corrections["SN-1"], ElementsAre(cut));
    EXPECT_THAT(corrections["SN-2"], ElementsAre(newer));
  });
}

TEST_F(OutcomesTest, TellsWhatIsNotInspectedOpenOrWithdrawn) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    CutBlade blade{"SN-1"};
    blade.inspected = false;
    plant.Cut(blade);
    blade = {"SN-2"};
    blade.positioning_open = true;
    plant.Cut(blade);
    blade = {"SN-3"};
    blade.measured = false;
    plant.Cut(blade);
    Outcomes outcomes = Read(reader);
    ASSERT_THAT(outcomes.blades, SizeIs(3));  // the newest first
    EXPECT_TRUE(outcomes.blades[2].inspection_id.empty());
    EXPECT_TRUE(outcomes.blades[1].is_open);
    EXPECT_THAT(outcomes.holes, SizeIs(4));  // of SN-3 none was measured
    plant.Withdraw(plant.calibrations().rotation);
    outcomes = Read(reader);
    EXPECT_TRUE(outcomes.blades[0].is_withdrawn);
    EXPECT_TRUE(outcomes.holes[0].is_withdrawn);
    EXPECT_FALSE(outcomes.blades[2].is_withdrawn);
  });
}

TEST_F(OutcomesTest, ACalibrationHasItsStateOfNow) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    const std::string sensor = plant.calibrations().sensor, first = plant.calibrations().rotation;
    plant.Cut({"SN-1"});
    plant.CalibrateAxesAnew();
    const std::string second = plant.calibrations().rotation;
    plant.Cut({"SN-2"});
    const auto states = [&] {
      std::map<std::string, std::string> by_name;
      for (const OutcomeCalibrationRow& row : Read(reader).calibrations)
        by_name["calibrations/" + row.calibration_id] = row.state;
      return by_name;
    };
    using States = std::map<std::string, std::string>;
    EXPECT_EQ(states(), (States{{sensor, "IN_FORCE"}, {first, "SUPERSEDED"}, {second, "IN_FORCE"}}));
    plant.Withdraw(second);
    EXPECT_EQ(states(), (States{{sensor, "IN_FORCE"}, {first, "IN_FORCE"}, {second, "WITHDRAWN"}}));
  });
}

TEST_F(OutcomesTest, FiltersAndCutsOffByWholeBlades) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    for (const char* serial : {"SN-1", "SN-2", "SN-3"}) plant.Cut({serial});
    const std::string before = plant.calibrations().rotation.substr(13);
    plant.CalibrateAxesAnew();
    plant.Cut({"SN-4"});
    OutcomeFilter filter;
    filter.calibration_id = before;
    EXPECT_THAT(Read(reader, filter).holes, SizeIs(12));
    filter = {};
    filter.part_id = "another";
    EXPECT_THAT(Read(reader, filter).blades, IsEmpty());
    filter = {};
    filter.machine_id = "another";
    EXPECT_THAT(Read(reader, filter).blades, IsEmpty());
    filter = {};
    filter.corrected.from = Instant(std::chrono::seconds(3'900'000'000));
    EXPECT_THAT(Read(reader, filter).blades, IsEmpty());
    EXPECT_FALSE(Read(reader, {}, 4).is_cut_off);
    const Outcomes two = Read(reader, {}, 2);
    EXPECT_TRUE(two.is_cut_off);
    ASSERT_THAT(two.blades, SizeIs(2));
    EXPECT_EQ(two.blades[0].blade_serial, "SN-4");
    EXPECT_THAT(two.holes, SizeIs(8));
  });
}

// As many corrections are looked at as five for each blade that is asked for.
TEST_F(OutcomesTest, ABladeThatWasCorrectedOftenCutsTheListOff) {
  OnBothPlants([](auto& plant, const OutcomeReader& reader) {
    plant.Cut({"SN-1"});
    CutBlade again{"SN-2"};
    again.inspected = false;
    for (int i = 0; i < 4; ++i) plant.Cut(again);
    EXPECT_FALSE(Read(reader, {}, 2).is_cut_off);
    EXPECT_THAT(Read(reader, {}, 2).blades, SizeIs(2));
    again.serial = "SN-1";
    for (int i = 0; i < 5; ++i) plant.Cut(again);
    EXPECT_TRUE(Read(reader, {}, 2).is_cut_off);
    EXPECT_THAT(Read(reader, {}, 1).blades, SizeIs(1));
    EXPECT_TRUE(Read(reader, {}, 1).is_cut_off);
  });
}

// Of the real one alone.
TEST_F(OutcomesTest, WhoIsNotClearedSeesNothingOfACustomersPart) {
  CutBlades plant;
  const std::unique_ptr<Database> as_inspection = Database::Open(AsRole(plant.database.conninfo(), "inspection"), 1);
  const std::shared_ptr<OutcomeReader> reader = OutcomesIn(as_inspection.get());
  const auto hidden =
      sixpoint::testing::PutCustomersPart(plant.database.database(), "acme", true, plant.calibrations());
  plant.Cut({"SN-1"});
  OutcomeFilter filter;
  filter.reader = Reader{"users/jane", false};
  ASSERT_THAT(Read(*reader, filter).blades, SizeIs(1));
  EXPECT_EQ(Read(*reader, filter).blades[0].blade_serial, "SN-1");
  EXPECT_THAT(Read(*reader).blades, SizeIs(2));
  sixpoint::testing::Clear(plant.database.database(), "users/jane", "customers/acme");
  EXPECT_THAT(Read(*reader, filter).blades, SizeIs(2));
}

}  // namespace
}  // namespace sixpoint::storage
