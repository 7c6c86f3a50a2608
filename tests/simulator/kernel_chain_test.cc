// The product's kernels on what a simulated machine measures, against the simulator's truth: no service, no database.
#include <gtest/gtest.h>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/frames/angles.h"
#include "metrology/mesh/stl.h"
#include "metrology/registration/six_point.h"
#include "simulator/machine.h"

namespace sixpoint::simulator {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;

metrology::LineScan ToLineScan(const std::string& id, const ScanPlan& plan, const ScanProfiles& profiles) {
  metrology::LineScan scan;
  scan.id = id;
  scan.points_mm = PointsOf(profiles);
  scan.v0_mm = plan.v0_mm;
  scan.a_rad = plan.a_deg * kRadPerDeg;
  scan.b_rad = plan.b_deg * kRadPerDeg;
  scan.profile_pitch_mm = plan.pitch_mm;
  return scan;
}

class KernelChain : public ::testing::TestWithParam<int> {
 protected:
  const MachineDesign design_;
  const MachineTruth truth_ = MountedByHand(design_, static_cast<std::uint64_t>(GetParam()));
};

TEST_P(KernelChain, FindsTheMachineAndTheBlade) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const ArtefactGeometry geometry;
  metrology::Artefact artefact;
  artefact.side_mm = geometry.side_mm;
  for (const auto& [name, centre] : geometry.cones_mm) artefact.cones.push_back({name, centre});
  for (const auto& [name, centre] : geometry.slots_mm) artefact.slots.push_back({name, centre});
  artefact.cone_half_angle_rad = geometry.cone_half_angle_deg * kRadPerDeg;
  artefact.cone_top_radius_mm = geometry.cone_top_radius_mm;
  artefact.cone_bottom_radius_mm = geometry.cone_bottom_radius_mm;
  artefact.slot_width_mm = geometry.slot_width_mm;
  artefact.slot_depth_mm = geometry.slot_depth_mm;
  const TouchProbing probing = ProbeArtefact(geometry, truth_.machine_from_artefact, 1, Random(seed + 100));
  metrology::ArtefactTouch touch;
  for (const auto& [name, centre] : probing.centres_mm) touch.centres.push_back({name, centre});
  touch.plane_mm = probing.plane_mm;
  touch.side_x_mm = probing.side_x_mm;
  touch.side_y_mm = probing.side_y_mm;
  touch.standard_uncertainty_mm = 1e-3;

  std::vector<metrology::LineScan> artefact_scans;
  for (const ScanPlan& plan : PlanArtefact(design_)) {
    const Scene scene = ArtefactScene(geometry, truth_);
    artefact_scans.push_back(
        ToLineScan("artefact", plan, Scan(scene, truth_, design_.scanner, plan, seed + artefact_scans.size(), 2)));
  }
  const auto sensor = metrology::CalibrateSensor(artefact_scans, artefact, touch, {});
  ASSERT_TRUE(sensor.ok()) << sensor.status();
  const Vector3d turn =
      metrology::VectorFromRotation(sensor->sensor.rotation * truth_.machine_from_sensor.transpose()) / kRadPerDeg;
  // Touching with 1 um over 18 mm holds angles to about 1e-3 deg and positions to 0.4 um; three times that.
  EXPECT_LT(turn.cwiseAbs().maxCoeff(), 0.003) << turn.transpose();
  EXPECT_LT((sensor->sensor.t_sm_mm - truth_.t_sm_mm).norm(), 1.5e-3);

  std::vector<metrology::SpherePose> poses;
  for (const ProbedSphere& probed : ProbeSphere(truth_, 1, seed + 200))
    poses.push_back({probed.a_deg * kRadPerDeg, probed.b_deg * kRadPerDeg, probed.centre_mm, probed.held_out});
  metrology::RotationOptions rotation_options;
  rotation_options.nominal.a.point_mm = rotation_options.nominal.b.point_mm = design_.centre_mm;
  const auto rotation = metrology::CalibrateRotation(poses, rotation_options);
  ASSERT_TRUE(rotation.ok()) << rotation.status();
  // Three coordinates of 1 um; 12 held-out poses.
  EXPECT_NEAR(rotation->check_rms_mm, std::sqrt(3.0) * 1e-3, 0.7e-3);

  const DesignedPart part = DesignPart({}, design_.centre_mm);
  const auto mesh = metrology::ReadStl(BinaryStl(part.mesh), 1);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->closed);
  const auto surface = metrology::Surface::Prepare(*mesh);
  ASSERT_TRUE(surface.ok()) << surface.status();
  metrology::MachineCalibration calibration{sensor->sensor, rotation->axes, rotation->covariance};
  const Eigen::Isometry3d zero_from_part = ClampedByHand(part, 1, 1, seed + 300);
  const auto shape = std::make_shared<TriangleShape>(part.mesh);
  std::vector<std::pair<double, double>> blade_poses{{-50, 0}, {-50, 180}};
  for (int b_deg = 0; b_deg < 360; b_deg += 60) blade_poses.push_back({0, b_deg});
  metrology::Thinning thinning;
  for (const DesignedDatum& datum : part.six_points)
    thinning.dense_places_mm.push_back(part.zero_from_part_nominal * datum.point_mm);
  std::vector<metrology::ScanPortion> portions;
  for (const ScanPlan& plan : PlanBlade(part, design_, 0.3, blade_poses)) {
    const Scene scene = BladeScene({shape}, truth_, zero_from_part, plan.a_deg, plan.b_deg);
    const ScanProfiles profiles = Scan(scene, truth_, design_.scanner, plan, seed + 400 + portions.size(), 2);
    portions.push_back(metrology::Thin(ToLineScan("blade", plan, profiles), calibration, thinning));
  }
  const auto best_fit =
      metrology::FitToSurface(**surface, portions, part.zero_from_part_nominal, calibration, metrology::FitOptions());
  ASSERT_TRUE(best_fit.ok()) << best_fit.status();
  ASSERT_EQ(best_fit->outcome, metrology::Outcome::kConverged) << best_fit->evidence.remark;
  std::vector<metrology::DatumPoint> datums;
  for (const DesignedDatum& datum : part.six_points) datums.push_back({datum.name, datum.point_mm, datum.normal});
  const auto six_point = metrology::FitSixPoints(**surface, portions, datums, *best_fit,
                                                 metrology::SixPointVariant::kNormals, calibration, {});
  ASSERT_TRUE(six_point.ok()) << six_point.status();
  ASSERT_EQ(six_point->outcome, metrology::Outcome::kConverged) << six_point->evidence.remark;
  for (const metrology::PoseFit& fit : {*best_fit, *six_point}) {
    for (const auto& group : part.hole_groups) {
      for (const auto& hole : group.holes)
        EXPECT_LT((fit.placed.value().zero_from_part * hole.start_mm - zero_from_part * hole.start_mm).norm(), 5e-3)
            << group.name << hole.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, KernelChain, ::testing::Values(1, 2));

}  // namespace
}  // namespace sixpoint::simulator
