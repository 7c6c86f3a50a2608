#include "cli/plant_run/dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/cli/small_dataset.h"

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Dataset, ReadsASmallPlant) {
  const auto dataset = ParseDataset(SmallDataset());
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  EXPECT_EQ(dataset->machine_id, "m-1");
  EXPECT_THAT(dataset->blades, ElementsAre("SN-7"));
  ASSERT_EQ(dataset->machine.kinematics().part_side_size(), 2);
  const auto& a = dataset->machine.kinematics().part_side(0);
  EXPECT_EQ(a.axis(), "A");
  EXPECT_EQ(a.direction().y(), 1);
  EXPECT_EQ(a.minimum(), -100);
  EXPECT_EQ(a.point_mm().z_mm(), -193.3);
  const auto& b = dataset->machine.kinematics().part_side(1);
  EXPECT_EQ(b.axis(), "B");
  EXPECT_EQ(b.direction().x(), 1);
  EXPECT_EQ(dataset->artefact.side_mm(), 24);
  EXPECT_EQ(dataset->part.cad_format(), plant::v1::CAD_FORMAT_STEP);
  EXPECT_EQ(dataset->part.six_points_size(), 6);
  EXPECT_EQ(dataset->part.hole_groups(0).position_zone(),
            plant::v1::POSITION_ZONE_RADIUS);  // as datasets without one mean it
  EXPECT_FALSE(dataset->sphere_poses[0].held_out());
  EXPECT_TRUE(dataset->sphere_poses[1].held_out());
  ASSERT_EQ(dataset->scans.size(), 2u);
  EXPECT_EQ(dataset->scans[1].header.subject(), "blades/SN-7");
  EXPECT_EQ(dataset->scans[1].header.kind(), ingest::v1::SCAN_KIND_AIRFOIL);
  EXPECT_EQ(dataset->scans[1].header.b_deg(), 60);
}

// Every field that is needed: without it, its path is named.
TEST(Dataset, NamesEachMissingField) {
  for (const char* pointer : {"/machine",
                              "/machine/id",
                              "/machine/kinematics",
                              "/machine/nominal_centre_mm",
                              "/machine/a_limits_deg",
                              "/machine/b_limits_deg",
                              "/sensor/model",
                              "/sensor/noise_um",
                              "/sensor/columns",
                              "/sensor/range_mm",
                              "/sensor/mid_range_mm",
                              "/sensor/line_angle_deg",
                              "/artefact/id",
                              "/artefact/cones_mm",
                              "/artefact/slots_mm",
                              "/artefact/cone_half_angle_deg",
                              "/artefact/slot_width_mm",
                              "/touch_probe",
                              "/touch_probe/centres",
                              "/sphere_poses",
                              "/sphere_poses/0/a_deg",
                              "/sphere_poses/1/centre_mm",
                              "/part/id",
                              "/part/cad",
                              "/part/zero_from_part_nominal",
                              "/part/hole_groups",
                              "/part/hole_groups/0/axis_in_part",
                              "/part/hole_groups/0/holes/0/start_in_part_mm",
                              "/part/hole_groups/0/position_tolerance_mm",
                              "/part/six_points/5/normal_in_part",
                              "/scans",
                              "/scans/0/id",
                              "/scans/1/file",
                              "/scans/1/v0_mm",
                              "/scans/0/a_deg",
                              "/scans/0/kind",
                              "/scans/0/subject",
                              "/scans/0/machine",
                              "/scans/0/point_count",
                              "/scans/0/profile_pitch_mm",
                              "/scans/0/columns_per_profile"}) {
    nlohmann::json json = SmallDataset();
    json[nlohmann::json::json_pointer(pointer)] = nullptr;
    const auto dataset = ParseDataset(json);
    ASSERT_FALSE(dataset.ok()) << pointer;
    // "/scans/0/id" -> "scans[0].id".
    std::string path;
    for (const char* c = pointer + 1; *c != 0; ++c) {
      if (*c == '/' && std::isdigit(static_cast<unsigned char>(c[1]))) {
        path += "[" + std::string(1, c[1]) + "]";
        ++c;
      } else {
        path += *c == '/' ? '.' : *c;
      }
    }
    EXPECT_THAT(std::string(dataset.status().message()), HasSubstr(path + ": missing")) << pointer;
  }
}

TEST(Dataset, OnlyAFileThatSaysNoUnitNeedsOne) {
  nlohmann::json json = SmallDataset();
  json["part"].erase("cad_unit");
  const auto step = ParseDataset(json);
  ASSERT_TRUE(step.ok()) << step.status();
  EXPECT_EQ(step->part.cad_unit_mm(), 0);
  json["part"]["cad"] = "cad.stl";
  EXPECT_THAT(std::string(ParseDataset(json).status().message()), HasSubstr("part.cad_unit: missing"));
}

TEST(Dataset, NamesOddValuesAndWhatWasWanted) {
  const struct {
    const char* pointer;
    const char* value;
    const char* message;
  } kCases[] = {
      {"/machine/id", "\"m 1\"", "machine.id: \"m 1\", want letters"},
      {"/machine/kinematics", "\"Ry(A)\"", "machine.kinematics: \"Ry(A)\", want the two rotary joints"},
      {"/machine/a_limits_deg", "[100, -100]", "machine.a_limits_deg: [100,-100], want the lower limit first"},
      {"/machine/nominal_centre_mm", "[1, 2]", "machine.nominal_centre_mm: 2 values, want a list of 3"},
      {"/sensor/noise_um", "0", "sensor.noise_um: 0, want a number > 0"},
      {"/artefact/plane", "\"24 x 25 mm\"", "artefact.plane: \"24 x 25 mm\", want text with the sides"},
      {"/part/cad", "\"../cad.step\"", "part.cad: \"../cad.step\", want a path that stays inside"},
      {"/part/cad", "\"cad.dwg\"", "part.cad: \"cad.dwg\", want a name that ends in .step"},
      {"/part/cad_unit", "\"furlong\"", "part.cad_unit: \"furlong\", want one of mm"},
      {"/part/hole_groups/0/axis_in_part", "[0, 0, 2]", "part.hole_groups[0].axis_in_part: [0,0,2], want a direction"},
      {"/part/six_points/0", "null", "part.six_points[0]: null, want an object with name"},
      {"/scans/0/point_count", "0", "scans[0].point_count: 0, want a whole number from 1"},
      {"/scans/0/point_count", "1e18", "scans[0].point_count: 1e+18, want a whole number"},
      {"/scans/0/kind", "\"blade\"", "scans[0].kind: \"blade\", want one of artefact"},
      {"/scans/0/subject", "\"artefact:other\"", "scans[0].subject: \"artefact:other\", want artefact:plate"},
      {"/scans/1/subject", "\"artefact:plate\"", "scans[1].subject: \"artefact:plate\", want blade:SERIAL"},
      {"/scans/1/machine", "\"m-2\"", "scans[1].machine: \"m-2\", want 'm-1'"},
      {"/scans/1/id", "\"artefact_1\"", "scans[1].id: \"artefact_1\", want an id that no other scan has"},
      {"/scans/1/file", "\"/etc/passwd\"", "scans[1].file: \"/etc/passwd\", want a path that stays inside"},
      {"/scans/1/v0_mm/1", "\"far\"", "scans[1].v0_mm[1]: \"far\", want a finite number"},
      {"/scans", "[]", "scans: 0 values, want a list of 1"},
  };
  for (const auto& test : kCases) {
    nlohmann::json json = SmallDataset();
    json[nlohmann::json::json_pointer(test.pointer)] = nlohmann::json::parse(test.value);
    const auto dataset = ParseDataset(json);
    ASSERT_FALSE(dataset.ok()) << test.pointer;
    EXPECT_THAT(std::string(dataset.status().message()), HasSubstr(test.message)) << test.pointer;
  }
}

nlohmann::json HarshDataset() {
  nlohmann::json json = SmallDataset();
  json["error_sources"] = {
      {"axis_tables", "apply"},
      {"approach", "upwards"},
      {"touch_common_standard_uncertainty_um", 0.6},
      {"arm_swings_between", "series"},
      {"series", {{"calibration", "artefact_"}, {"blade", "airfoil_,more_"}}},
      {"sensor_field_standard_uncertainty_um", 2},
      {"sensor_speckle", {{"standard_uncertainty_um", 1}, {"columns", 4}}},
      {"pin", {{"clearance_standard_uncertainty_um", 2}, {"tilt_standard_uncertainty_deg", 0.03}}}};
  json["axis_runs"]["A"] = {{"commanded_deg", {0, 1, 2}}, {"error_deg", {0.1, 0.2, 0.3}}, {"direction", {1, 1, 1}}};
  json["axis_runs"]["B"] = {{"commanded_deg", {0, 1}}, {"measured_deg", {0.5, 1.5}}};
  nlohmann::json arm = json["scans"][0];
  arm["kind"] = "arm";
  for (int i = 1; i <= kFewestArmScans; ++i) {
    arm["id"] = "arm_" + std::to_string(i);
    json["scans"].push_back(arm);
  }
  json["scans"][1]["id"] = "airfoil_1";
  return json;
}

TEST(Dataset, ReadsWhatIsKnownOfErrors) {
  const auto dataset = ParseDataset(HarshDataset());
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  const plant::v1::ErrorSources& machine = dataset->machine.error_sources();
  EXPECT_EQ(machine.approach(), plant::v1::APPROACH_UPWARDS);
  EXPECT_EQ(machine.touch_offset_um(), 0.6);
  EXPECT_EQ(machine.scanner_field_um(), 2);
  ASSERT_EQ(dataset->axis_runs.size(), 2u);
  EXPECT_EQ(dataset->axis_runs[0].first, "A");
  EXPECT_DOUBLE_EQ(dataset->axis_runs[0].second.measured_deg(2), 2.3);
  EXPECT_DOUBLE_EQ(dataset->axis_runs[1].second.measured_deg(1), 1.5);
  EXPECT_TRUE(dataset->study_arm);
  EXPECT_EQ(dataset->sphere_poses[0].a_travel(), calibration::v1::TRAVEL_FORWARD);
  EXPECT_EQ(dataset->scans[0].header.arm_series(), "calibration");
  EXPECT_EQ(dataset->scans[1].header.arm_series(), "blade");
  EXPECT_EQ(dataset->scans[2].header.arm_series(), "arm_1");  // a swing of its own
  EXPECT_EQ(dataset->part.hole_groups(0).pin_standing().tilt_standard_uncertainty_deg(), 0.03);

  const auto without = ParseDataset(SmallDataset());
  ASSERT_TRUE(without.ok());
  EXPECT_FALSE(without->machine.has_error_sources());
  EXPECT_FALSE(without->part.hole_groups(0).has_pin_standing());
  EXPECT_FALSE(without->applies_axis_tables() || without->study_arm);
  nlohmann::json in_control = HarshDataset();
  in_control["error_sources"]["axis_tables"] = "in_control";
  EXPECT_FALSE(ParseDataset(in_control)->applies_axis_tables());
}

TEST(Dataset, ReadsTemperaturesAndWhichWayTheEncoderWent) {
  nlohmann::json json = HarshDataset();
  json["error_sources"]["temperature_standard_uncertainty_k"] = 0.3;
  json["error_sources"]["temperature_half_range_k"] = 5;
  json["error_sources"]["scale_expansion"] = {{"um_per_m_k", 10}, {"standard_uncertainty_um_per_m_k", 0.5}};
  json["error_sources"]["encoder_latency_standard_uncertainty_um"] = 1.5;
  json["part"]["thermal_expansion"] = {{"um_per_m_k", 13}, {"standard_uncertainty_um_per_m_k", 0.5}};
  json["scans"][1]["temperature_c"] = 24.5;
  json["scans"][1]["scales_temperature_c"] = 21;
  json["scans"][1]["travel"] = "backward";
  const auto dataset = ParseDataset(json);
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  const plant::v1::ErrorSources& machine = dataset->machine.error_sources();
  EXPECT_EQ(machine.temperature_k(), 0.3);
  EXPECT_EQ(machine.temperature_half_range_k(), 5);
  EXPECT_EQ(machine.scale_expansion().um_per_m_k(), 10);
  EXPECT_EQ(machine.encoder_latency_um(), 1.5);
  EXPECT_EQ(dataset->part.thermal_expansion().um_per_m_k(), 13);
  const ingest::v1::ScanHeader& scan = dataset->scans[1].header;
  EXPECT_EQ(scan.subject_temperature_c(), 24.5);
  EXPECT_EQ(scan.scales_temperature_c(), 21);
  EXPECT_EQ(scan.travel(), ingest::v1::SCAN_TRAVEL_BACKWARD);
  EXPECT_FALSE(dataset->scans[0].header.has_subject_temperature_c());
  EXPECT_EQ(dataset->scans[0].header.travel(), ingest::v1::SCAN_TRAVEL_UNSPECIFIED);
}

// An error that nobody reads is in no uncertainty: what is not known is refused here.
TEST(Dataset, RefusesErrorsThatItDoesNotKnowOrThatSayTooLittle) {
  const struct {
    const char* pointer;
    const char* value;
    const char* message;
  } kCases[] = {
      {"/error_sources/temperature_c", "20", "error_sources.temperature_c: 20, want one of axis_tables, approach"},
      {"/error_sources/pin/radius_um", "1", "error_sources.pin.radius_um: 1, want one of clearance"},
      {"/error_sources/pin/tilt_standard_uncertainty_deg", "\"some\"", "tilt_standard_uncertainty_deg: \"some\", want"},
      {"/error_sources/touch_common_standard_uncertainty_um", "0", "touch_common_standard_uncertainty_um: 0, want"},
      {"/error_sources/axis_tables", "\"learn\"", "error_sources.axis_tables: \"learn\", want one of apply"},
      {"/error_sources/approach", "\"sideways\"", "error_sources.approach: \"sideways\", want one of upwards"},
      {"/error_sources/series", "{\"blade\": \"airfoil_\"}",
       "want a series for every scan but those of kind arm; artefact_1"},
      {"/error_sources/sensor_speckle/columns", "0", "error_sources.sensor_speckle.columns: 0, want"},
      {"/error_sources/temperature_half_range_k", "0", "error_sources.temperature_half_range_k: 0, want"},
      {"/error_sources/scale_expansion", "{\"um_per_m_k\": 10}", "standard_uncertainty_um_per_m_k: missing"},
      {"/error_sources/encoder_latency_standard_uncertainty_um", "-1", "latency_standard_uncertainty_um: -1, want"},
      {"/scans/1/temperature_c", "-3", "scans[1].temperature_c: -3, want"},
      {"/scans/1/travel", "\"up\"", "scans[1].travel: \"up\", want one of forward"},
      {"/axis_runs/B", "null", "axis_runs.B: missing"},
      {"/scans/6/kind", "\"artefact\"",
       "error_sources.arm_swings_between: \"series\", want 5 scans of kind arm or more"},
  };
  for (const auto& test : kCases) {
    nlohmann::json json = HarshDataset();
    json[nlohmann::json::json_pointer(test.pointer)] = nlohmann::json::parse(test.value);
    const auto dataset = ParseDataset(json);
    ASSERT_FALSE(dataset.ok()) << test.pointer;
    EXPECT_THAT(std::string(dataset.status().message()), HasSubstr(test.message)) << test.pointer;
  }
  nlohmann::json without = HarshDataset();
  without["error_sources"]["pin"].erase("clearance_standard_uncertainty_um");
  EXPECT_THAT(std::string(ParseDataset(without).status().message()),
              HasSubstr("error_sources.pin.clearance_standard_uncertainty_um: missing"));
}

TEST(Dataset, RefusesFiveDatumPointsAndTakesNone) {
  nlohmann::json json = SmallDataset();
  json["part"]["six_points"].erase(0);
  EXPECT_FALSE(ParseDataset(json).ok());
  json["part"].erase("six_points");
  const auto dataset = ParseDataset(json);
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  EXPECT_EQ(dataset->part.six_points_size(), 0);
}

TEST(Dataset, RefusesWhatIsNoObject) {
  EXPECT_FALSE(ParseDataset(nlohmann::json::array()).ok());
  EXPECT_FALSE(ParseDataset(nlohmann::json()).ok());
  EXPECT_EQ(LoadDataset("/no/such/folder").status().code(), absl::StatusCode::kNotFound);
}

TEST(Dataset, ReadsThePlantOfTheIssue) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  if (shared == nullptr || !std::filesystem::exists(std::string(shared) + "/data/plant-a/dataset.json")) {
    GTEST_SKIP() << "../shared/data/plant-a is absent";
  }
  const auto dataset = LoadDataset(std::string(shared) + "/data/plant-a");
  ASSERT_TRUE(dataset.ok()) << dataset.status();
  EXPECT_EQ(dataset->scans.size(), 66u);
  EXPECT_EQ(dataset->sphere_poses.size(), 48u);
  EXPECT_THAT(dataset->blades, ElementsAre("SN-0001", "SN-0002"));
  EXPECT_EQ(dataset->part.hole_groups_size(), 3);
}

}  // namespace
}  // namespace sixpoint::cli
