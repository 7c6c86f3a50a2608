#include "services/plant/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/services/plant/sample_registry.h"

namespace sixpoint::plant {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <typename Request>
std::string Refusal(const Request& request) {
  const auto row = Validated(request);
  if (row.ok()) return "accepted";
  EXPECT_EQ(row.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(row.status().message()), HasSubstr(", want "));
  return std::string(row.status().message());
}

template <typename Request>
struct Case {
  std::function<void(Request*)> spoil;
  const char* message;
};

template <typename Request>
void ExpectRefusals(const Request& good, const std::vector<Case<Request>>& cases) {
  ASSERT_EQ(Refusal(good), "accepted");
  for (const Case<Request>& c : cases) {
    Request bad = good;
    c.spoil(&bad);
    EXPECT_THAT(Refusal(bad), HasSubstr(c.message));
  }
}

v1::Joint* Joint(v1::CreateMachineRequest* r) {
  return r->mutable_machine()->mutable_kinematics()->mutable_part_side(0);
}

TEST(ValidatedMachine, RefusalsNameTheField) {
  using Request = v1::CreateMachineRequest;
  ExpectRefusals<Request>(
      SampleMachine(),
      {
          {[](Request* r) { r->set_machine_id(""); }, "machine_id"},
          {[](Request* r) { r->set_machine_id("a/b"); }, "machine_id: a/b"},
          {[](Request* r) { Joint(r)->set_axis("W"); }, "kinematics.part_side[0].axis: W"},
          {[](Request* r) { Joint(r)->set_axis("B"); }, "part_side[1].axis: B"},
          {[](Request* r) { Joint(r)->set_kind(v1::JOINT_KIND_UNSPECIFIED); }, "part_side[0].kind"},
          {[](Request* r) { Joint(r)->mutable_direction()->set_y(1.001); }, "part_side[0].direction"},
          {[](Request* r) { Joint(r)->mutable_direction()->set_y(kNan); }, "part_side[0].direction.y"},
          {[](Request* r) { Joint(r)->clear_direction(); }, "part_side[0].direction"},
          {[](Request* r) { Joint(r)->clear_point_mm(); }, "part_side[0].point_mm"},
          {[](Request* r) { Joint(r)->set_sign(0); }, "part_side[0].sign: 0"},
          {[](Request* r) { Joint(r)->set_minimum(100); }, "part_side[0].maximum: 100"},
          {[](Request* r) { Joint(r)->set_maximum(kInfinity); }, "part_side[0].maximum"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_noise_um(0); }, "sensor.noise_um: 0"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_range_mm(kNan); }, "sensor.range_mm"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_column_count(-1); }, "sensor.column_count: -1"},
          {[](Request* r) { r->mutable_machine()->clear_nominal_centre_mm(); }, "machine.nominal_centre_mm"},
          {[](Request* r) { r->mutable_machine()->mutable_safety_envelope()->set_rotation_deg(-1); },
           "safety_envelope.rotation_deg: -1"},
          {[](Request* r) { r->mutable_machine()->mutable_safety_envelope()->set_interim_check_limit_um(0); },
           "machine.safety_envelope.interim_check_limit_um: 0, want > 0 and <= 1000"},
          {[](Request* r) { r->mutable_machine()->mutable_error_sources()->set_tool_offset_um(-1); },
           "machine.error_sources.tool_offset_um: -1, want > 0 and <= 1000"},
          {[](Request* r) { r->mutable_machine()->mutable_error_sources()->set_squareness_um_per_m(20000); },
           "machine.error_sources.squareness_um_per_m: 20000"},
          {[](Request* r) { r->mutable_machine()->mutable_error_sources()->set_temperature_half_range_k(31); },
           "machine.error_sources.temperature_half_range_k: 31"},
          {[](Request* r) {
             r->mutable_machine()
                 ->mutable_error_sources()
                 ->mutable_scale_expansion()
                 ->clear_standard_uncertainty_um_per_m_k();
           },
           "machine.error_sources.scale_expansion.standard_uncertainty_um_per_m_k: 0"},
          {[](Request* r) {
             r->mutable_machine()->mutable_kinematics()->mutable_part_side(0)->set_positioning_standard_uncertainty_deg(
                 0);
           },
           "machine.kinematics.part_side[0].positioning_standard_uncertainty_deg: 0, want > 0"},
          {[](Request* r) {
             r->mutable_machine()->mutable_kinematics()->mutable_tool_side(0)->set_positioning_standard_uncertainty_deg(
                 1);
           },
           "machine.kinematics.tool_side[0].positioning_standard_uncertainty_deg: 1, want none"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_kind(static_cast<v1::SensorKind>(9)); },
           "machine.sensor.kind: 9, want LINE, SNAPSHOT or none"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_column_count(0); },
           "machine.sensor.column_count: 0, want > 0"},
          {[](Request* r) { r->mutable_machine()->mutable_sensor()->set_kind(v1::SENSOR_KIND_SNAPSHOT); },
           "machine.sensor.column_count: "},
          {[](Request* r) {
             r->mutable_machine()->mutable_sensor()->set_kind(v1::SENSOR_KIND_SNAPSHOT);
             r->mutable_machine()->mutable_sensor()->set_column_count(0);
             r->mutable_machine()->mutable_safety_envelope()->set_interim_check_limit_um(20);
           },
           "machine.safety_envelope.interim_check_limit_um: 20, want none"},
          {[](Request* r) { r->mutable_machine()->mutable_touch_probe()->clear_serial_number(); },
           "machine.touch_probe.serial_number: "},
          {[](Request* r) {
             v1::Certificate& certificate = *r->mutable_machine()->mutable_touch_probe()->mutable_certificate();
             *certificate.mutable_expires_at() = certificate.calibrated_at();
           },
           "machine.touch_probe.certificate.expires_at: 1700000000 s, want later than calibrated_at"},
          {[](Request* r) { r->mutable_machine()->mutable_touch_probe()->mutable_certificate()->clear_number(); },
           "machine.touch_probe.certificate.number: "},
          {[](Request* r) { r->mutable_machine()->mutable_error_sources()->set_touch_offset_um(0); },
           "machine.error_sources.touch_offset_um: 0"},
          {[](Request* r) { r->mutable_machine()->mutable_error_sources()->set_scanner_field_um(kNan); },
           "machine.error_sources.scanner_field_um: NaN"},
          {[](Request* r) {
             r->mutable_machine()->mutable_error_sources()->set_approach(static_cast<v1::Approach>(7));
           },
           "machine.error_sources.approach: 7, want UPWARDS, DOWNWARDS"},
      });
}

TEST(ValidatedMachine, ASnapshotSensorHasNoColumns) {
  v1::CreateMachineRequest request = SampleMachine();
  request.mutable_machine()->mutable_sensor()->set_kind(v1::SENSOR_KIND_SNAPSHOT);
  request.mutable_machine()->mutable_sensor()->set_column_count(0);
  request.mutable_machine()->mutable_safety_envelope()->clear_interim_check_limit_um();
  const auto row = Validated(request);
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_EQ(row->sensor_kind, "SNAPSHOT");
  EXPECT_EQ(row->sensor_column_count, 0);
}

// What a machine cannot do is refused where it is asked for.
TEST(ValidatedMachine, TakesAnyJoints) {
  v1::CreateMachineRequest bc = SampleMachine();
  Joint(&bc)->set_axis("C");
  v1::Joint& carried = *bc.mutable_machine()->mutable_kinematics()->mutable_part_side(1);
  ASSERT_EQ(carried.axis(), "B");
  const auto row = Validated(bc);
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_EQ(row->joints[0].axis, "C");
  EXPECT_EQ(row->joints[1].axis, "B");
  bc.mutable_machine()->mutable_kinematics()->mutable_part_side()->RemoveLast();
  EXPECT_EQ(Refusal(bc), "accepted");
  // The spindle's own: linear, and nowhere but at the tool.
  v1::Joint& w = *bc.mutable_machine()->mutable_kinematics()->add_tool_side();
  w.set_axis("W");
  w.set_kind(v1::JOINT_KIND_LINEAR);
  w.mutable_direction()->set_z(1);
  w.set_sign(1);
  w.set_minimum(-50);
  w.set_maximum(50);
  EXPECT_EQ(Refusal(bc), "accepted");
  *bc.mutable_machine()->mutable_kinematics()->add_part_side() = w;
  bc.mutable_machine()->mutable_kinematics()->mutable_tool_side()->RemoveLast();
  EXPECT_THAT(Refusal(bc), HasSubstr("axis: W, linear, on the side of the part, want W linear, on the tool's side"));
}

TEST(ValidatedArtefact, RefusalsNameTheField) {
  using Request = v1::CreateArtefactRequest;
  ExpectRefusals<Request>(
      SampleArtefact(),
      {
          {[](Request* r) { r->mutable_artefact()->set_side_mm(0); }, "artefact.side_mm: 0"},
          {[](Request* r) { r->mutable_artefact()->mutable_cones(1)->set_x_mm(13); }, "artefact.cones[1].x_mm: 13"},
          {[](Request* r) { r->mutable_artefact()->mutable_slots(0)->set_y_mm(kNan); }, "artefact.slots[0].y_mm"},
          {[](Request* r) { r->mutable_artefact()->mutable_slots(0)->set_feature("C1"); }, "slots[0].feature: C1"},
          {[](Request* r) { r->mutable_artefact()->set_cone_bottom_radius_mm(3); }, "cone_bottom_radius_mm: 3"},
          {[](Request* r) { r->mutable_artefact()->set_slot_width_mm(0); }, "slot_width_mm: 0"},
          {[](Request* r) { r->mutable_artefact()->clear_cones(); }, "artefact.cones: 1 features"},
      });
}

// Many are one refusal, said at once: each is neither looked at nor stored.
TEST(Validated, RefusesMoreThanAnyThingHas) {
  v1::CreateArtefactRequest plate = SampleArtefact();
  for (int i = 0; i < 300'000; ++i) plate.mutable_artefact()->add_cones()->set_feature("C1");
  EXPECT_THAT(Refusal(plate), StartsWith("artefact.cones: 300004 features, want 3 to 1000"));
  v1::CreatePartRequest part = SamplePart("cad");
  for (int i = 0; i < 300'000; ++i) part.mutable_part()->add_hole_groups();
  EXPECT_THAT(Refusal(part), HasSubstr("part.hole_groups: 300003 holes, want at most 20000"));
}

v1::HoleGroup* Group(v1::CreatePartRequest* r) { return r->mutable_part()->mutable_hole_groups(0); }

TEST(ValidatedPart, RefusalsNameTheField) {
  using Request = v1::CreatePartRequest;
  ExpectRefusals<Request>(
      SamplePart("ISO-10303-21;"),
      {
          {[](Request* r) { r->clear_cad(); }, "cad: 0 bytes"},
          {[](Request* r) { r->mutable_part()->clear_cad_format(); }, "part.cad_format"},
          {[](Request* r) {
             r->mutable_part()->set_cad_format(v1::CAD_FORMAT_STL);
             r->mutable_part()->set_cad_unit_mm(0);
           },
           "part.cad_unit_mm: 0"},
          {[](Request* r) { r->mutable_part()->clear_zero_from_part_nominal(); }, "part.zero_from_part_nominal"},
          {[](Request* r) { r->mutable_part()->mutable_zero_from_part_nominal()->set_rotation(2, 0.99); },
           "part.zero_from_part_nominal.rotation"},
          {[](Request* r) { r->mutable_part()->mutable_six_points()->RemoveLast(); }, "part.six_points: 5 points"},
          {[](Request* r) { r->mutable_part()->mutable_six_points(3)->set_datum("D1"); },
           "part.six_points[3].datum: D1"},
          {[](Request* r) { r->mutable_part()->mutable_six_points(2)->mutable_normal_in_part()->set_z(0.1); },
           "part.six_points[2].normal_in_part"},
          {[](Request* r) { *r->mutable_part()->add_hole_groups() = *Group(r); }, "part.hole_groups[1].group: G1"},
          {[](Request* r) { Group(r)->clear_holes(); }, "part.hole_groups[0].holes: 0 holes"},
          {[](Request* r) { Group(r)->set_diameter_mm(-0.44); }, "part.hole_groups[0].diameter_mm: -0.44"},
          {[](Request* r) { Group(r)->set_position_tolerance_mm(0); }, "part.hole_groups[0].position_tolerance_mm: 0"},
          {[](Request* r) { Group(r)->clear_position_zone(); },
           "part.hole_groups[0].position_zone: POSITION_ZONE_UNSPECIFIED, want POSITION_ZONE_DIAMETER where"},
          {[](Request* r) { Group(r)->set_position_zone(static_cast<v1::PositionZone>(7)); },
           "part.hole_groups[0].position_zone: "},
          {[](Request* r) { Group(r)->mutable_pin_standing()->set_clearance_standard_uncertainty_um(-1); },
           "part.hole_groups[0].pin_standing.clearance_standard_uncertainty_um: -1, want 0 to 1000"},
          {[](Request* r) { Group(r)->mutable_pin_standing()->set_tilt_standard_uncertainty_deg(kInfinity); },
           "part.hole_groups[0].pin_standing.tilt_standard_uncertainty_deg: "},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_diameter_mm(0); },
           "part.hole_groups[0].gauge_pin.diameter_mm: 0"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->clear_diameter_standard_uncertainty_um(); },
           "part.hole_groups[0].gauge_pin.diameter_standard_uncertainty_um: 0"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_diameter_mm(44); },
           "part.hole_groups[0].gauge_pin.diameter_mm: 44, want 0.5 to 1.6 of the hole's"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_diameter_standard_uncertainty_um(50); },
           "part.hole_groups[0].gauge_pin.diameter_standard_uncertainty_um: 50"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->clear_greatest_play_mm(); },
           "part.hole_groups[0].gauge_pin.greatest_play_mm: unset"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_greatest_play_mm(1.5); },
           "part.hole_groups[0].gauge_pin.greatest_play_mm: 1.5"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_diameter_mm(0.3); },
           "part.hole_groups[0].gauge_pin.greatest_play_mm: 0.005, want 0 to 1, and what the hole's"},
          {[](Request* r) { Group(r)->mutable_gauge_pin()->set_least_depth_mm(7); },
           "part.hole_groups[0].gauge_pin.least_depth_mm: 7"},
          {[](Request* r) { Group(r)->set_b_nominal_deg(kNan); }, "part.hole_groups[0].b_nominal_deg"},
          {[](Request* r) { Group(r)->mutable_holes(1)->set_hole("H1"); }, "part.hole_groups[0].holes[1].hole: H1"},
          {[](Request* r) { Group(r)->mutable_holes(1)->mutable_start_in_part_mm()->set_x_mm(kInfinity); },
           "part.hole_groups[0].holes[1].start_in_part_mm.x_mm"},
      });
}

TEST(ValidatedPart, NearlyUnitDirectionsAreMadeUnit) {
  v1::CreatePartRequest request = SamplePart("x");
  Group(&request)->mutable_axis_in_part()->set_x(0.6 + 5e-7);
  const auto row = Validated(request);
  ASSERT_TRUE(row.ok()) << row.status();
  const std::vector<double>& axis = row->hole_groups[0].axis_in_part;
  EXPECT_NEAR(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2], 1, 1e-15);
}

TEST(ValidatedPart, ContentTellsDescriptionsApart) {
  const auto sha256 = [](const v1::CreatePartRequest& request) { return Validated(request)->content_sha256; };
  v1::CreatePartRequest same = SamplePart("x"), moved = SamplePart("x");
  same.mutable_part()->set_name("parts/other");  // the server's to say
  same.mutable_part()->set_revision(7);
  Group(&moved)->mutable_holes(0)->mutable_start_in_part_mm()->set_x_mm(std::nextafter(3.0, 4.0));
  EXPECT_EQ(sha256(same), sha256(SamplePart("x")));
  EXPECT_NE(sha256(moved), sha256(SamplePart("x")));
  EXPECT_NE(sha256(SamplePart("y")), sha256(SamplePart("x")));
}

// Two stations, 40 mm apart along machine Y, which is the part's x.
v1::CreatePartRequest StationedPart() {
  v1::CreatePartRequest request = SamplePart("x");
  for (const char* name : {"s1", "s2"}) {
    v1::Station* station = request.mutable_part()->add_stations();
    station->set_station(name);
    *station->mutable_zero_from_part_nominal() = request.part().zero_from_part_nominal();
  }
  request.mutable_part()->mutable_stations(1)->mutable_zero_from_part_nominal()->mutable_translation_mm()->set_y_mm(
      -310);
  return request;
}

TEST(ValidatedPart, StationsAreNamedOnceAndStandSomewhere) {
  const auto row = Validated(StationedPart());
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_EQ(row->stations[1].station, "s2");
  EXPECT_EQ(row->stations[1].zero_from_part_nominal_translation_mm[1], -310);
  EXPECT_EQ(row->stations[1].capture_mm, 5);  // the contract's
  EXPECT_NE(row->content_sha256, Validated(SamplePart("x"))->content_sha256);
  using Request = v1::CreatePartRequest;
  const auto second = [](Request* r) { return r->mutable_part()->mutable_stations(1); };
  ExpectRefusals<Request>(
      StationedPart(),
      {
          {[&](Request* r) { second(r)->clear_station(); }, "part.stations[1].station: empty"},
          {[&](Request* r) { second(r)->set_station("a b"); }, "part.stations[1].station: a b"},
          {[&](Request* r) { second(r)->set_station("s1"); },
           "part.stations[1].station: s1, want a name that no other"},
          {[&](Request* r) { second(r)->clear_zero_from_part_nominal(); }, "part.stations[1].zero_from_part_nominal: "},
          {[&](Request* r) { second(r)->mutable_zero_from_part_nominal()->set_rotation(2, 0.99); },
           "part.stations[1].zero_from_part_nominal.rotation"},
          {[&](Request* r) { second(r)->set_capture_mm(0); }, "part.stations[1].capture_mm: 0, want > 0 and <= 100"},
          {[&](Request* r) { second(r)->set_capture_mm(100.1); }, "part.stations[1].capture_mm: 100.1"},
          {[&](Request* r) { second(r)->set_capture_mm(kNan); }, "part.stations[1].capture_mm: NaN"},
      });
}

v1::CreatePartRequest ShapedPart() {
  v1::CreatePartRequest request = SamplePart("x");
  v1::ShapeRegion& edge = *request.mutable_part()->add_shape_regions();
  edge.set_region("edge");
  edge.set_kind(v1::SHAPE_REGION_KIND_MACHINED);
  edge.mutable_minimum_in_part_mm()->set_x_mm(1);
  edge.mutable_maximum_in_part_mm()->set_x_mm(2);
  edge.mutable_maximum_in_part_mm()->set_y_mm(1);
  edge.mutable_maximum_in_part_mm()->set_z_mm(1);
  edge.set_allowance_mm(0.1);
  edge.set_lower_mm(-0.1);
  edge.set_upper_mm(0.1);
  v1::ShapeRegion& foot = *request.mutable_part()->add_shape_regions();
  foot.set_region("foot");
  foot.set_kind(v1::SHAPE_REGION_KIND_DATUM);
  foot.set_rest(true);
  return request;
}

TEST(ValidatedPart, ShapeRegionsSayWhatBecomesOfThem) {
  const auto row = Validated(ShapedPart());
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_EQ(row->shape_regions[0].kind, "MACHINED");
  EXPECT_EQ(row->shape_regions[0].allowance_mm, 0.1);
  EXPECT_FALSE(row->shape_regions[1].lower_mm.has_value());
  EXPECT_NE(row->content_sha256, Validated(SamplePart("x"))->content_sha256);
  using Request = v1::CreatePartRequest;
  const auto edge = [](Request* r) { return r->mutable_part()->mutable_shape_regions(0); };
  const auto foot = [](Request* r) { return r->mutable_part()->mutable_shape_regions(1); };
  ExpectRefusals<Request>(
      ShapedPart(),
      {
          {[&](Request* r) { edge(r)->clear_region(); }, "part.shape_regions[0].region: "},
          {[&](Request* r) { foot(r)->set_region("edge"); }, "part.shape_regions[1].region: edge"},
          {[&](Request* r) { edge(r)->clear_kind(); },
           "part.shape_regions[0].kind: empty, want MACHINED, FIXED or DATUM"},
          {[&](Request* r) { edge(r)->mutable_maximum_in_part_mm()->set_x_mm(1); },
           "part.shape_regions[0].maximum_in_part_mm.x_mm: 1, want above minimum_in_part_mm, 1"},
          {[&](Request* r) { edge(r)->set_rest(true); }, "part.shape_regions[0].rest: true, want neither"},
          {[&](Request* r) { foot(r)->set_rest(false); }, "part.shape_regions[1]: not bounded"},
          {[&](Request* r) { edge(r)->clear_allowance_mm(); }, "part.shape_regions[0].allowance_mm: not stated"},
          {[&](Request* r) { foot(r)->set_allowance_mm(0); }, "part.shape_regions[1].allowance_mm: 0, want none"},
          {[&](Request* r) { edge(r)->set_allowance_mm(-0.1); },
           "part.shape_regions[0].allowance_mm: -0.1, want 0 to 5"},
          {[&](Request* r) { edge(r)->set_allowance_mm(kNan); }, "part.shape_regions[0].allowance_mm: NaN"},
          {[&](Request* r) { edge(r)->clear_upper_mm(); }, "part.shape_regions[0].upper_mm: not stated"},
          {[&](Request* r) { edge(r)->set_lower_mm(0.1); },
           "part.shape_regions[0].lower_mm: 0.1, want less than upper"},
          {[&](Request* r) { edge(r)->set_lower_mm(-5.1); }, "part.shape_regions[0].lower_mm: -5.1, want -5 to 5"},
          {[&](Request* r) { foot(r)->set_upper_mm(0.1); }, "part.shape_regions[1].upper_mm: 0.1, want none"},
          {[&](Request* r) { edge(r)->set_facing_within_deg(60); }, "part.shape_regions[0].facing_within_deg: 60"},
          {[&](Request* r) { edge(r)->CopyFrom(*foot(r)); }, "part.shape_regions: none machined"},
      });
}

// No place of a part may be one at two stations: told by what the box is off between them, at its farthest.
TEST(CheckStationsApart, RefusesTwoThatAPartMayStandAtTogether) {
  auto row = Validated(StationedPart());
  ASSERT_TRUE(row.ok());
  row->tessellation.minimum_mm = {-5, -5, 0};
  row->tessellation.maximum_mm = {5, 5, 20};
  EXPECT_TRUE(CheckStationsApart(*row).ok());
  row->stations[0].capture_mm = 35;
  EXPECT_THAT(
      std::string(CheckStationsApart(*row).message()),
      ::testing::MatchesRegex("part\\.stations\\[1\\]\\.zero_from_part_nominal: at most 39\\.9.* mm from the part's "
                              "place at s1, want more than 40, their capture_mm together"));
  row->stations[0].capture_mm = 5;
  row->stations[1] = row->stations[0];
  EXPECT_THAT(std::string(CheckStationsApart(*row).message()), HasSubstr("at most 0 mm from"));
  // Turned about the part's z by half a turn, in its own place: the box's corners are 14 mm off.
  row->stations[1].zero_from_part_nominal_rotation = {0, 0, 1, -1, 0, 0, 0, -1, 0};
  EXPECT_TRUE(CheckStationsApart(*row).ok());
}

TEST(CheckInsideBox, FindsCadInOtherUnits) {
  auto row = Validated(SamplePart("x"));
  ASSERT_TRUE(row.ok());
  row->tessellation.minimum_mm = {-5, -5, 0};
  row->tessellation.maximum_mm = {5, 5, 20};
  EXPECT_TRUE(CheckInsideBox(*row).ok());
  row->tessellation.maximum_mm = {5 / 25.4, 5 / 25.4, 20 / 25.4};
  EXPECT_THAT(std::string(CheckInsideBox(*row).message()), HasSubstr("part.six_points[0].point_in_part_mm: (5,"));
}

v1::Electrode* Electrode(v1::CreateMachiningModelRequest* r) {
  return r->mutable_machining_model()->mutable_operations(0)->mutable_electrode();
}

v1::MachiningOperation* Operation(v1::CreateMachiningModelRequest* r, int i) {
  return r->mutable_machining_model()->mutable_operations(i);
}

// Two poses of a shaped hole, as another operation.
v1::ToolPath* AddFan(v1::CreateMachiningModelRequest* r) {
  v1::MachiningOperation& operation = *r->mutable_machining_model()->add_operations();
  operation.set_operation("OP20");
  operation.mutable_electrode()->set_diameter_mm(0.3);
  operation.mutable_electrode()->set_length_mm(30);
  v1::ToolPath& path = *operation.add_paths();
  path.set_path("F1");
  path.set_position_tolerance_mm(0.05);
  path.set_inclination_tolerance_deg(0.5);
  path.set_mouth_mm(0.3);
  for (int i = 0; i < 2; ++i) {
    v1::ToolPose& pose = *path.add_poses();
    pose.mutable_tip_in_part_mm()->set_x_mm(0.1 * i);
    pose.mutable_axis_in_part()->set_z(1);
  }
  return &path;
}

TEST(ValidatedModel, RefusalsNameTheField) {
  using Request = v1::CreateMachiningModelRequest;
  const auto model = [](Request* r) { return r->mutable_machining_model(); };
  ExpectRefusals<Request>(
      SampleModel(),
      {
          {[](Request* r) { r->set_machining_model_id("a b"); }, "machining_model_id: a b"},
          {[&](Request* r) { model(r)->clear_part(); }, "machining_model.part: empty"},
          {[&](Request* r) { model(r)->set_part("blades/sn1"); }, "machining_model.part: blades/sn1"},
          {[&](Request* r) { model(r)->clear_operations(); }, "machining_model.operations: none"},
          {[&](Request* r) { *model(r)->add_operations() = model(r)->operations(0); }, "operations[1].operation: OP10"},
          {[&](Request* r) {
             *model(r)->add_operations() = model(r)->operations(0);
             model(r)->mutable_operations(1)->set_operation("OP20");
           },
           "operations[1].hole_group: G1, want each group once"},
          {[&](Request* r) { model(r)->mutable_operations(0)->set_operation(""); }, "operations[0].operation"},
          {[](Request* r) { Electrode(r)->set_diameter_mm(0); }, "operations[0].electrode.diameter_mm: 0, want > 0"},
          {[](Request* r) { Electrode(r)->set_diameter_mm(kNan); }, "electrode.diameter_mm"},
          {[](Request* r) { Electrode(r)->set_length_mm(-1); }, "electrode.length_mm: -1"},
          {[](Request* r) { Electrode(r)->set_length_mm(1001); }, "electrode.length_mm: 1001"},
          {[](Request* r) { Electrode(r)->set_wear_mm(-0.1); }, "electrode.wear_mm: -0.1"},
          {[](Request* r) { Electrode(r)->set_wear_mm(31); }, "electrode.wear_mm: 31, want 0 to length_mm"},
          {[](Request* r) { Electrode(r)->set_wear_mm(kNan); }, "electrode.wear_mm"},
          {[&](Request* r) { model(r)->mutable_operations(0)->clear_hole_group(); },
           "operations[0].hole_group: empty, want a hole group, or else paths"},
          {[](Request* r) { AddFan(r)->set_path("F 1"); }, "operations[1].paths[0].path: F 1"},
          {[](Request* r) { *Operation(r, 1)->add_paths() = *AddFan(r); },
           "operations[1].paths[1].path: F1, want each"},
          {[](Request* r) { AddFan(r), Operation(r, 1)->set_hole_group("G2"); }, "hole_group: G2 beside paths"},
          {[](Request* r) { AddFan(r)->set_a_nominal_deg(361); }, "paths[0].a_nominal_deg: 361"},
          {[](Request* r) { AddFan(r)->set_position_tolerance_mm(0); }, "paths[0].position_tolerance_mm: 0"},
          {[](Request* r) { AddFan(r)->set_inclination_tolerance_deg(kNan); }, "paths[0].inclination_tolerance_deg"},
          {[](Request* r) { AddFan(r)->set_mouth_mm(10.5); }, "paths[0].mouth_mm: 10.5, want > 0 and <= 10"},
          {[](Request* r) { AddFan(r)->set_greatest_step_deg(0); }, "paths[0].greatest_step_deg: 0"},
          {[](Request* r) { AddFan(r)->mutable_poses()->RemoveLast(); }, "paths[0].poses: 1 poses, want 2 to 5000"},
          {[](Request* r) {
             v1::ToolPath& fan = *AddFan(r);
             while (fan.poses_size() <= 5000) *fan.add_poses() = v1::ToolPose(fan.poses(0));
           },
           "paths[0].poses: 5001 poses"},
          {[](Request* r) {
             const v1::ToolPath fan = *AddFan(r);
             for (int i = 0; i < 5; ++i) {
               v1::ToolPath& more = *Operation(r, 1)->add_paths();
               more = fan;
               more.set_path("M" + std::to_string(i));
               while (more.poses_size() < 4000) *more.add_poses() = v1::ToolPose(fan.poses(0));
             }
           },
           "machining_model.operations: 20002 poses, want at most 20000"},
          {[](Request* r) { AddFan(r)->mutable_poses(1)->clear_axis_in_part(); }, "paths[0].poses[1].axis_in_part"},
          {[](Request* r) { AddFan(r)->mutable_poses(1)->mutable_axis_in_part()->set_z(2); }, "poses[1].axis_in_part"},
          {[](Request* r) { AddFan(r)->mutable_poses(0)->mutable_tip_in_part_mm()->set_x_mm(kNan); },
           "poses[0].tip_in"},
          {[](Request* r) { AddFan(r), Operation(r, 1)->mutable_electrode()->set_diameter_mm(11); },
           "operations[1].electrode.diameter_mm: 11"},
          {[&](Request* r) { model(r)->set_w_mm(kInfinity); }, "machining_model.w_mm"},
          {[&](Request* r) { model(r)->clear_nc_template(); }, "machining_model.nc_template: empty"},
          {[&](Request* r) { model(r)->mutable_post_processor()->set_hole("{x}"); },
           "machining_model.nc_template: one beside a post-processor"},
          {[&](Request* r) {
             model(r)->clear_nc_template();
             model(r)->mutable_post_processor()->set_hole("{q}");
           },
           "machining_model.post_processor.hole line 1: {q}"},
          {[&](Request* r) {
             model(r)->clear_nc_template();
             model(r)->mutable_post_processor()->set_linear_decimals(0);
           },
           "machining_model.post_processor.linear_decimals: 0, want 4 to 9"},
          {[&](Request* r) {
             model(r)->clear_nc_template();
             model(r)->mutable_post_processor()->set_comment_style(static_cast<v1::CommentStyle>(9));
           },
           "machining_model.post_processor.comment_style: 9"},
          {[&](Request* r) { model(r)->mutable_operations(0)->set_tool_number(0); }, "operations[0].tool_number: 0"},
          {[&](Request* r) { model(r)->mutable_operations(0)->set_feed_mm_min(kNan); }, "operations[0].feed_mm_min"},
          {[&](Request* r) { model(r)->mutable_work_offsets(0)->set_code("G92"); }, "work_offsets[0].code: G92"},
          {[&](Request* r) { model(r)->mutable_work_offsets(0)->set_z_mm(kNan); }, "work_offsets[0].z_mm"},
          {[&](Request* r) { *model(r)->add_tool_lengths() = model(r)->tool_lengths(0); }, "tool_lengths[1].number: 7"},
          {[&](Request* r) { model(r)->mutable_tool_lengths(0)->set_length_mm(2001); }, "tool_lengths[0].length_mm"},
      });
}

// Written when the model is made, of the holes that the part has then; of others it is another model.
TEST(ValidatedModel, APostProcessorWritesItsTemplate) {
  storage::PartRow part = *Validated(SamplePart("cad"));
  part.tessellation.minimum_mm = {-100, -100, -100};
  part.tessellation.maximum_mm = {100, 100, 100};
  v1::CreateMachiningModelRequest request = SampleModel();
  v1::MachiningModel& model = *request.mutable_machining_model();
  model.clear_nc_template();
  model.mutable_post_processor()->set_hole("G0 G90 {a} {b}\nG0 {x} {y}\nG1 {z} F{feed}\nG91 Z-{depth}\nG90 G0 Z50");
  auto row = Validated(request);
  ASSERT_TRUE(row.ok()) << row.status();
  EXPECT_THAT(std::string(FitToPart(part, model, &*row).message()),
              HasSubstr("post_processor.hole line 3: {feed}, want an operation that states it"));
  model.mutable_operations(0)->set_feed_mm_min(12.5);
  row = Validated(request);
  ASSERT_TRUE(row.ok()) << row.status();
  ASSERT_TRUE(FitToPart(part, model, &*row).ok());
  EXPECT_THAT(row->nc_template,
              HasSubstr("G0 G90 A0.0000 B0.0000 (SIXPOINT G1/H1)\nG0 X0.0000 Y0.0000 (SIXPOINT G1/H1)\n"
                        "G1 Z0.0000 F12.5 (SIXPOINT G1/H1)\nG91 Z-"));
  EXPECT_THAT(row->nc_template, HasSubstr("(SIXPOINT G1/H3)"));
  const std::string content = row->content_sha256;
  ASSERT_TRUE(FitToPart(part, model, &*row).ok());
  EXPECT_EQ(row->content_sha256, content);
  part.hole_groups[0].depth_mm += 0.5;
  ASSERT_TRUE(FitToPart(part, model, &*row).ok());
  EXPECT_NE(row->content_sha256, content);
}

// As the part's newest revision has its holes.
TEST(ValidatedModel, IsHeldAgainstThePartsHoles) {
  using Request = v1::CreateMachiningModelRequest;
  storage::PartRow part = *Validated(SamplePart("cad"));
  part.tessellation.minimum_mm = {-100, -100, -100};
  part.tessellation.maximum_mm = {100, 100, 100};
  const auto refusal = [&](const std::function<void(Request*)>& spoil) {
    Request request = SampleModel();
    spoil(&request);
    auto row = Validated(request);
    EXPECT_TRUE(row.ok()) << row.status();
    return std::string(FitToPart(part, request.machining_model(), &*row).message());
  };
  EXPECT_EQ(refusal([](Request*) {}), "");
  EXPECT_EQ(refusal([](Request* r) { Electrode(r)->set_diameter_mm(0.44); }), "");
  EXPECT_THAT(refusal([](Request* r) { Electrode(r)->set_diameter_mm(0.45); }),
              HasSubstr("operations[0].electrode.diameter_mm: 0.45, want at most 0.44"));
  EXPECT_THAT(refusal([](Request* r) { r->mutable_machining_model()->mutable_operations(0)->set_hole_group("G9"); }),
              HasSubstr("operations[0].hole_group: G9, want a hole group of parts/vane (G1)"));
  // 6 mm deep, and 0.25 mm lost before the second and the third hole each.
  EXPECT_EQ(refusal([](Request* r) { Electrode(r)->set_length_mm(6.5); }), "");
  EXPECT_THAT(refusal([](Request* r) { Electrode(r)->set_length_mm(6.4); }),
              HasSubstr("operations[0].electrode.length_mm: 6.4, want at least 6.5"));
  const auto with_template = [&](const std::string& text) {
    return refusal([&](Request* r) { r->mutable_machining_model()->set_nc_template(text); });
  };
  EXPECT_THAT(with_template("G0 X1\n"), HasSubstr("machining_model.nc_template: no marked block"));
  EXPECT_THAT(with_template("X1 (SIXPOINT G2/H1)\n"), HasSubstr("machining_model.nc_template: line 1"));
  EXPECT_THAT(with_template("X1 (SIXPOINT G1/H1)\nX1 (SIXPOINT G1/H2)\n"), HasSubstr("(SIXPOINT G1/H3)"));
  // Each pose of a path is marked, and no other path's.
  EXPECT_THAT(refusal([](Request* r) { AddFan(r); }), HasSubstr("no block marked (SIXPOINT F1/1)"));
  const auto marked = [](Request* r) {
    r->mutable_machining_model()->mutable_nc_template()->append("X1 (SIXPOINT F1/1)\nX1 (SIXPOINT F1/2)\n");
  };
  EXPECT_EQ(refusal([&](Request* r) { AddFan(r), marked(r); }), "");
  EXPECT_THAT(refusal([&](Request* r) { marked(r); }), HasSubstr("nc_template: line 4"));
  EXPECT_THAT(refusal([&](Request* r) { AddFan(r)->set_path("G1"), marked(r); }),
              HasSubstr("paths[0].path: G1, want a name that no hole group of parts/vane has"));
  EXPECT_THAT(
      refusal([&](Request* r) { AddFan(r)->mutable_poses(1)->mutable_tip_in_part_mm()->set_y_mm(1e4), marked(r); }),
      HasSubstr("paths[0].poses[1].tip_in_part_mm.y_mm: 10000, want within 10 mm"));
  EXPECT_THAT(refusal([&](Request* r) {
                const v1::ToolPath fan = *AddFan(r);
                *Operation(r, 1)->add_paths() = fan;
                Operation(r, 1)->mutable_paths(1)->set_path("F2");
                Operation(r, 1)->mutable_electrode()->set_wear_mm(30);
                marked(r);
              }),
              HasSubstr("operations[1].electrode.length_mm: 30, want more than the 30 mm"));
}

}  // namespace
}  // namespace sixpoint::plant
