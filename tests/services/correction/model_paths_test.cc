// A shaped hole as a path of the tool: corrected with the holes of its machining model, judged, fetched and reported cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "metrology/frames/angles.h"
#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::correction {
namespace {

using metrology::kRadPerDeg;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kPoses = 21;

// A fan on the block's top, 2 mm along X, from upright to 20 degrees.
metrology::ToolPose PoseOfFan(int i) {
  const double share = i / (kPoses - 1.0), lean_rad = 20 * kRadPerDeg * share;
  return {{2 * share, -6, 0}, {std::sin(lean_rad), 0, std::cos(lean_rad)}};
}

std::string TemplateOfFan(int poses) {
  std::string text =
      "G90 G21\nG0 Z50\nA4 B5 X1 Y2 (SIXPOINT G1/H1)\nG1 Z3 F200 (SIXPOINT G1/H1)\nG0 Z50\n"
      "A4 B5 X1 Y2 (SIXPOINT G1/H2)\nG1 Z3 F200 (SIXPOINT G1/H2)\nG0 Z50\n"
      "A4 B5 (SIXPOINT F1/1)\nX1 Y2 (SIXPOINT F1/1)\nG1 Z3 F20 (SIXPOINT F1/1)\n";
  for (int i = 2; i <= poses; ++i) text += "G1 X1 Y2 Z3 A4 B5 F5 (SIXPOINT F1/" + std::to_string(i) + ")\n";
  return text + "G0 Z50\nM30\n";
}

class ModelPathsTest : public ::testing::Test {
 protected:
  using Stub = v1::CorrectionService::Stub;

  ModelPathsTest() {
    plant_.plant.machine.mutable_safety_envelope()->set_keep_out_mm(0.1);
    plant_.plant.AddModel();
    plant::v1::MachiningModel model = plant_.plant.models["machining_models/edm"];
    model.clear_work_offsets();
    model.set_nc_template(TemplateOfFan(kPoses));
    plant::v1::MachiningOperation& operation = *model.add_operations();
    operation.set_operation("OP20");
    operation.mutable_electrode()->set_diameter_mm(0.4);
    operation.mutable_electrode()->set_length_mm(60);
    plant::v1::ToolPath& path = *operation.add_paths();
    path.set_path("F1");
    path.set_a_nominal_deg(plant_.plant.part.hole_groups(0).a_nominal_deg());
    path.set_b_nominal_deg(plant_.plant.part.hole_groups(0).b_nominal_deg());
    path.set_position_tolerance_mm(0.05);
    path.set_inclination_tolerance_deg(0.5);
    path.set_mouth_mm(0.3);
    for (int i = 0; i < kPoses; ++i) {
      plant::v1::ToolPose& pose = *path.add_poses();
      runtime::ToProto(PoseOfFan(i).tip_in_part_mm, pose.mutable_tip_in_part_mm());
      runtime::ToProto(PoseOfFan(i).axis_in_part, pose.mutable_axis_in_part());
    }
    SetModel(model);
    plant_.StoreModel({{"OP10", "G1", 0.4, 60}, {"OP20", "", 0.4, 60}});
  }

  void SetModel(const plant::v1::MachiningModel& model) {
    plant_.plant.models["machining_models/edm"] = plant_.plant.models["machining_models/edm@1"] = model;
  }
  void TakePathsAlone() {
    plant::v1::MachiningModel model = Model();
    model.mutable_operations()->DeleteSubrange(0, 1);
    const std::string text = TemplateOfFan(kPoses);
    model.set_nc_template("G90 G21\nG0 Z50\n" + text.substr(text.find("A4 B5 (SIXPOINT F1/1)")));
    SetModel(model);
  }
  plant::v1::MachiningModel Model() { return plant_.plant.models["machining_models/edm"]; }
  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                const Request& request) {
    Response response;
    const grpc::Status status =
        (stub_.get()->*method)(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }
  absl::StatusOr<v1::Correction> Correct() {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    request.set_machining_model("machining_models/edm");
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::Correct, request);
  }
  absl::StatusOr<v1::Correction> Cut(const std::string& name, const std::string& group, const std::string& hole) {
    v1::ReportCutRequest request;
    request.set_name(name);
    v1::CutHole& cut = *request.add_holes();
    cut.set_group(group);
    cut.set_hole(hole);
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::ReportCut, request);
  }
  absl::StatusOr<v1::FetchProgramResponse> Fetch(const std::string& name) {
    v1::FetchProgramRequest request;
    request.set_name(name);
    request.set_machine(plant_.plant.machine.name());
    request.set_blade("blades/sn1");
    request.set_clamping(plant_.registration.registration.clamping());
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::FetchProgram, request);
  }
  std::string Refusal() {
    const auto correction = Correct();
    EXPECT_FALSE(correction.ok());
    return std::string(correction.status().message());
  }

  testing::JudgedPlant plant_;
  std::unique_ptr<storage::Database> database_ =
      storage::Database::Open(testing::AsRole(plant_.database.conninfo(), "correction"), 4);
  CorrectionService service_{
      storage::CorrectionsIn(database_.get()),
      storage::CorrectionEventsIn(database_.get()),
      {storage::ReconstructionsIn(database_.get()), storage::MachiningPassesIn(database_.get()),
       storage::RepairsIn(database_.get())},
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {4, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(ModelPathsTest, IsCorrectedPoseByPoseAndReadBackTheSame) {
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  ASSERT_EQ(correction->groups_size(), 2);
  EXPECT_EQ(correction->groups(0).poses_size(), 0);
  const v1::CorrectedGroup& path = correction->groups(1);
  EXPECT_EQ(path.group(), "F1");
  ASSERT_EQ(path.holes_size(), 1);
  EXPECT_EQ(path.holes(0).hole(), "F1");
  ASSERT_EQ(path.poses_size(), kPoses);
  double worst_um = 0;
  for (int i = 0; i < kPoses; ++i) {
    // Through the machine's own chain the commands come back to the nominal poses on the part as it stands.
    const v1::CorrectedToolPose& pose = path.poses(i);
    const Eigen::Isometry3d machine_from_part =
        plant_.block.axes.MachineFromZero(pose.a_deg() * kRadPerDeg, pose.b_deg() * kRadPerDeg) *
        plant_.block.pose.zero_from_part;
    const Eigen::Vector3d tip_mm(pose.tip_mm().x_mm(), pose.tip_mm().y_mm(), pose.tip_mm().z_mm());
    EXPECT_LT((machine_from_part * PoseOfFan(i).tip_in_part_mm - tip_mm).norm(), 1e-9) << i;
    EXPECT_LT((machine_from_part.linear() * PoseOfFan(i).axis_in_part - Eigen::Vector3d::UnitZ()).norm(), 1e-9) << i;
    // The nominal part stands 0.3 mm lower.
    const geometry::v1::Point& nominal = pose.nominal_tip_mm();
    EXPECT_NEAR((tip_mm - Eigen::Vector3d(nominal.x_mm(), nominal.y_mm(), nominal.z_mm())).norm(), 0.3, 1e-9);
    EXPECT_NEAR(pose.a_deg(), pose.a_nominal_deg(), 1e-9);
    EXPECT_GT(pose.expanded_uncertainty_um(), 0.1);
    worst_um = std::max(worst_um, pose.expanded_uncertainty_um());
  }
  EXPECT_EQ(path.holes(0).expanded_uncertainty_um(), worst_um);
  EXPECT_EQ(path.holes(0).start_mm().SerializeAsString(), path.poses(0).tip_mm().SerializeAsString());
  EXPECT_FALSE(path.holes(0).budget().empty());
  EXPECT_GT(path.greatest_chord_um(), 0);
  EXPECT_LT(path.greatest_chord_um(), 12.5);  // a quarter of the tolerance
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC) << correction->release_reasons(0);
  EXPECT_GE(correction->proof().pose_count(), 2 + kPoses);
  const v1::ReleaseCheck& check = correction->checks(correction->checks_size() - 1);
  EXPECT_EQ(check.kind(), v1::RELEASE_CHECK_KIND_TOOL_CYLINDER);
  EXPECT_TRUE(check.passed());

  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  const auto back = Call(&Stub::GetCorrection, get);
  ASSERT_TRUE(back.ok()) << back.status();
  v1::Correction without_program = *correction;
  without_program.clear_nc_program();
  EXPECT_EQ(back->SerializeAsString(), without_program.SerializeAsString());
  v1::ListCorrectionsRequest list;
  list.set_view(list::v1::VIEW_FULL);
  const auto listed = Call(&Stub::ListCorrections, list);
  ASSERT_TRUE(listed.ok()) << listed.status();
  EXPECT_EQ(listed->corrections(0).groups(1).holes_size(), 1);
  EXPECT_EQ(listed->corrections(0).groups(1).poses_size(), 0) << "lists leave poses out";
}

TEST_F(ModelPathsTest, IsCutAsOneOrLeft) {
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_THAT(std::string(Cut(correction->name(), "F1", "3").status().message()),
              HasSubstr("holes[0]: F1/3, want a hole of"));
  ASSERT_TRUE(Cut(correction->name(), "G1", "H1").ok());
  auto rest = Fetch(correction->name());
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->hole_count(), 2);
  EXPECT_EQ(rest->cut_count(), 1);
  EXPECT_THAT(rest->nc_program(), Not(HasSubstr("G1/H1")));
  EXPECT_THAT(rest->nc_program(), HasSubstr("F1/21"));
  ASSERT_TRUE(Cut(correction->name(), "F1", "F1").ok());
  rest = Fetch(correction->name());
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->hole_count(), 1);
  EXPECT_THAT(rest->nc_program(), HasSubstr("G1/H2"));
  EXPECT_THAT(rest->nc_program(), Not(HasSubstr("F1/")));
  // Another correction of the blade would cut it again.
  const auto again = Correct();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->state(), v1::CORRECTION_STATE_DRAFT);
  EXPECT_THAT(again->release_reasons(0), HasSubstr("CUT_BEFORE"));
}

// Its program is written by a post-processor, for a control that turns directions into its axes by itself.
TEST_F(ModelPathsTest, DirectionsAreProvenByTheAxesOfTheRecord) {
  plant::v1::MachiningModel model = Model();
  plant::v1::PostProcessor& post = *model.mutable_post_processor();
  plant::v1::AxisWords& words = *post.mutable_axis_words();
  words.set_x("X");
  words.set_y("Y");
  words.set_z("Z");
  words.set_a("C1");
  words.set_b("B");
  post.set_tool_orientation(plant::v1::TOOL_ORIENTATION_DIRECTIONS);
  std::string text = std::regex_replace(TemplateOfFan(kPoses), std::regex("A4"), "C1=4");
  text = std::regex_replace(text, std::regex("\\(SIXPOINT ([^)]*)\\)"), "; SIXPOINT $1");
  text = std::regex_replace(text, std::regex("Z3 C1=4 B5 F5"), "Z3 A3=0.00000000 B3=0.00000000 C3=0.00000000 F5");
  text = std::regex_replace(text, std::regex("(Z3 F20 ; SIXPOINT F1/1\n)"), "$1TRAORI\nORIWKS\n");
  model.set_nc_template(text.replace(text.rfind("G0 Z50"), 0, "TRAFOOF\n"));
  SetModel(model);
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_THAT(correction->nc_program(), ::testing::ContainsRegex("A3=0.3[0-9]+ B3=-?0.0[0-9]+ C3=0.9[0-9]+ F5"));
  EXPECT_LT(correction->proof().greatest_difference_um(), 0.5);
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC) << correction->release_reasons(0);
  ASSERT_TRUE(Cut(correction->name(), "G1", "H1").ok());
  const auto rest = Fetch(correction->name());
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_THAT(rest->nc_program(), Not(HasSubstr("G1/H1")));
  EXPECT_THAT(rest->nc_program(), HasSubstr("TRAORI"));
  // The same, but nobody says that the control holds those axes.
  model.mutable_post_processor()->set_tool_orientation(plant::v1::TOOL_ORIENTATION_ROTARY_AXES);
  SetModel(model);
  EXPECT_THAT(Refusal(), HasSubstr("no TRAORI: the control's transformation is not stated"));
}

TEST_F(ModelPathsTest, AModelOfPathsAloneIsCorrected) {
  TakePathsAlone();
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  ASSERT_EQ(correction->groups_size(), 1);
  EXPECT_EQ(correction->groups(0).poses_size(), kPoses);
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC) << correction->release_reasons(0);
}

TEST_F(ModelPathsTest, WhatTheWayBetweenPosesDoesIsLookedAt) {
  // Two poses for the whole fan: between them the tip leaves its line.
  plant::v1::MachiningModel model = Model();
  plant::v1::ToolPath& path = *model.mutable_operations(1)->mutable_paths(0);
  path.mutable_poses()->DeleteSubrange(1, kPoses - 2);
  path.set_greatest_step_deg(60);
  model.set_nc_template(TemplateOfFan(2));
  SetModel(model);
  EXPECT_THAT(Refusal(), HasSubstr("paths[F1].poses[0]: to the next one 135.489 um from the line"));
}

TEST_F(ModelPathsTest, APoseBeyondALimitIsNamed) {
  TakePathsAlone();
  for (plant::v1::Joint& joint : *plant_.plant.machine.mutable_kinematics()->mutable_part_side()) {
    joint.set_minimum(-10);
    joint.set_maximum(10);
  }
  const auto refused = Correct().status();
  EXPECT_EQ(runtime::ReasonOf(refused), "POSE_OUT_OF_LIMITS") << refused;
  EXPECT_THAT(std::string(refused.message()), ::testing::ContainsRegex("paths.F1..targets.[0-9]+..A.*deg beyond"));
}

TEST_F(ModelPathsTest, AToolThatCutsBesideItsMouthWaitsForAPerson) {
  // 0.4 mm deep in the block: the electrode's wall stands in what is not its mouth.
  plant::v1::MachiningModel model = Model();
  plant::v1::ToolPath& path = *model.mutable_operations(1)->mutable_paths(0);
  for (plant::v1::ToolPose& pose : *path.mutable_poses())
    runtime::ToProto(Eigen::Vector3d(pose.tip_in_part_mm().x_mm() + 14.2, -6, -0.9), pose.mutable_tip_in_part_mm());
  SetModel(model);
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->state(), v1::CORRECTION_STATE_DRAFT);
  const v1::ReleaseCheck& check = correction->checks(correction->checks_size() - 1);
  EXPECT_EQ(check.kind(), v1::RELEASE_CHECK_KIND_TOOL_CYLINDER);
  EXPECT_FALSE(check.passed());
  EXPECT_THAT(check.subject(), HasSubstr("F1/"));
}

// First order beside draws, of what the correction rests on; of a path at its most uncertain pose.
TEST_F(ModelPathsTest, ItsBudgetIsComputedByDrawsToo) {
  const auto correction = Correct();
  ASSERT_TRUE(correction.ok()) << correction.status();
  v1::ComputeBudgetRequest request;
  request.set_name(correction->name());
  const auto budget = Call(&Stub::ComputeBudget, request);
  ASSERT_TRUE(budget.ok()) << budget.status();
  EXPECT_EQ(budget->draws(), 10'000);
  ASSERT_EQ(budget->holes_size(), 3);
  for (int i = 0; i < 2; ++i) {
    const v1::HoleBudget& hole = budget->holes(i);
    const v1::CorrectedHole& stated = correction->groups(0).holes(i);
    EXPECT_EQ(hole.group() + "/" + hole.hole(), "G1/" + stated.hole());
    EXPECT_EQ(hole.expanded_uncertainty_um(), stated.expanded_uncertainty_um());
    EXPECT_NEAR(hole.drawn_expanded_uncertainty_um() / hole.expanded_uncertainty_um(), 1, 0.05);
    EXPECT_LT(hole.drawn_low_um(), hole.drawn_expanded_uncertainty_um());
    EXPECT_GT(hole.drawn_high_um(), hole.drawn_expanded_uncertainty_um());
    EXPECT_EQ(hole.position_tolerance_um(), 60);
    ASSERT_EQ(hole.lines_size(), stated.budget_size());
    double share = 0;
    for (const v1::BudgetLine& line : hole.lines()) {
      EXPECT_NEAR(line.drawn_standard_uncertainty_um() / line.standard_uncertainty_um(), 1, 0.05) << line.source();
      share += line.share();
    }
    EXPECT_NEAR(share, 1, 1e-12);
  }
  EXPECT_EQ(budget->holes(2).hole(), "F1");
  const v1::HoleBudget& path = budget->holes(2);
  EXPECT_EQ(path.expanded_uncertainty_um(), correction->groups(1).holes(0).expanded_uncertainty_um());
  EXPECT_NEAR(path.drawn_expanded_uncertainty_um() / path.expanded_uncertainty_um(), 1, 0.05);
  for (const v1::BudgetLine& line : path.lines())
    EXPECT_NEAR(line.drawn_standard_uncertainty_um() / line.standard_uncertainty_um(), 1, 0.05) << line.source();
  request.set_draws(999);
  EXPECT_THAT(std::string(Call(&Stub::ComputeBudget, request).status().message()),
              HasSubstr("draws: 999, want 0, or 1000 to 200000"));
  request.set_draws(-1);
  EXPECT_FALSE(Call(&Stub::ComputeBudget, request).ok());
  request.set_name("corrections/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e");
  EXPECT_TRUE(absl::IsNotFound(Call(&Stub::ComputeBudget, request).status()));
}

TEST_F(ModelPathsTest, WhatIsNotAskedForWholeOrCannotBeLookedAtIsRefused) {
  v1::CorrectRequest request;
  request.set_registration(testing::kRegistration);
  request.set_machining_model("machining_models/edm");
  request.add_groups("F1");
  request.set_request_id(storage::NewUuid());
  EXPECT_THAT(std::string(Call(&Stub::Correct, request).status().message()),
              HasSubstr("groups: 1 of them, want none, or all of machining_models/edm@1 (G1, F1)"));
  request.add_groups("G1");
  request.set_dry_run(true);
  EXPECT_TRUE(Call(&Stub::Correct, request).ok());
  plant::v1::MachiningModel model = Model();
  model.mutable_operations(1)->mutable_paths(0)->set_mouth_mm(0.05);  // the keep-out is 0.1
  SetModel(model);
  EXPECT_THAT(Refusal(), HasSubstr("mouth"));
  model = Model();
  std::string text = TemplateOfFan(kPoses);
  text.erase(text.find("G1 X1 Y2 Z3 A4 B5 F5 (SIXPOINT F1/7)"), 37);
  model.mutable_operations(1)->mutable_paths(0)->set_mouth_mm(0.3);
  model.set_nc_template(text);
  SetModel(model);
  EXPECT_THAT(Refusal(), HasSubstr("F1/7"));
}

}  // namespace
}  // namespace sixpoint::correction
