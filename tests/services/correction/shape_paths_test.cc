// A mill's paths on the shape that a blank contains: they keep from the shape what their template keeps from the design.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <optional>

#include "metrology/frames/angles.h"
#include "services/correction/correction_service.h"
#include "services/correction/lattice_bytes.h"
#include "services/correction/machining_pass_service.h"
#include "services/correction/reconstruction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "tests/services/correction/blank_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kElectrodeRadius_mm = 2;

// A ball's centre on its way along the span, beside the edge that is machined.
std::vector<metrology::ToolPose> AlongTheEdge(const metrology::Surface& design, double x_mm) {
  std::vector<metrology::ToolPose> poses;
  for (double z_mm = -4; z_mm <= 6; z_mm += 0.25) {
    const metrology::SurfacePoint at = design.Closest({x_mm, 3, z_mm});
    poses.push_back({at.point_mm + kElectrodeRadius_mm * at.normal, at.normal});
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
    operation.mutable_electrode()->set_diameter_mm(2 * kElectrodeRadius_mm);
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
    plant_.StoreModel({{"OP10", "G1", 2 * kElectrodeRadius_mm, 40, 1}});
  }

  void SetModel(const plant::v1::MachiningModel& model) {
    plant_.plant.models["machining_models/edm"] = plant_.plant.models["machining_models/edm@1"] = model;
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
    const grpc::Status status =
        shapes_->Reconstruct(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &made);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return made;
  }
  absl::StatusOr<v1::Correction> Correct(const std::string& reconstruction, const std::string& pass = "") {
    v1::CorrectRequest request;
    request.set_registration(plant_.registration.registration.name());
    request.set_machining_model("machining_models/edm");
    request.set_reconstruction(reconstruction);
    request.set_machining_pass(pass);
    request.set_request_id(storage::NewUuid());
    v1::Correction made;
    const grpc::Status status =
        stub_->Correct(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
  // All that stands above the shape is cut by a tool that gives way by a share of what it removes; then it is scanned and registered anew.
  // deeper: commanded beyond the shape by a part of what it gives way.
  void Cut(const v1::Correction& correction, const metrology::Surface& shape, double share, double deeper,
           const std::string& again) {
    v1::ReportCutRequest report;
    report.set_name(correction.name());
    report.add_holes()->set_group("edge");
    report.mutable_holes(0)->set_hole("edge");
    report.set_request_id(storage::NewUuid());
    v1::Correction cut;
    const grpc::Status reported = stub_->ReportCut(runtime::ContextFor(30).get(), report, &cut);
    ASSERT_TRUE(reported.ok()) << reported.error_message();
    plant_.Become([&](const testing::BlankPoint& before) {
      testing::BlankPoint point = before;
      if (!(point.place_mm.x() > testing::kEdge_mm && point.place_mm.z() > -6)) return point;
      const metrology::SurfacePoint foot = shape.Closest(point.point_mm);
      // rest = share * (removed - deeper * stock), removed = stock - rest
      const double stock_mm = foot.signed_distance_mm, rest_mm = share * (1 - deeper) * stock_mm / (1 + share);
      if (stock_mm > rest_mm) point.point_mm = foot.point_mm + rest_mm * foot.normal;
      return point;
    });
    plant_.registration.registration.set_name(again);
    plant_.registration.registration.mutable_scans_received_at()->set_seconds(std::time(nullptr) + 2);
    plant_.StoreRegistration(again);
  }
  absl::StatusOr<v1::MachiningPass> Look(const std::string& correction, std::optional<double> rest_mm) {
    v1::NextPassRequest request;
    request.set_correction(correction);
    request.set_registration(plant_.registration.registration.name());
    if (rest_mm) request.set_greatest_rest_mm(*rest_mm);
    request.set_request_id(storage::NewUuid());
    v1::MachiningPass pass;
    const grpc::Status status =
        looks_->NextPass(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &pass);
    if (!status.ok()) return runtime::FromGrpc(status);
    return pass;
  }
  std::string Refusal(const std::string& reconstruction) {
    const auto correction = Correct(reconstruction);
    EXPECT_FALSE(correction.ok());
    return std::string(correction.status().message());
  }
  Vector3d InPart(const v1::CorrectedToolPose& pose) const {
    const Vector3d tip(pose.tip_mm().x_mm(), pose.tip_mm().y_mm(), pose.tip_mm().z_mm());
    return (plant_.block.axes.MachineFromZero(pose.a_deg() * kRadPerDeg, pose.b_deg() * kRadPerDeg) *
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
  CorrectionService corrections_{
      storage::CorrectionsIn(plant_.database.database()),
      storage::CorrectionEventsIn(plant_.database.database()),
      {kept_, storage::MachiningPassesIn(plant_.database.database()), storage::RepairsIn(plant_.database.database())},
      peers_,
      {4, 0},
      2};
  MachiningPassService passes_{
      {kept_, storage::MachiningPassesIn(plant_.database.database()), storage::RepairsIn(plant_.database.database())},
      storage::CorrectionsIn(plant_.database.database()),
      peers_,
      {1, 4},
      2};
  testing::InProcessServer server_{{&reconstructions_, &corrections_, &passes_}};
  std::unique_ptr<v1::MachiningPassService::Stub> looks_ = v1::MachiningPassService::NewStub(server_.Connect());
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
    worst_um = std::max(worst_um, 1e3 * std::abs(surface->Closest(tip_mm).signed_distance_mm - kElectrodeRadius_mm));
    off_design_um = std::max(off_design_um,
                             1e3 * std::abs(plant_.design->Closest(tip_mm).signed_distance_mm - kElectrodeRadius_mm));
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
  const grpc::Status replayed =
      stub_->ReplayCorrection(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), again, &replay);
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

constexpr char kAgain[] = "registrations/00000000-0000-7000-8000-000000000013";
constexpr char kOnceMore[] = "registrations/00000000-0000-7000-8000-000000000023";

// The published loop: machined, scanned, compared, and once more by what the tool was seen to leave.
TEST_F(ShapePathsTest, TheNextPassIsCommandedByWhatTheOneBeforeLeft) {
  constexpr double kShare = 0.5, kWithin_mm = 0.02;
  const v1::Reconstruction shape = Reconstruct();
  const auto surface = ShapeOf(shape);
  const auto first = Correct(shape.name());
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_THAT(std::string(Look(first->name(), kWithin_mm).status().message()), HasSubstr("has not cut edge/edge"));
  Cut(*first, *surface, kShare, 0, kAgain);
  auto* const received_at = plant_.registration.registration.mutable_scans_received_at();
  const std::int64_t after_s = received_at->seconds();
  received_at->set_seconds(after_s - 3600);
  EXPECT_THAT(std::string(Look(first->name(), kWithin_mm).status().message()),
              HasSubstr("has scans from before the cut was reported"));
  received_at->set_seconds(after_s);
  const auto left = Look(first->name(), kWithin_mm);
  ASSERT_TRUE(left.ok()) << left.status();
  ASSERT_EQ(left->outcome(), v1::MACHINING_PASS_OUTCOME_ANOTHER_PASS) << left->DebugString();
  EXPECT_EQ(left->number(), 1);
  EXPECT_EQ(left->correction(), first->name());
  EXPECT_EQ(left->reconstruction(), shape.name());
  ASSERT_EQ(left->regions_size(), 3);
  EXPECT_NEAR(left->regions(0).deflection_share(), kShare, 0.03);
  EXPECT_NEAR(left->regions(0).offset_um(), 0, 5);
  EXPECT_GT(left->regions(0).greatest_rest_um(), 30);
  EXPECT_FALSE(left->regions(1).has_mean_rest_um());

  v1::GetMachiningPassRequest get;
  get.set_name(left->name());
  v1::MachiningPass back;
  ASSERT_TRUE(looks_->GetMachiningPass(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), left->DebugString());
  v1::ReplayMachiningPassRequest replay_request;
  replay_request.set_name(left->name());
  replay::v1::Replay replay;
  ASSERT_TRUE(
      looks_
          ->ReplayMachiningPass(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), replay_request, &replay)
          .ok());
  EXPECT_EQ(replay.outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS) << replay.DebugString();

  const auto second = Correct("", left->name());
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->machining_pass(), left->name());
  EXPECT_EQ(second->reconstruction(), shape.name());
  EXPECT_EQ(second->state(), v1::CORRECTION_STATE_RELEASED) << second->DebugString();
  const v1::CorrectedGroup& edge = second->groups(0);
  EXPECT_GT(edge.adaptation().deepest_compensation_um(), 2);
  EXPECT_LT(edge.adaptation().gouge_um(), 5);
  // Deeper than the shape by what the tool will give way: a share of what is left there.
  double worst_um = 0, deeper_um = 0, gives_way_um = 0;
  for (const v1::CorrectedToolPose& pose : edge.poses()) {
    const metrology::SurfacePoint foot = surface->Closest(InPart(pose));
    double stock_mm = 0, nearest_mm = 1;
    for (const testing::BlankPoint& point : plant_.truth)
      if (const double away_mm = (point.point_mm - foot.point_mm).norm(); away_mm < nearest_mm) {
        nearest_mm = away_mm;
        stock_mm = surface->Closest(point.point_mm).signed_distance_mm;
      }
    const double deeper_mm = kElectrodeRadius_mm - foot.signed_distance_mm;
    worst_um = std::max(worst_um, 1e3 * std::abs(deeper_mm - kShare * stock_mm));
    deeper_um += 1e3 * deeper_mm;
    gives_way_um += 1e3 * kShare * stock_mm;
  }
  EXPECT_LT(worst_um, 5);
  EXPECT_GT(gives_way_um / edge.poses_size(), 5) << "nothing gives way: nothing is tested";
  EXPECT_NEAR(deeper_um / gives_way_um, 1, 0.15);

  Cut(*second, *surface, kShare, deeper_um / gives_way_um, kOnceMore);
  const auto done = Look(second->name(), kWithin_mm);
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_EQ(done->outcome(), v1::MACHINING_PASS_OUTCOME_DONE) << done->DebugString();
  EXPECT_EQ(done->number(), 2);
  EXPECT_EQ(done->remark(), "");
  EXPECT_THAT(std::string(Correct("", done->name()).status().message()), HasSubstr("is DONE, want one after which"));
  v1::ListMachiningPassesRequest list;
  list.set_blade("blades/sn1");
  list.set_outcome(v1::MACHINING_PASS_OUTCOME_ANOTHER_PASS);
  v1::ListMachiningPassesResponse listed;
  ASSERT_TRUE(looks_->ListMachiningPasses(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.machining_passes_size(), 1);
  EXPECT_EQ(listed.machining_passes(0).name(), left->name());
}

}  // namespace
}  // namespace sixpoint::correction
