// Cut beside predicted, from a real PostgreSQL, with the rights that the inspection service has.
#include "storage/outcomes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/support/cut_blades.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::AsRole;
using sixpoint::testing::CutBlade;
using sixpoint::testing::CutBlades;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class OutcomesTest : public ::testing::Test {
 protected:
  Outcomes Read(OutcomeFilter filter = {}, int most_blades = 10) {
    if (filter.machine_id.empty()) filter.machine_id = "m1";
    if (filter.reader.identity.empty()) filter.reader = Reader::Everything();
    const auto read = reader_->Read(filter, most_blades, Soon());
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? *read : Outcomes{};
  }
  CutBlades plant_;
  std::unique_ptr<Database> as_inspection_ = Database::Open(AsRole(plant_.database.conninfo(), "inspection"), 1);
  std::shared_ptr<OutcomeReader> reader_ = OutcomesIn(as_inspection_.get());
};

TEST_F(OutcomesTest, PutsAHoleAsFoundBesideAsPredicted) {
  CutBlade blade{"SN-1", {0.03, 0, 0}};
  blade.reported = true;
  const CutBlades::Names names = plant_.Cut(blade);
  const Outcomes outcomes = Read();
  ASSERT_THAT(outcomes.blades, SizeIs(1));
  EXPECT_EQ(outcomes.blades[0].inspection_id, names.inspection);
  EXPECT_EQ(outcomes.blades[0].inspection_count, 1);
  EXPECT_FALSE(outcomes.blades[0].is_withdrawn || outcomes.blades[0].is_open || outcomes.is_cut_off);
  ASSERT_THAT(outcomes.holes, SizeIs(4));
  const OutcomeHoleRow& hole = outcomes.holes[3];
  EXPECT_EQ(hole.group_name + "/" + hole.hole_name, "G2/H2");
  EXPECT_EQ(hole.correction_id, names.correction);
  EXPECT_TRUE(hole.is_cut_reported);
  EXPECT_THAT(hole.predicted_start_mm, ElementsAre(10, 5, 20));
  // Part of Ry(20 deg) Rx(-30 deg): machine X is (cos 20, ..) in the part.
  EXPECT_NEAR(hole.found_start_mm[0] - 10, 0.03 * 0.9396926, 1e-8);
  EXPECT_EQ(hole.a_deg, 20);
  EXPECT_EQ(hole.b_deg, -30);
  EXPECT_THAT(hole.zero_from_part, SizeIs(12));
  EXPECT_THAT(hole.budget_um, ElementsAre(4, 3));
  EXPECT_THAT(hole.budget_sources, ElementsAre("points of the pin", "sensor calibration"));
  ASSERT_THAT(outcomes.calibrations, SizeIs(2));
  for (const OutcomeCalibrationRow& calibration : outcomes.calibrations) EXPECT_EQ(calibration.state, "IN_FORCE");
  EXPECT_EQ(outcomes.newest_machine_revision, 1);
}

TEST_F(OutcomesTest, OfABladeTheNewestInspectionCounts) {
  plant_.Cut({"SN-1", {0.03, 0, 0}});
  const std::string anew = plant_.InspectAnew({"SN-1", {0.05, 0, 0}});
  const Outcomes outcomes = Read();
  ASSERT_THAT(outcomes.blades, SizeIs(1));
  EXPECT_EQ(outcomes.blades[0].inspection_id, anew);
  EXPECT_EQ(outcomes.blades[0].inspection_count, 2);
  ASSERT_THAT(outcomes.holes, SizeIs(4));
  EXPECT_NEAR(outcomes.holes[0].found_start_mm[0], 0.05, 1e-9);
}

// A draft that nobody released cut nothing, unless the machine reported that it did; a correction after the pins were scanned neither.
TEST_F(OutcomesTest, AHoleIsOfTheProgramThatCanHaveCutIt) {
  CutBlade draft{"SN-1"};
  draft.let_go = false;
  plant_.Cut(draft);
  EXPECT_THAT(Read().holes, IsEmpty());
  ASSERT_THAT(Read().blades, SizeIs(1));
  draft.serial = "SN-2";
  draft.reported = true;
  const std::string reported = plant_.Cut(draft).correction;
  const CutBlades::Names once = plant_.Cut({"SN-3"});
  CutBlade later{"SN-3"};
  later.inspected = false;
  plant_.Cut(later);
  std::set<std::string> corrections;
  for (const OutcomeHoleRow& hole : Read().holes) corrections.insert(hole.correction_id);
  EXPECT_EQ(corrections, (std::set<std::string>{reported, once.correction}));
}

TEST_F(OutcomesTest, TellsWhatIsNotInspectedOpenOrWithdrawn) {
  CutBlade blade{"SN-1"};
  blade.inspected = false;
  plant_.Cut(blade);
  blade = {"SN-2"};
  blade.positioning_open = true;
  plant_.Cut(blade);
  blade = {"SN-3"};
  blade.measured = false;
  plant_.Cut(blade);
  Outcomes outcomes = Read();
  ASSERT_THAT(outcomes.blades, SizeIs(3));  // the newest first
  EXPECT_TRUE(outcomes.blades[2].inspection_id.empty());
  EXPECT_TRUE(outcomes.blades[1].is_open);
  EXPECT_THAT(outcomes.holes, SizeIs(4));  // of SN-3 none was measured
  plant_.Withdraw(plant_.calibrations().rotation);
  outcomes = Read();
  EXPECT_TRUE(outcomes.blades[0].is_withdrawn);
  EXPECT_TRUE(outcomes.holes[0].is_withdrawn);
  EXPECT_FALSE(outcomes.blades[2].is_withdrawn);
}

TEST_F(OutcomesTest, FiltersAndCutsOffByWholeBlades) {
  for (const char* serial : {"SN-1", "SN-2", "SN-3"}) plant_.Cut({serial});
  const std::string before = plant_.calibrations().rotation.substr(13);
  plant_.CalibrateAxesAnew();
  plant_.Cut({"SN-4"});
  OutcomeFilter filter;
  filter.calibration_id = before;
  EXPECT_THAT(Read(filter).holes, SizeIs(12));
  filter = {};
  filter.part_id = "another";
  EXPECT_THAT(Read(filter).blades, IsEmpty());
  filter = {};
  filter.machine_id = "another";
  EXPECT_THAT(Read(filter).blades, IsEmpty());
  filter = {};
  filter.corrected.from = Instant(std::chrono::seconds(3'900'000'000));
  EXPECT_THAT(Read(filter).blades, IsEmpty());
  EXPECT_FALSE(Read({}, 4).is_cut_off);
  const Outcomes two = Read({}, 2);
  EXPECT_TRUE(two.is_cut_off);
  ASSERT_THAT(two.blades, SizeIs(2));
  EXPECT_EQ(two.blades[0].blade_serial, "SN-4");
  EXPECT_THAT(two.holes, SizeIs(8));
}

TEST_F(OutcomesTest, WhoIsNotClearedSeesNothingOfACustomersPart) {
  const auto hidden =
      sixpoint::testing::PutCustomersPart(plant_.database.database(), "acme", true, plant_.calibrations());
  plant_.Cut({"SN-1"});
  OutcomeFilter filter;
  filter.reader = Reader{"users/jane", false};
  ASSERT_THAT(Read(filter).blades, SizeIs(1));
  EXPECT_EQ(Read(filter).blades[0].blade_serial, "SN-1");
  EXPECT_THAT(Read().blades, SizeIs(2));
  sixpoint::testing::Clear(plant_.database.database(), "users/jane", "customers/acme");
  EXPECT_THAT(Read(filter).blades, SizeIs(2));
}

}  // namespace
}  // namespace sixpoint::storage
