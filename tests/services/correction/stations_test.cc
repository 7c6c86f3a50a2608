// What a correction makes of a registration at a station of a fixture. No PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metrology/frames/angles.h"
#include "services/correction/correct.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "tests/services/correction/stand_ins.h"

namespace sixpoint::correction {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using metrology::kRadPerDeg;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class StationsTest : public ::testing::Test {
 protected:
  StationsTest() {
    own_ = *runtime::FromProto("part", plant_.plant.part.zero_from_part_nominal());
    AddStation("beside", own_ * Eigen::Translation3d(60, 0, 0));
    AddStation("turned", Isometry3d(Eigen::AngleAxisd(-35 * kRadPerDeg, Vector3d::UnitX())) * own_);
  }
  void AddStation(const std::string& name, const Isometry3d& nominal) {
    plant::v1::Station& station = *plant_.plant.part.add_stations();
    station.set_station(name);
    station.set_capture_mm(5);
    runtime::ToProto(nominal, station.mutable_zero_from_part_nominal());
  }
  // Of a blade that stands as its nominal there, but for a tenth of a millimetre and a degree.
  absl::StatusOr<Inputs> RegisteredAt(const std::string& station, const Isometry3d& nominal) {
    metrology::Vector6d off;
    off << kRadPerDeg / 10, 0, 0, 0.1, 0, 0;
    registration::v1::Registration& registration = plant_.registration.registration;
    registration.set_station(station);
    runtime::ToProto(metrology::Perturbed(nominal, off, nominal.translation()), registration.mutable_zero_from_part());
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    return FetchInputs(peers_, request, Caller());
  }
  static runtime::Caller Caller() {
    runtime::Caller caller;
    caller.make_context = caller.make_own_context = [] { return runtime::ContextFor(30); };
    return caller;
  }
  Isometry3d NominalOf(int i) const {
    return *runtime::FromProto("station", plant_.plant.part.stations(i).zero_from_part_nominal());
  }

  testing::StandIns plant_;
  clients::BladePeers peers_{plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()};
  Isometry3d own_;
};

// The part's own angles where the station is not turned; where it is, those that point the nominal part's holes to the tool, near the part's
// own: 35 degrees about X, which B turns back.
TEST_F(StationsTest, NominalAnglesAreThoseOfTheNominalPartThere) {
  const plant::v1::HoleGroup& group = plant_.plant.part.hole_groups(0);
  const auto beside = RegisteredAt("beside", NominalOf(0));
  ASSERT_TRUE(beside.ok()) << beside.status();
  EXPECT_EQ(beside->groups[0].nominal.a_rad, group.a_nominal_deg() * kRadPerDeg);
  EXPECT_EQ(beside->groups[0].nominal.b_rad, group.b_nominal_deg() * kRadPerDeg);
  EXPECT_EQ(beside->zero_from_part_nominal.matrix(), NominalOf(0).matrix());

  const auto turned = RegisteredAt("turned", NominalOf(1));
  ASSERT_TRUE(turned.ok()) << turned.status();
  const metrology::RotaryAngles& nominal = turned->groups[0].nominal;
  const Vector3d direction = NominalOf(1).linear() * turned->groups[0].axis_in_part;
  EXPECT_LT(metrology::TiltOf(turned->machine_axes.nominal, direction, nominal), 1e-9);
  // The part's are stated to a degree.
  EXPECT_NEAR(nominal.a_rad / kRadPerDeg, group.a_nominal_deg(), 1);
  EXPECT_NEAR(nominal.b_rad / kRadPerDeg, group.b_nominal_deg() + 35, 1);
}

// A blade that stands a tenth off there is a tenth off, however far the station is from the part's own place.
TEST_F(StationsTest, ShiftsAreToldAgainstTheNominalPartThere) {
  for (int i = 0; i < 2; ++i) {
    const auto inputs = RegisteredAt(plant_.plant.part.stations(i).station(), NominalOf(i));
    ASSERT_TRUE(inputs.ok()) << inputs.status();
    const auto corrected = CorrectBlade(*inputs, nullptr);
    ASSERT_TRUE(corrected.ok()) << corrected.status();
    const metrology::CorrectedHoleGroup& group = corrected->groups[0];
    double greatest_mm = 0;
    for (const metrology::CorrectedHole& hole : group.holes)
      greatest_mm = std::max(greatest_mm, (hole.start_mm - hole.nominal_start_mm).norm());
    std::printf("%s: starts at most %.3f mm from the nominal, A %.3f and B %.3f deg\n",
                plant_.plant.part.stations(i).station().c_str(), greatest_mm,
                (group.corrected.a_rad - group.nominal.a_rad) / kRadPerDeg,
                (group.corrected.b_rad - group.nominal.b_rad) / kRadPerDeg);
    // 0.1 mm, and 0.1 degrees with what the part's own angles are rounded by, on levers of some ten millimetres from the axes.
    EXPECT_LT(greatest_mm, 2);
    EXPECT_LT(std::abs(group.corrected.a_rad - group.nominal.a_rad), 1.2 * kRadPerDeg);
    EXPECT_LT(std::abs(group.corrected.b_rad - group.nominal.b_rad), 1.2 * kRadPerDeg);
  }
}

// B reaches to 100 degrees.
TEST_F(StationsTest, AStationAtWhichTheNominalHolesAreOutOfReachIsSaid) {
  AddStation("behind", Isometry3d(Eigen::AngleAxisd(-150 * kRadPerDeg, Vector3d::UnitX())) * own_);
  const auto inputs = RegisteredAt("behind", own_);
  EXPECT_EQ(runtime::ReasonOf(inputs.status()), "POSE_OUT_OF_LIMITS") << inputs.status();
  EXPECT_THAT(std::string(inputs.status().message()), HasSubstr("group G1, nominally at station behind: "));
}

// Another blade at another station of the same fixture stands beside this one. Elsewhere, or at the same station, it stands in its place.
TEST_F(StationsTest, ABladeAtAnotherStationSpeaksNotAgainstTheClamping) {
  registration::v1::Registration& now = plant_.registration.registration;
  now.set_station("beside");
  now.set_clamping("7");
  registration::v1::Registration later = now;
  later.set_name("registrations/later");
  later.set_record_sequence(2);
  const auto against = [&](const std::string& blade, const std::string& station, const std::string& clamping,
                           const std::string& part = "parts/p1", const std::string& machine = "machines/m1") {
    later.set_blade(blade);
    later.set_station(station);
    later.set_clamping(clamping);
    later.set_part(part);
    later.set_machine(machine);
    plant_.registration.later = {later};
    const auto found = AgainstClamping(peers_, now, Caller());
    EXPECT_TRUE(found.ok()) << found.status();
    return *found;
  };
  const std::string& blade = now.blade();
  EXPECT_THAT(against("blades/sn2", "turned", "7"), IsEmpty());
  EXPECT_THAT(against("blades/sn2", "turned", ""), IsEmpty());
  EXPECT_THAT(against(blade, "beside", "7"), IsEmpty());  // measured again
  EXPECT_THAT(against("blades/sn2", "turned", "8"), ElementsAre("registrations/later"));
  EXPECT_THAT(against("blades/sn2", "beside", "7"), ElementsAre("registrations/later"));  // swapped
  EXPECT_THAT(against("blades/sn2", "", "7"), ElementsAre("registrations/later"));
  EXPECT_THAT(against("blades/sn2", "turned", "7", "parts/p2"), ElementsAre("a registration of another part"));
  EXPECT_FALSE(against(blade, "turned", "7").empty());  // moved
  EXPECT_THAT(against(blade, "beside", "7", "parts/p1", "machines/m2"), ElementsAre("registrations/later"));
}

}  // namespace
}  // namespace sixpoint::correction
