// A mill's paths on the shape that a blank contains: they keep from the shape what their template keeps from the design.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/correction/correction_service.h"
#include "services/correction/lattice_bytes.h"
#include "services/correction/reconstruction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "storage/machining_models.h"
#include "tests/services/correction/blank_plant.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kRad = 3.14159265358979323846 / 180;
constexpr double kRadius_mm = 2;

// A ball's centre on its way along the span, beside the edge that is machined.
std::vector<metrology::ToolPose> AlongTheEdge(const metrology::Surface& design, double x_mm) {
  std::vector<metrology::ToolPose> poses;
  for (double z_mm = -4; z_mm <= 6; z_mm += 0.25) {
    const metrology::SurfacePoint at = design.Closest({x_mm, 3, z_mm});
    poses.push_back({at.point_mm + kRadius_mm * at.normal, at.normal});
  }
  return poses;
}

class ShapePathsTest : public ::testing::Test {
 protected:
  ShapePathsTest() {
    plant_.plant.machine.mutable_safety_envelope()->set_keep_out_mm(0.1);
    plant::v1::MachiningModel model;
    model.set_name("machining_models/edm");
    model.set_revision(1);
    model.set_part("parts/p1");
    plant::v1::MachiningOperation& operation = *model.add_operations();
    operation.set_operation("OP10");
    operation.mutable_electrode()->set_diameter_mm(2 * kRadius_mm);
    operation.mutable_electrode()->set_length_mm(40);
    plant::v1::ToolPath& path = *operation.add_paths();
    path.set_path("edge");
    path.set_position_tolerance_mm(0.1);
    path.set_inclination_tolerance_deg(1);
    path.set_mouth_mm(0.5);
    poses_ = AlongTheEdge(*plant_.design, 8);
    std::string nc_template =
        "G90 G21\nG0 Z50\nA4 B5 (SIXPOINT edge/1)\nX1 Y2 (SIXPOINT edge/1)\nG1 Z3 F20 (SIXPOINT edge/1)\n";
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      plant::v1::ToolPose& pose = *path.add_poses();
      runtime::ToProto(poses_[i].tip_in_part_mm, pose.mutable_tip_in_part_mm());
      runtime::ToProto(poses_[i].axis_in_part, pose.mutable_axis_in_part());
      if (i > 0) nc_template += "G1 X1 Y2 Z3 A4 B5 F50 (SIXPOINT edge/" + std::to_string(i + 1) + ")\n";
    }
    model.set_nc_template(nc_template + "G0 Z50\nM30\n");
    SetModel(model);
    Keep();
  }

  void SetModel(const plant::v1::MachiningModel& model) {
    plant_.plant.models["machining_models/edm"] = plant_.plant.models["machining_models/edm@1"] = model;
  }
  void Keep() {
    storage::MachiningModelRow row;
    row.machining_model_id = "edm";
    row.content_sha256 = std::string(64, 'a');
    row.part_id = "p1";
    row.part_revision = 1;
    row.operations = {{"OP10", "G1", 2 * kRadius_mm, 40, 1}};
    row.nc_template = "M30\n";
    storage::RecordEntry entry;
    entry.software_version = "test";
    entry.inputs = {"parts/p1@1"};
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    const auto kept = storage::InsertMachiningModel(*transaction, row, entry);
    ASSERT_TRUE(kept.ok()) << kept.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  v1::Reconstruction Reconstruct(double least_mm = -0.9) {
    v1::ReconstructRequest request;
    request.set_registration(testing::kRegistration);
    if (least_mm > -0.9) {
      v1::TriedLimits& tried = *request.add_tried_limits();
      tried.set_region("leading edge");
      tried.set_lower_mm(least_mm);
    }
    v1::Reconstruction made;
    const grpc::Status status = shapes_->Reconstruct(runtime::ContextFor(120).get(), request, &made);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return made;
  }
  absl::StatusOr<v1::Correction> Correct(const std::string& reconstruction) {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    request.set_machining_model("machining_models/edm");
    request.set_reconstruction(reconstruction);
    request.set_request_id(storage::NewUuid());
    v1::Correction made;
    const grpc::Status status = stub_->Correct(runtime::ContextFor(120).get(), request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
  std::string Refusal(const std::string& reconstruction) {
    const auto correction = Correct(reconstruction);
    EXPECT_FALSE(correction.ok());
    return std::string(correction.status().message());
  }
  Vector3d InPart(const v1::CorrectedToolPose& pose) const {
    const Vector3d tip(pose.tip_mm().x_mm(), pose.tip_mm().y_mm(), pose.tip_mm().z_mm());
    return (plant_.block.axes.MachineFromZero(pose.a_deg() * kRad, pose.b_deg() * kRad) *
            plant_.block.pose.zero_from_part)
               .inverse() *
           tip;
  }
  std::shared_ptr<const metrology::Surface> ShapeOf(const v1::Reconstruction& reconstruction) {
    const auto bytes = storage::ReconstructionsIn(plant_.database.database())
                           ->Lattice(reconstruction.lattice_sha256(), testing::Soon());
    EXPECT_TRUE(bytes.ok()) << bytes.status();
    return testing::MovedSurface(*plant_.design, *DeformationOf(*bytes));
  }

  testing::BlankPlant plant_{0.4};
  std::vector<metrology::ToolPose> poses_;
  std::shared_ptr<const clients::BladePeers> peers_ = std::make_shared<const clients::BladePeers>(
      plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect());
  std::shared_ptr<storage::ReconstructionStore> kept_ = storage::ReconstructionsIn(plant_.database.database());
  ReconstructionService reconstructions_{kept_, peers_, {1, 4}, 2};
  CorrectionService corrections_{storage::CorrectionsIn(plant_.database.database()),
                                 storage::CorrectionEventsIn(plant_.database.database()),
                                 kept_,
                                 peers_,
                                 {4, 0},
                                 2};
  testing::InProcessServer server_{{&reconstructions_, &corrections_}};
  std::unique_ptr<v1::ReconstructionService::Stub> shapes_ = v1::ReconstructionService::NewStub(server_.Connect());
  std::unique_ptr<v1::CorrectionService::Stub> stub_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(ShapePathsTest, TheMillKeepsItsDistanceFromTheShape) {
  const v1::Reconstruction shape = Reconstruct();
  ASSERT_EQ(shape.outcome(), v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED);
  const auto correction = Correct(shape.name());
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->reconstruction(), shape.name());
  ASSERT_EQ(correction->groups_size(), 1);
  const v1::CorrectedGroup& edge = correction->groups(0);
  ASSERT_EQ(edge.poses_size(), static_cast<int>(poses_.size()));
  const auto surface = ShapeOf(shape);
  double worst_um = 0, off_design_um = 0, shift_mm = 0;
  for (int i = 0; i < edge.poses_size(); ++i) {
    const Vector3d tip_mm = InPart(edge.poses(i));
    worst_um = std::max(worst_um, 1e3 * std::abs(surface->Closest(tip_mm).signed_distance_mm - kRadius_mm));
    off_design_um =
        std::max(off_design_um, 1e3 * std::abs(plant_.design->Closest(tip_mm).signed_distance_mm - kRadius_mm));
    shift_mm = std::max(shift_mm, (tip_mm - poses_[static_cast<std::size_t>(i)].tip_in_part_mm).norm());
  }
  EXPECT_LT(worst_um, 3);
  EXPECT_GT(off_design_um, 30) << "the shape is where the design is: nothing is tested";
  ASSERT_TRUE(edge.has_adaptation());
  EXPECT_NEAR(edge.adaptation().greatest_shift_mm(), shift_mm, 1e-4);
  EXPECT_GT(edge.adaptation().greatest_turn_deg(), 0.1);
  EXPECT_LT(edge.adaptation().gouge_um(), 5);
  EXPECT_LT(edge.adaptation().rest_um(), 20);
  // What the gate asks of it, and the envelope that sees the shape's way beside the registered pose's.
  bool asked = false;
  for (const v1::ReleaseCheck& check : correction->checks()) {
    if (check.kind() == v1::RELEASE_CHECK_KIND_SHAPE_GOUGE) {
      asked = true;
      EXPECT_EQ(check.subject(), "edge");
      EXPECT_EQ(check.value(), edge.adaptation().gouge_um());
      EXPECT_TRUE(check.passed());
    }
  }
  EXPECT_TRUE(asked);
  EXPECT_EQ(correction->state(), v1::CORRECTION_STATE_RELEASED) << correction->DebugString();
  EXPECT_TRUE(correction->has_proof());

  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  v1::Correction back;
  ASSERT_TRUE(stub_->GetCorrection(runtime::ContextFor(10).get(), get, &back).ok());
  v1::Correction without_program = *correction;
  without_program.clear_nc_program();
  EXPECT_EQ(back.DebugString(), without_program.DebugString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, shape.name());
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, ElementsAre(correction->name()));

  v1::ReplayCorrectionRequest again;
  again.set_name(correction->name());
  replay::v1::Replay replay;
  const grpc::Status replayed = stub_->ReplayCorrection(runtime::ContextFor(120).get(), again, &replay);
  ASSERT_TRUE(replayed.ok()) << replayed.error_message();
  EXPECT_EQ(replay.outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS) << replay.DebugString();
  EXPECT_THAT(replay.taken_as_recorded(), Contains("reconstruction"));
}

TEST_F(ShapePathsTest, WhatIsNoShapeForThisProgramIsRefused) {
  const v1::Reconstruction tried = Reconstruct(-0.85), none = Reconstruct(-0.05);
  ASSERT_EQ(tried.outcome(), v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED);
  EXPECT_THAT(Refusal(tried.name()),
              HasSubstr("reconstruction: " + tried.name() + " is of other limits than the part's"));
  ASSERT_EQ(none.outcome(), v1::RECONSTRUCTION_OUTCOME_INFEASIBLE);
  EXPECT_THAT(Refusal(none.name()), HasSubstr("is INFEASIBLE, want one that found a shape"));
  EXPECT_THAT(Refusal("reconstructions/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e"), HasSubstr("018f6f3e"));
  EXPECT_THAT(Refusal("reconstructions/1"), HasSubstr("reconstruction: 1, want"));
  const v1::Reconstruction shape = Reconstruct();
  plant::v1::MachiningModel model = plant_.plant.models["machining_models/edm"];
  model.mutable_operations(0)->set_hole_group("G1");
  model.mutable_operations(0)->mutable_electrode()->set_diameter_mm(0.4);
  model.mutable_operations(0)->clear_paths();
  SetModel(model);
  EXPECT_THAT(Refusal(shape.name()), HasSubstr("has no paths"));
}

}  // namespace
}  // namespace sixpoint::correction
