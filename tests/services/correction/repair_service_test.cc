// A welded blade's repair by the service: kept and read back, judged by the blade as it truly is, and its laps as a program.
#include "services/correction/repair_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/frames/angles.h"
#include "metrology/frames/pose.h"
#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "tests/metrology/repair/bent_blades.h"
#include "tests/services/correction/scanned_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using metrology::KnownPolygon;
using metrology::kRadPerDeg;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kLine_mm = 28, kTop_mm = 38, kWeld_mm = 0.6, kMillRadius_mm = 2;

// Its span lies along the axis of B, so that a scanner sees all around it.
class WeldedPlant : public testing::ScannedPlant {
 public:
  WeldedPlant() : ScannedPlant(metrology::KnownSurface(-2, 40)) {
    Eigen::Matrix3d along;
    along << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    block.pose.zero_from_part.linear() = metrology::RotationFromVector({0.01, -0.02, 0.015}) * along;
    block.pose.zero_from_part.translation() = block.axes.a.point_mm + Vector3d(-20, 1, 2);
    block.pose.noise.reference_mm = block.pose.zero_from_part.translation();
    for (auto* pose : {plant.part.mutable_zero_from_part_nominal(), registration.registration.mutable_zero_from_part()})
      runtime::ToProto(block.pose.zero_from_part, pose);
    for (auto* covariance :
         {registration.registration.mutable_covariance(), registration.registration.mutable_noise_covariance()})
      runtime::ToProto(block.pose.zero_from_part.translation(), covariance->mutable_reference_mm());
    for (plant::v1::Joint& joint : *plant.machine.mutable_kinematics()->mutable_part_side()) {
      joint.set_minimum(-400);
      joint.set_maximum(400);
    }
    plant.machine.mutable_safety_envelope()->set_keep_out_mm(0.1);
    Weld();
    ScanAt({0, 90, 180, -90});
  }

 private:
  void Weld() {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(0, 1);
    while (truth.size() < 240000) {
      const double z_mm = -0.5 + (kTop_mm + 1) * unit(random);
      const std::vector<Vector2d> polygon = KnownPolygon(z_mm, motion);
      for (int k = 0; k < 40; ++k) {
        const auto i = static_cast<std::size_t>(unit(random) * static_cast<double>(polygon.size()));
        const Vector2d way = polygon[(i + 1) % polygon.size()] - polygon[i];
        const Vector2d out = Vector2d(way.y(), -way.x()).normalized();
        const Vector2d point = polygon[i] + unit(random) * way + (z_mm > kLine_mm + 0.2 ? kWeld_mm : 0) * out;
        const Vector3d normal(out.x(), out.y(), 0), at(point.x(), point.y(), z_mm);
        truth.push_back({at, normal, at, normal});
      }
    }
  }

 public:
  const metrology::SectionMotion motion = metrology::Bent(0.1, 0.002, 0.01);
};

class RepairServiceTest : public ::testing::Test {
 protected:
  static v1::PlanRepairRequest Request() {
    v1::PlanRepairRequest request;
    request.set_registration(testing::kRegistration);
    v1::RepairHeights& heights = *request.mutable_heights();
    heights.set_repair_line_mm(kLine_mm);
    heights.set_target_mm(kTop_mm);
    request.mutable_mill()->set_diameter_mm(2 * kMillRadius_mm);
    request.mutable_mill()->set_length_mm(30);
    v1::RepairMethod& method = *request.mutable_method();
    method.set_scallop_um(100);
    method.set_depth_of_cut_mm(1);
    method.set_chord_um(5);
    method.set_greatest_uncertainty_um(100);
    return request;
  }
  absl::StatusOr<v1::Repair> Plan(v1::PlanRepairRequest request) {
    request.set_request_id(storage::NewUuid());
    v1::Repair made;
    const grpc::Status status =
        stub_->PlanRepair(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
  std::string Refusal(const v1::PlanRepairRequest& request) {
    const auto made = Plan(request);
    EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument) << made.status();
    return std::string(made.status().message());
  }
  std::vector<v1::RepairLap> Laps(const std::string& name) {
    v1::DownloadRepairPathRequest request;
    request.set_name(name);
    const auto context = runtime::ContextFor(30);
    const auto reader = stub_->DownloadRepairPath(context.get(), request);
    std::vector<v1::RepairLap> laps;
    for (v1::RepairLap lap; reader->Read(&lap);) laps.push_back(lap);
    EXPECT_TRUE(reader->Finish().ok());
    return laps;
  }

  // A model whose one path says how laps are cut; its post-processor writes them.
  void SetModel(double diameter_mm) {
    plant::v1::MachiningModel model;
    model.set_name("machining_models/edm");
    model.set_revision(1);
    model.set_part("parts/p1");
    plant::v1::MachiningOperation& operation = *model.add_operations();
    operation.set_operation("OP10");
    operation.set_feed_mm_min(300);
    operation.mutable_electrode()->set_diameter_mm(diameter_mm);
    operation.mutable_electrode()->set_length_mm(30);
    plant::v1::ToolPath& path = *operation.add_paths();
    path.set_path("tip");
    path.set_position_tolerance_mm(0.1);
    path.set_inclination_tolerance_deg(1);
    path.set_mouth_mm(3);
    path.set_greatest_step_deg(20);
    plant::v1::PostProcessor& post = *model.mutable_post_processor();
    post.set_program_start("G90 G21");
    post.set_path_start("G0 Z50\nG0 {a} {b}\nG0 {x} {y}\nG1 {z} F{feed}");
    post.set_path_pose("G1 {x} {y} {z} {a} {b} F{feed}");
    post.set_path_end("G0 Z50");
    post.set_program_end("M30");
    plant_.plant.models["machining_models/edm"] = plant_.plant.models["machining_models/edm@1"] = model;
  }
  absl::StatusOr<v1::Correction> Correct(const std::string& repair) {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    request.set_machining_model("machining_models/edm");
    request.set_repair(repair);
    request.set_request_id(storage::NewUuid());
    v1::Correction made;
    const grpc::Status status =
        programs_->Correct(runtime::ContextFor(sixpoint::testing::kPatience * 300).get(), request, &made);
    if (!status.ok()) return runtime::FromGrpc(status);
    return made;
  }
  Vector3d InPart(const v1::CorrectedToolPose& pose) const {
    const Vector3d tip(pose.tip_mm().x_mm(), pose.tip_mm().y_mm(), pose.tip_mm().z_mm());
    return (plant_.block.axes.MachineFromZero(pose.a_deg() * kRadPerDeg, pose.b_deg() * kRadPerDeg) *
            plant_.block.pose.zero_from_part)
               .inverse() *
           tip;
  }

  WeldedPlant plant_;
  std::shared_ptr<const clients::BladePeers> peers_ = std::make_shared<const clients::BladePeers>(
      plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect());
  std::shared_ptr<storage::RepairStore> kept_ = storage::RepairsIn(plant_.database.database());
  RepairService service_{kept_, peers_, {1, 4}, 2};
  CorrectionService corrections_{storage::CorrectionsIn(plant_.database.database()),
                                 storage::CorrectionEventsIn(plant_.database.database()),
                                 {storage::ReconstructionsIn(plant_.database.database()),
                                  storage::MachiningPassesIn(plant_.database.database()), kept_},
                                 peers_,
                                 {4, 0},
                                 2};
  testing::InProcessServer server_{{&service_, &corrections_}};
  std::unique_ptr<v1::RepairService::Stub> stub_ = v1::RepairService::NewStub(server_.Connect());
  std::unique_ptr<v1::CorrectionService::Stub> programs_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(RepairServiceTest, PlansAndReadsBackTheSame) {
  const auto made = Plan(Request());
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->blade(), "blades/sn1");
  EXPECT_EQ(made->method().extrapolation(), v1::REPAIR_EXTRAPOLATION_PROCESS_OF_DEVIATION);
  EXPECT_EQ(made->method().tilt_deg(), 50);
  EXPECT_NEAR(made->greatest_stock_mm(), kWeld_mm, 0.08);  // the target is off by what it is uncertain of
  EXPECT_EQ(made->roughing_layer_count(), 1);
  EXPECT_EQ(made->removal().deepest_below_line_um(), 0);
  EXPECT_LT(made->removal().deepest_beyond_uncertainty_um(), 0.5);
  EXPECT_FALSE(made->has_determination());
  int measured = 0, target = 0;
  for (const v1::RepairSection& section : made->sections()) {
    measured += section.kind() == v1::REPAIR_SECTION_KIND_MEASURED;
    EXPECT_EQ(section.remark(), "") << section.z_mm();
    if (section.kind() != v1::REPAIR_SECTION_KIND_TARGET) continue;
    ++target;
    EXPECT_GT(section.mean_expanded_uncertainty_um(), 0);
    EXPECT_GE(section.greatest_expanded_uncertainty_um(), section.mean_expanded_uncertainty_um());
  }
  EXPECT_EQ(measured, 29);
  EXPECT_GT(target, 3);

  v1::GetRepairRequest get;
  get.set_name(made->name());
  v1::Repair back;
  ASSERT_TRUE(stub_->GetRepair(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), made->DebugString());
  v1::ListRepairsRequest list;
  list.set_blade("blades/sn1");
  v1::ListRepairsResponse listed;
  ASSERT_TRUE(stub_->ListRepairs(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.repairs_size(), 1);
  EXPECT_EQ(listed.repairs(0).sections_size(), 0);  // the basic view

  // The target beside the tip as it was before it was cut off, and the ball beside the wall that stays.
  v1::DownloadTargetContoursRequest request;
  request.set_name(made->name());
  const auto context = runtime::ContextFor(30);
  const auto reader = stub_->DownloadTargetContours(context.get(), request);
  double squares = 0;
  int places = 0, contours = 0;
  for (v1::TargetContour contour; reader->Read(&contour); ++contours) {
    const auto polygon = KnownPolygon(contour.points_in_part_mm(2), plant_.motion);
    for (int i = 0; i < contour.rest_um_size(); ++i, ++places) {
      const Vector2d point(contour.points_in_part_mm(3 * i), contour.points_in_part_mm(3 * i + 1));
      double nearest_mm = 1e9;
      for (const Vector2d& truth : polygon) nearest_mm = std::min(nearest_mm, (truth - point).norm());
      squares += std::max(0.0, nearest_mm * nearest_mm - 0.025 * 0.025);  // half way between two of the polygon
    }
  }
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_EQ(contours, target);
  EXPECT_LT(1e3 * std::sqrt(squares / places), 20);
  const auto laps = Laps(made->name());
  ASSERT_EQ(static_cast<int>(laps.size()), made->lap_count());
  double least_mm = 1e9;
  const v1::RepairLap& last = laps.back();
  for (int i = 0; i < last.centres_in_part_mm_size() / 3; ++i) {
    const Vector3d centre(last.centres_in_part_mm(3 * i), last.centres_in_part_mm(3 * i + 1),
                          last.centres_in_part_mm(3 * i + 2));
    for (double z_mm = kLine_mm - 2; z_mm <= kLine_mm; z_mm += 0.5)
      for (const Vector2d& point : KnownPolygon(z_mm, plant_.motion))
        least_mm = std::min(least_mm, (Vector3d(point.x(), point.y(), z_mm) - centre).norm());
  }
  EXPECT_GT(least_mm, kMillRadius_mm);
  EXPECT_LT(least_mm, kMillRadius_mm + 0.1);

  v1::ReplayRepairRequest again;
  again.set_name(made->name());
  replay::v1::Replay replay;
  ASSERT_TRUE(stub_->ReplayRepair(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), again, &replay).ok());
  EXPECT_EQ(replay.outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS) << replay.DebugString();
}

TEST_F(RepairServiceTest, ItsLapsAreAProgramOfTheMachine) {
  SetModel(2 * kMillRadius_mm);
  plant_.StoreModel({{"OP10", "G1", 2 * kMillRadius_mm, 30, 1}});
  const auto repair = Plan(Request());
  ASSERT_TRUE(repair.ok()) << repair.status();
  const auto laps = Laps(repair->name());
  const auto correction = Correct(repair->name());
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->repair(), repair->name());
  ASSERT_EQ(correction->groups_size(), static_cast<int>(laps.size()));
  ASSERT_TRUE(correction->has_proof());
  EXPECT_EQ(correction->state(), v1::CORRECTION_STATE_RELEASED) << correction->DebugString().substr(0, 4000);
  // Each lap's poses stand where the plan has them, on the blade as it is clamped, and it ends where it began.
  double worst_um = 0;
  int poses = 0;
  for (int lap = 0; lap < correction->groups_size(); ++lap) {
    const v1::CorrectedGroup& group = correction->groups(lap);
    EXPECT_EQ(group.group(), "tip-" + std::to_string(lap + 1));
    const auto& centres = laps[static_cast<std::size_t>(lap)].centres_in_part_mm();
    ASSERT_EQ(group.poses_size(), centres.size() / 3 + 1);
    for (int i = 0; i < group.poses_size(); ++i, ++poses) {
      const int at = 3 * (i % (centres.size() / 3));
      const Vector3d wanted(centres.Get(at), centres.Get(at + 1), centres.Get(at + 2));
      worst_um = std::max(worst_um, 1e3 * (InPart(group.poses(i)) - wanted).norm());
    }
  }
  EXPECT_LT(worst_um, 1);
  EXPECT_THAT(correction->nc_program(), HasSubstr("SIXPOINT tip-1/1"));

  v1::ReplayCorrectionRequest again;
  again.set_name(correction->name());
  replay::v1::Replay replay;
  const grpc::Status replayed =
      programs_->ReplayCorrection(runtime::ContextFor(sixpoint::testing::kPatience * 300).get(), again, &replay);
  ASSERT_TRUE(replayed.ok()) << replayed.error_message();
  EXPECT_EQ(replay.outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS) << replay.DebugString().substr(0, 2000);
  EXPECT_THAT(replay.taken_as_recorded(), Contains("repair"));

  SetModel(3);
  EXPECT_THAT(std::string(Correct(repair->name()).status().message()),
              HasSubstr("electrode.diameter_mm: 3, want 4, as the mill that the repair was planned for"));
  SetModel(2 * kMillRadius_mm);
  plant_.plant.models["machining_models/edm"].clear_post_processor();
  EXPECT_THAT(std::string(Correct(repair->name()).status().message()), HasSubstr("no post-processor"));
  EXPECT_THAT(std::string(Correct("repairs/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e").status().message()),
              HasSubstr("018f6f3e"));
}

TEST_F(RepairServiceTest, RefusesByNameAndWritesNothing) {
  v1::PlanRepairRequest request = Request();
  request.mutable_mill()->set_diameter_mm(40);
  request.mutable_method()->set_tilt_deg(90);
  request.mutable_heights()->set_line_width_mm(0.01);
  EXPECT_THAT(Refusal(request), ::testing::AllOf(HasSubstr("mill.diameter_mm: 40"), HasSubstr("method.tilt_deg: 90"),
                                                 HasSubstr("heights.line_width_mm: 0.01")));
  request = Request();
  request.mutable_heights()->set_repair_line_mm(20);
  EXPECT_THAT(Refusal(request), HasSubstr("heights.repair_line_mm: 20, want at least 25.3"));
  request = Request();
  request.clear_mill();
  request.clear_heights();
  EXPECT_THAT(Refusal(request), ::testing::AllOf(HasSubstr("heights: "), HasSubstr("mill: ")));
  request = Request();
  request.mutable_method()->clear_greatest_uncertainty_um();
  EXPECT_THAT(Refusal(request), HasSubstr("target: uncertain by "));
  request = Request();
  request.mutable_method()->set_lead_deg(74);
  request.mutable_method()->set_tilt_deg(-20);
  EXPECT_THAT(Refusal(request), HasSubstr("below the repair line"));
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  EXPECT_EQ(transaction->Execute("SELECT count(*) FROM repairs")->Int(0, 0), 0);
}

}  // namespace
}  // namespace sixpoint::correction
