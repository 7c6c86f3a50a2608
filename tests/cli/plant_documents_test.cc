#include "cli/plant_documents.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "cli/calibration_documents.h"
#include "cli/document.h"
#include "cli/model_document.h"
#include "tests/cli/example.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

absl::Status ReadMachineFrom(const std::string& yaml) {
  const auto json = ParseYaml("machine.yaml", yaml);
  if (!json.ok()) return json.status();
  Problems problems(true);
  ReadMachine(Field(&*json, "", &problems));
  return problems.ToStatus();
}

TEST(PlantDocuments, TheMachineOfTheDocsIsRead) {
  const auto request = LoadMachine(Example("machine.yaml"));
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->machine_id(), "sarix-1");
  const auto& kinematics = request->machine().kinematics();
  ASSERT_EQ(kinematics.part_side_size(), 2);
  EXPECT_EQ(kinematics.part_side(0).axis(), "A");
  EXPECT_EQ(kinematics.part_side(0).kind(), plant::v1::JOINT_KIND_ROTARY);
  EXPECT_EQ(kinematics.part_side(0).sign(), 1);
  EXPECT_EQ(kinematics.tool_side_size(), 3);
  EXPECT_GT(request->machine().safety_envelope().translation_mm(), 0);
}

TEST(PlantDocuments, TheArtefactOfTheDocsIsRead) {
  const auto request = LoadArtefact(Example("artefact.yaml"));
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->artefact().side_mm(), 24);
  EXPECT_EQ(request->artefact().cones_size(), 3);
  EXPECT_EQ(request->artefact().slots_size(), 3);
}

TEST(PlantDocuments, ThePartOfTheDocsIsReadWithTheCadBesideIt) {
  const auto request = LoadPart(Example("part.yaml"));
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->part().cad_format(), plant::v1::CAD_FORMAT_STL);
  EXPECT_FALSE(request->cad().empty());
  EXPECT_EQ(request->part().six_points_size(), 6);
  EXPECT_EQ(request->part().hole_groups(0).position_zone(), plant::v1::POSITION_ZONE_DIAMETER);
  EXPECT_EQ(request->part().hole_groups(0).gauge_pin().diameter_mm(), 0.44);
  EXPECT_EQ(request->part().hole_groups(0).gauge_pin().greatest_play_mm(), 0.005);
  EXPECT_EQ(request->part().zero_from_part_nominal().rotation_size(), 9);
}

// Half or whole is not guessed.
TEST(PlantDocuments, APartSaysWhatItsPositionTolerancesAre) {
  const std::string folder = ::testing::TempDir() + "/zone";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(Example("block.stl"), folder + "/block.stl",
                             std::filesystem::copy_options::overwrite_existing);
  std::string text = *ReadFile(Example("part.yaml"), kGreatestDocumentBytes);
  const std::string zone = "    position_zone: diameter\n";
  ASSERT_NE(text.find(zone), std::string::npos);
  const auto with = [&](const std::string& line) {
    std::string changed = text;
    changed.replace(changed.find(zone), zone.size(), line);
    EXPECT_TRUE(WriteFile(folder + "/part.yaml", changed).ok());
    return LoadPart(folder + "/part.yaml");
  };
  EXPECT_THAT(std::string(with("").status().message()), HasSubstr("hole_groups[0].position_zone: missing"));
  EXPECT_THAT(std::string(with("    position_zone: both\n").status().message()), HasSubstr("position_zone: \"both\""));
  const auto radius = with("    position_zone: radius\n");
  ASSERT_TRUE(radius.ok()) << radius.status();
  EXPECT_EQ(radius->part().hole_groups(0).position_zone(), plant::v1::POSITION_ZONE_RADIUS);
}

TEST(PlantDocuments, APartsStationsAreRead) {
  const std::string folder = ::testing::TempDir() + "/stations";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(Example("block.stl"), folder + "/block.stl",
                             std::filesystem::copy_options::overwrite_existing);
  std::string text = *ReadFile(Example("part.yaml"), kGreatestDocumentBytes);
  const std::string kept_out = "# stations:\n";  // as the docs have it
  const std::size_t from = text.find(kept_out);
  ASSERT_NE(from, std::string::npos);
  for (std::size_t line = from; line != text.find("# Of its material"); line = text.find('\n', line) + 1)
    text.erase(line, 2);
  ASSERT_TRUE(WriteFile(folder + "/part.yaml", text).ok());
  const auto request = LoadPart(folder + "/part.yaml");
  ASSERT_TRUE(request.ok()) << request.status();
  ASSERT_EQ(request->part().stations_size(), 2);
  EXPECT_EQ(request->part().stations(0).station(), "left");
  EXPECT_FALSE(request->part().stations(0).has_capture_mm());
  EXPECT_EQ(request->part().stations(1).zero_from_part_nominal().translation_mm().x_mm(), -20);
  EXPECT_EQ(request->part().stations(1).capture_mm(), 3);
  text.replace(text.find("capture_mm: 3"), 13, "capture_mm: 0");
  ASSERT_TRUE(WriteFile(folder + "/part.yaml", text).ok());
  EXPECT_THAT(std::string(LoadPart(folder + "/part.yaml").status().message()), HasSubstr("stations[1].capture_mm: 0"));
}

TEST(PlantDocuments, APartsShapeRegionsAreRead) {
  const std::string folder = ::testing::TempDir() + "/shape_regions";
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(Example("block.stl"), folder + "/block.stl",
                             std::filesystem::copy_options::overwrite_existing);
  std::string text = *ReadFile(Example("part.yaml"), kGreatestDocumentBytes);
  const std::size_t from = text.find("# shape_regions:\n");  // as the docs have it
  ASSERT_NE(from, std::string::npos);
  for (std::size_t line = from; line != text.find("# Six datum points"); line = text.find('\n', line) + 1)
    text.erase(line, 2);
  ASSERT_TRUE(WriteFile(folder + "/part.yaml", text).ok());
  const auto request = LoadPart(folder + "/part.yaml");
  ASSERT_TRUE(request.ok()) << request.status();
  ASSERT_EQ(request->part().shape_regions_size(), 3);
  const plant::v1::ShapeRegion& top = request->part().shape_regions(0);
  EXPECT_EQ(top.kind(), plant::v1::SHAPE_REGION_KIND_MACHINED);
  EXPECT_EQ(top.minimum_in_part_mm().z_mm(), 9.9);
  EXPECT_EQ(top.allowance_mm(), 0.2);
  EXPECT_EQ(top.lower_mm(), -0.3);
  EXPECT_FALSE(top.has_facing_within_deg() || top.has_maximum_in_part_mm() || top.rest());
  EXPECT_EQ(request->part().shape_regions(1).facing_within_deg(), 10);
  EXPECT_FALSE(request->part().shape_regions(1).has_lower_mm());
  EXPECT_TRUE(request->part().shape_regions(2).rest());
  text.replace(text.find("kind: datum"), 11, "kind: drawn");
  ASSERT_TRUE(WriteFile(folder + "/part.yaml", text).ok());
  EXPECT_THAT(std::string(LoadPart(folder + "/part.yaml").status().message()),
              HasSubstr("shape_regions[1].kind: \"drawn\""));
}

TEST(PlantDocuments, TheTouchDataAndSpherePosesOfTheDocsAreRead) {
  const auto touch = LoadTouchData(Example("touch.yaml"));
  ASSERT_TRUE(touch.ok()) << touch.status();
  EXPECT_EQ(touch->centres_size(), 6);
  const auto poses = LoadSpherePoses(Example("sphere_poses.yaml"));
  ASSERT_TRUE(poses.ok()) << poses.status();
  EXPECT_TRUE(poses->back().held_out());
  // By the machine's own axes: the one on the bed, the one that it carries.
  const auto own = LoadSpherePoses(Example("sphere_poses_bc.yaml"), {"B", "C"});
  ASSERT_TRUE(own.ok()) << own.status();
  EXPECT_EQ(own->front().a_deg(), -60);
  EXPECT_EQ(own->at(1).b_deg(), 120);
  EXPECT_FALSE(LoadSpherePoses(Example("sphere_poses_bc.yaml")).ok());
}

TEST(PlantDocuments, AMachineSaysEverythingThatIsWrongAtOnce) {
  const absl::Status status = ReadMachineFrom(
      "id: m\nnominal_centre_mm: [0, 0]\nsensor: {model: s, noise_um: -2, columns: 1280, mid_range_mm: 66, range_mm: "
      "25, "
      "line_angle_deg: 20}\nsafty_envelope: {}\npart_side: [{axis: Q, kind: rotary, direction: [0, 1, 0]}]\ntool_side: "
      "[]\n");
  ASSERT_FALSE(status.ok());
  const std::string message(status.message());
  EXPECT_THAT(message, HasSubstr("nominal_centre_mm: 2 values"));
  EXPECT_THAT(message, HasSubstr("sensor.noise_um: -2"));
  EXPECT_THAT(message, HasSubstr("safty_envelope: unknown"));
  EXPECT_THAT(message, HasSubstr("part_side[0].axis: \"Q\""));
  EXPECT_THAT(message, HasSubstr("part_side[0].point_mm: missing"));
  EXPECT_THAT(message, HasSubstr("part_side[0].limits_deg: missing"));
}

TEST(PlantDocuments, ASnapshotSensorHasNoColumns) {
  const std::string machine =
      "id: m\nnominal_centre_mm: [0, 0, 0]\npart_side: []\ntool_side: []\n"
      "sensor: {model: s, noise_um: 3, mid_range_mm: 300, range_mm: 120, line_angle_deg: 30, ";
  EXPECT_TRUE(ReadMachineFrom(machine + "kind: snapshot}\n").ok()) << ReadMachineFrom(machine + "kind: snapshot}\n");
  EXPECT_THAT(std::string(ReadMachineFrom(machine + "kind: snapshot, columns: 1280}\n").message()),
              HasSubstr("a snapshot sensor has no columns"));
  EXPECT_THAT(std::string(ReadMachineFrom(machine + "kind: line}\n").message()), HasSubstr("sensor.columns: missing"));
}

TEST(PlantDocuments, ReadsEncoderRunsAndGauges) {
  const auto run = LoadAxisRun(Example("axis_run.yaml"), "A");
  ASSERT_TRUE(run.ok()) << run.status();
  ASSERT_EQ(run->commanded_deg_size(), 306);
  ASSERT_EQ(run->measured_deg_size(), 306);
  EXPECT_EQ(run->commanded_deg(0), -10);
  // 0.012 sin(-10 deg) + 0.003 + 0.0075, as the file rounds it.
  EXPECT_NEAR(run->measured_deg(0) + 10, 0.012 * std::sin(-M_PI / 18) + 0.003 + 0.0075, 6e-6);
  EXPECT_EQ(run->travel_size(), 0);
  const auto gauge = LoadStandardProbing(Example("gauge.yaml"));
  ASSERT_TRUE(gauge.ok()) << gauge.status();
  EXPECT_EQ(gauge->bore_mm_size(), 4);
  EXPECT_EQ(gauge->face_above_centre_mm(), 75);
  EXPECT_FALSE(LoadAxisRun(Example("gauge.yaml"), "A").ok());
}

// Files of one test, gone with it.
class ModelFiles {
 public:
  ModelFiles() {
    std::string folder = ::testing::TempDir() + "/model_XXXXXX";
    EXPECT_NE(mkdtemp(folder.data()), nullptr);
    folder_ = folder;
  }
  ~ModelFiles() { std::filesystem::remove_all(folder_); }
  std::string Put(const std::string& name, const std::string& text) const {
    EXPECT_TRUE(WriteFile(folder_ + "/" + name, text).ok());
    return folder_ + "/" + name;
  }

 private:
  std::string folder_;
};

TEST(PlantDocuments, TheMachiningModelOfTheDocsIsReadWithItsTemplate) {
  const ModelFiles files;
  const std::string nc = files.Put("program.nc", "X1 (SIXPOINT G1/H1)\n");
  const auto request = LoadMachiningModel(Example("model.yaml"), nc);
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->machining_model_id(), "block-1-edm");
  const plant::v1::MachiningModel& model = request->machining_model();
  EXPECT_EQ(model.part(), "parts/block-1");
  ASSERT_EQ(model.operations_size(), 1);
  EXPECT_EQ(model.operations(0).hole_group(), "G1");
  EXPECT_EQ(model.operations(0).electrode().diameter_mm(), 0.4);
  EXPECT_EQ(model.operations(0).electrode().wear_mm(), 0.5);
  EXPECT_FALSE(model.has_w_mm());
  EXPECT_EQ(model.nc_template(), "X1 (SIXPOINT G1/H1)\n");
}

TEST(PlantDocuments, APostProcessorOfTheDocsIsReadInsteadOfATemplate) {
  const ModelFiles files;
  const std::string example = Example("model_with_post_processor.yaml");
  const auto request = LoadMachiningModel(example, "");
  ASSERT_TRUE(request.ok()) << request.status();
  const plant::v1::MachiningModel& model = request->machining_model();
  EXPECT_EQ(model.operations(0).tool_number(), 3);
  EXPECT_EQ(model.operations(0).feed_mm_min(), 20);
  EXPECT_EQ(model.nc_template(), "");
  const plant::v1::PostProcessor& post = model.post_processor();
  EXPECT_EQ(post.axis_words().y(), "Y");
  EXPECT_EQ(post.linear_decimals(), 4);
  EXPECT_FALSE(post.has_direction_decimals());
  EXPECT_EQ(post.number_step(), 10);
  EXPECT_TRUE(post.leaves_out_repeated());
  EXPECT_EQ(post.program_start(), "%\nG21 G90 G0 Z100\n");
  EXPECT_EQ(post.hole(), "G0 G90 {a} {b}\nG0 {x} {y}\nG1 {z} F{feed}\nG91 Z-{depth}\nG90 G0 Z50\n");
  EXPECT_EQ(post.path_pose(), "");
  const std::string nc = files.Put("program.nc", "X1 (SIXPOINT G1/H1)\n");
  EXPECT_THAT(LoadMachiningModel(example, nc).status().message(), HasSubstr("none beside a post_processor"));
  EXPECT_THAT(LoadMachiningModel(Example("model.yaml"), "").status().message(), HasSubstr("or a post_processor in"));
}

// What a repair asks of a model: one operation of one path, a post-processor with laps' sections, and a ball-end mill.
TEST(PlantDocuments, TheModelForRepairsOfTheDocsLeadsLaps) {
  const auto request = LoadMachiningModel(Example("model_for_repairs.yaml"), "");
  ASSERT_TRUE(request.ok()) << request.status();
  const plant::v1::MachiningModel& model = request->machining_model();
  ASSERT_EQ(model.operations_size(), 1);
  EXPECT_EQ(model.operations(0).hole_group(), "");
  EXPECT_EQ(model.operations(0).electrode().diameter_mm(), 6);
  ASSERT_EQ(model.operations(0).paths_size(), 1);
  const plant::v1::ToolPath& path = model.operations(0).paths(0);
  EXPECT_EQ(path.path(), "tip");
  EXPECT_EQ(path.mouth_mm(), 4);
  EXPECT_EQ(path.greatest_step_deg(), 20);
  EXPECT_GE(path.poses_size(), 2);
  EXPECT_THAT(model.post_processor().path_start(), HasSubstr("{a} {b}"));
  EXPECT_THAT(model.post_processor().path_pose(), HasSubstr("{x} {y} {z} {a} {b}"));
  EXPECT_NE(model.post_processor().path_end(), "");
}

TEST(PlantDocuments, AMachiningModelSaysWhereItIsOdd) {
  const ModelFiles files;
  const std::string nc = files.Put("program.nc", "X1 (SIXPOINT G1/H1)\n");
  const auto refusal = [&](const std::string& json) {
    return std::string(LoadMachiningModel(files.Put("model.json", json), nc).status().message());
  };
  EXPECT_THAT(refusal("{}"), HasSubstr("operations"));
  const std::string odd = refusal(R"({"id": "edm", "part": "p1", "w": 3, "operations": [{"operation": "OP10",
      "hole_group": "G1", "electrode": {"diameter_mm": -1, "length_mm": 60, "length": 60}}],
      "work_offsets": [{"code": "G54", "x_mm": 1e6}], "tool_lengths": [{"number": 0, "length_mm": 1}]})");
  for (const char* field : {"w", "operations[0].electrode.diameter_mm", "operations[0].electrode.length",
                            "work_offsets[0].x_mm", "tool_lengths[0].number"})
    EXPECT_THAT(odd, HasSubstr(field));
  const std::string whole = R"({"id": "edm", "part": "parts/p1", "w_mm": -2.5, "operations": [{"operation": "OP10",
      "hole_group": "G1", "electrode": {"diameter_mm": 0.4, "length_mm": 60}}],
      "work_offsets": [{"code": "G54", "x_mm": 1, "b_deg": 5}], "tool_lengths": [{"number": 7, "length_mm": 120.5}]})";
  const auto request = LoadMachiningModel(files.Put("model.json", whole), nc);
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->machining_model().w_mm(), -2.5);
  EXPECT_EQ(request->machining_model().work_offsets(0).b_deg(), 5);
  EXPECT_EQ(request->machining_model().tool_lengths(0).length_mm(), 120.5);
  const std::string fan = R"({"id": "edm", "part": "p1", "operations": [{"operation": "OP20",
      "electrode": {"diameter_mm": 0.4, "length_mm": 60}, "paths": [{"path": "F1", "a_nominal_deg": 1, "b_nominal_deg": 2,
      "position_tolerance_mm": 0.05, "inclination_tolerance_deg": 0.5, "mouth_mm": 0.3,
      "poses": [[1, 2, 3, 0, 0, 2], [1.5, 2, 3, 0.3, 0, 0.4]]}]}]})";
  const auto fanned = LoadMachiningModel(files.Put("fan.json", fan), nc);
  ASSERT_TRUE(fanned.ok()) << fanned.status();
  const plant::v1::ToolPath& path = fanned->machining_model().operations(0).paths(0);
  ASSERT_EQ(path.poses_size(), 2);
  EXPECT_EQ(path.poses(0).tip_in_part_mm().z_mm(), 3);
  EXPECT_EQ(path.poses(0).axis_in_part().z(), 1);
  EXPECT_EQ(path.poses(1).axis_in_part().x(), 0.6);
  EXPECT_EQ(path.poses(1).axis_in_part().z(), 0.8);
  EXPECT_FALSE(path.has_greatest_step_deg());
  EXPECT_THAT(refusal(R"({"id": "edm", "part": "p1", "operations": [{"operation": "OP20",
      "electrode": {"diameter_mm": 0.4, "length_mm": 60}, "paths": [{"path": "F1", "a_nominal_deg": 1, "b_nominal_deg": 2,
      "position_tolerance_mm": 0.05, "inclination_tolerance_deg": 0.5, "mouth_mm": 0.3,
      "poses": [[1, 2, 3, 0, 0, 0], [1.5, 2, 3, 0.3]]}]}]})"),
              ::testing::AllOf(HasSubstr("paths[0].poses[0]"), HasSubstr("paths[0].poses[1]")));
  EXPECT_EQ(LoadMachiningModel(files.Put("model.json", whole), nc + ".none").status().code(),
            absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace sixpoint::cli
