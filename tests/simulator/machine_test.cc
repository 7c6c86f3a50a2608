#include "simulator/machine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;
const MachineDesign kDesign;

// CONF (12) written out by hand, apart from the product's scanner model.
Vector3d MachineFromReading(const Vector3d& p, const MachineTruth& truth, const Vector3d& v0_mm) {
  const Eigen::Matrix3d& r = truth.machine_from_sensor;
  return {r(0, 1) * p.y() + r(0, 2) * p.z() + p.x() - v0_mm.x() + truth.t_sm_mm.x(),
          r(1, 1) * p.y() + r(1, 2) * p.z() - v0_mm.y() + truth.t_sm_mm.y(),
          r(2, 1) * p.y() + r(2, 2) * p.z() - v0_mm.z() + truth.t_sm_mm.z()};
}

// Distance above the artefact's face, negative inside; only where the point is far from every feature.
bool OnFlatFace(const Vector3d& p, const ArtefactGeometry& artefact) {
  bool flat = std::abs(p.x()) < 11.5 && std::abs(p.y()) < 11.5;
  for (const auto& [name, centre] : artefact.cones_mm) flat = flat && (p.head<2>() - centre).norm() > 2.1;
  for (const auto& [name, centre] : artefact.slots_mm)
    flat = flat && (p.head<2>() - centre).cwiseAbs().maxCoeff() > 1.3;
  return flat;
}

TEST(Scan, ReadingsMappedByTheTrueSensorLieOnTheArtefactWithinNoise) {
  const MachineTruth truth = MountedByHand(kDesign, 11);
  const ArtefactGeometry artefact;
  for (ScanPlan plan : PlanArtefact(kDesign)) {
    plan.pitch_mm = 0.25;
    const ScanProfiles profiles = Scan(ArtefactScene(artefact, truth), truth, kDesign.scanner, plan, 1, 2);
    double sum = 0, sum_of_squares = 0, cone_sum_of_squares = 0;
    int count = 0, cone_count = 0, slot_count = 0;
    for (const auto& profile : profiles) {
      for (const Vector3d& reading : profile.points_mm) {
        EXPECT_LE(std::abs(reading.z()), 12.5);
        const Vector3d p = truth.machine_from_artefact.inverse() * MachineFromReading(reading, truth, plan.v0_mm);
        if (OnFlatFace(p, artefact)) {
          sum += p.z(), sum_of_squares += p.z() * p.z(), ++count;
        }
        const double radius = (p.head<2>() - artefact.cones_mm.at("C2")).norm();
        if (radius > 0.6 && radius < 1.9) {  // 45 deg: distance from the flank
          const double off = (p.z() - (radius - 2)) / std::sqrt(2.0);
          cone_sum_of_squares += off * off, ++cone_count;
        }
        if ((p.head<2>() - artefact.slots_mm.at("Q3")).cwiseAbs().maxCoeff() < 1.1) {
          EXPECT_NEAR(p.z(), -0.8, 0.012);
          ++slot_count;
        }
      }
    }
    ASSERT_GT(count, 10000);
    ASSERT_GT(cone_count, 500);
    ASSERT_GT(slot_count, 300);
    // 2 um along rays within 11 deg of the normal: mean within 5 standard errors, spread within 5 %.
    EXPECT_LT(std::abs(sum / count), 5 * 0.002 / std::sqrt(count));
    EXPECT_NEAR(std::sqrt(sum_of_squares / count), 0.002, 0.0001);
    EXPECT_NEAR(std::sqrt(cone_sum_of_squares / cone_count), 0.002 * std::sqrt(0.5), 0.0002);
  }
}

TEST(Scan, SameSeedSameBitsOnAnyNumberOfThreads) {
  const MachineTruth truth = MountedByHand(kDesign, 4);
  ScanPlan plan = PlanArtefact(kDesign)[0];
  plan.pitch_mm = 1;
  const Scene scene = ArtefactScene({}, truth);
  const metrology::Points one = PointsOf(Scan(scene, truth, kDesign.scanner, plan, 9, 1));
  EXPECT_EQ(one, PointsOf(Scan(scene, truth, kDesign.scanner, plan, 9, 4)));
  EXPECT_NE(one, PointsOf(Scan(scene, truth, kDesign.scanner, plan, 10, 1)));
}

TEST(Scan, GivesEachPointItsColumnAndWholeRawSteps) {
  const MachineTruth truth = MountedByHand(kDesign, 4);
  ScanPlan plan = PlanArtefact(kDesign)[0];
  plan.pitch_mm = 1;
  const ScannerDesign& scanner = kDesign.scanner;
  const double pitch_rad = scanner.line_angle_deg * kRadPerDeg / scanner.columns;
  std::size_t count = 0;
  for (const Profile& profile : Scan(ArtefactScene({}, truth), truth, scanner, plan, 9, 2)) {
    ASSERT_EQ(profile.columns.size(), profile.points_mm.size());
    for (std::size_t i = 0; i < profile.columns.size(); ++i, ++count) {
      const Vector3d& p = profile.points_mm[i];
      EXPECT_EQ(p.x(), profile.x_mm);
      if (i > 0) {
        EXPECT_GT(profile.columns[i], profile.columns[i - 1]);
      }
      // The point lies on its column's ray, but for half a raw step of 0.1 um 53 mm away.
      const double ray_rad = (profile.columns[i] + 0.5 - 0.5 * scanner.columns) * pitch_rad;
      EXPECT_NEAR(std::atan2(p.y(), scanner.mid_range_mm - p.z()), ray_rad, 2e-6);
      for (const double value_mm : {p.y(), p.z()}) {
        EXPECT_NEAR(value_mm / 1e-4, std::round(value_mm / 1e-4), 1e-6);
      }
    }
  }
  EXPECT_GT(count, 10000u);
}

TEST(Scan, LosesGrazingSurfacesAndWhatIsOutOfRange) {
  MachineTruth truth = MountedByHand(kDesign, 4);
  truth.machine_from_sensor.setIdentity();
  ScanPlan plan;
  plan.v0_mm = truth.t_sm_mm;  // the machine's origin is the sensor's
  plan.first_x_mm = -6;
  plan.last_x_mm = 6;
  plan.pitch_mm = 0.05;
  Scene scene;
  scene.Add(std::make_shared<Sphere>(Vector3d(0, 0, -2), 5), Eigen::Isometry3d::Identity());
  double lowest = 10;
  std::size_t count = 0;
  for (const auto& profile : Scan(scene, truth, kDesign.scanner, plan, 1, 1)) {
    for (const Vector3d& p : profile.points_mm) {
      EXPECT_NEAR((p - Vector3d(0, 0, -2)).norm(), 5, 0.012);
      lowest = std::min(lowest, p.z());
      ++count;
    }
  }
  EXPECT_GT(count, 10000u);
  // In the plane y = 0 rays are vertical: the flank is lost where the normal's z falls below 0.2, 1 mm above the middle.
  EXPECT_NEAR(lowest, -1, 0.35);
  plan.v0_mm.z() = truth.t_sm_mm.z() + 16;  // the sphere's top is now 13 mm above mid range or more
  scene = {};
  scene.Add(std::make_shared<Sphere>(Vector3d(0, 0, 2), 5), Eigen::Isometry3d::Identity());
  for (const auto& profile : Scan(scene, truth, kDesign.scanner, plan, 1, 1))
    for (const Vector3d& p : profile.points_mm) EXPECT_LE(p.z(), 12.5);
}

TEST(Scan, SeesOnlyTheFirstSurface) {
  MachineTruth truth = MountedByHand(kDesign, 4);
  ScanPlan plan;
  plan.v0_mm = truth.t_sm_mm;
  plan.first_x_mm = -1;
  plan.last_x_mm = 1;
  plan.pitch_mm = 0.5;
  Scene scene;
  scene.Add(std::make_shared<Sphere>(Vector3d(0, 0, -60), 55), Eigen::Isometry3d::Identity());
  scene.Add(std::make_shared<Pin>(Vector3d(0, 0, 5), Vector3d::UnitZ(), 2, 1), Eigen::Isometry3d::Identity());
  for (const auto& profile : Scan(scene, truth, kDesign.scanner, plan, 1, 1))
    for (const Vector3d& p : profile.points_mm)
      if (std::abs(p.y()) < 1 && std::abs(p.x()) <= 1) {
        EXPECT_GT(p.z(), 3);
      }
}

TEST(ProbeSphere, StaysOnOneCircleSystemOfTheTrueAxes) {
  const MachineTruth truth = MountedByHand(kDesign, 21);
  const auto poses = ProbeSphere(truth, 1, 3);
  ASSERT_EQ(poses.size(), 48u);
  double sum_of_squares = 0;
  for (const ProbedSphere& pose : poses) {
    // Undone one axis at a time, by turning about lines.
    const auto back = [](const Vector3d& p, const metrology::AxisLine& axis, double angle) -> Vector3d {
      return Eigen::AngleAxisd(-angle, axis.direction) * (p - axis.point_mm) + axis.point_mm;
    };
    const Vector3d centre =
        back(back(pose.centre_mm, truth.axes.a, pose.a_deg * kRadPerDeg), truth.axes.b, pose.b_deg * kRadPerDeg);
    sum_of_squares += (centre - truth.sphere_in_zero_mm).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(sum_of_squares / (3 * 48)), 0.001, 0.0002);
}

TEST(ClampedByHand, IsOffByNoMoreThanAsked) {
  const DesignedPart part = DesignPart({}, kDesign.centre_mm);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Eigen::Isometry3d zero_from_part = ClampedByHand(part, 1, 1, seed);
    const Vector3d middle(0, 0, 22.5);
    EXPECT_LE((zero_from_part * middle - part.zero_from_part_nominal * middle).norm(), 1);
    const Eigen::AngleAxisd turn(zero_from_part.linear() * part.zero_from_part_nominal.linear().transpose());
    EXPECT_LE(std::abs(turn.angle()), 1 * kRadPerDeg + 1e-12);
    EXPECT_GT(std::abs(turn.angle()), 0.3 * kRadPerDeg);
  }
}

TEST(Drill, HitsTheDesignedHoleWhenTheProgramKnowsTheTruth) {
  const DesignedPart part = DesignPart({}, kDesign.centre_mm);
  const MachineTruth truth = MountedByHand(kDesign, 2);
  const Eigen::Isometry3d zero_from_part = ClampedByHand(part, 1, 1, 2);
  const DesignedHoleGroup& group = part.hole_groups[0];
  const DesignedHole& hole = group.holes[1];
  // Newton on the true axes for the angles that put the hole along Z.
  double a = group.a_nominal_deg, b = group.b_nominal_deg;
  const auto axis_at = [&](double a_deg, double b_deg) -> Vector3d {
    return truth.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg).linear() * zero_from_part.linear() *
           group.axis;
  };
  for (int i = 0; i < 8; ++i) {
    const double h = 1e-4;
    Eigen::Matrix2d slope;
    slope.col(0) = (axis_at(a + h, b) - axis_at(a - h, b)).head<2>() / (2 * h);
    slope.col(1) = (axis_at(a, b + h) - axis_at(a, b - h)).head<2>() / (2 * h);
    const Eigen::Vector2d step = slope.inverse() * axis_at(a, b).head<2>();
    a -= step.x();
    b -= step.y();
  }
  const Vector3d start = truth.axes.MachineFromZero(a * kRadPerDeg, b * kRadPerDeg) * zero_from_part * hole.start_mm;
  const DrilledHole exact = Drill(part, group, hole, truth, zero_from_part, {a, b, start}, {0, 0}, Random(1));
  EXPECT_LT(exact.position_error_mm, 1e-9);
  EXPECT_LT(exact.inclination_error_deg, 1e-7);
  // Uncorrected, the clamping shows.
  const DrilledHole uncorrected = Drill(part, group, hole, truth, zero_from_part,
                                        {group.a_nominal_deg, group.b_nominal_deg, start}, {0, 0}, Random(1));
  EXPECT_GT(uncorrected.inclination_error_deg, 0.1);
}

TEST(PlanBlade, ShowsEveryDatumPointAndHole) {
  const DesignedPart part = DesignPart({}, kDesign.centre_mm);
  const MachineTruth truth = MountedByHand(kDesign, 6);
  const Eigen::Isometry3d zero_from_part = ClampedByHand(part, 1, 1, 6);
  const auto shape = std::make_shared<TriangleShape>(part.mesh);
  std::vector<std::pair<double, double>> poses{{-50, 0}, {-50, 180}};
  for (int b = 0; b < 360; b += 60) poses.push_back({0, b});
  std::vector<Vector3d> wanted;
  for (const auto& datum : part.six_points) wanted.push_back(datum.point_mm);
  for (const auto& group : part.hole_groups)
    for (const auto& hole : group.holes) wanted.push_back(hole.start_mm);
  std::vector<int> seen(wanted.size(), 0);
  for (const ScanPlan& plan : PlanBlade(part, kDesign, 0.4, poses)) {
    const Scene scene = BladeScene({shape}, truth, zero_from_part, plan.a_deg, plan.b_deg);
    const Eigen::Isometry3d part_from_machine =
        (truth.axes.MachineFromZero(plan.a_deg * kRadPerDeg, plan.b_deg * kRadPerDeg) * zero_from_part).inverse();
    ScanPlan coarse = plan;
    coarse.columns = 160;
    for (const auto& profile : Scan(scene, truth, kDesign.scanner, coarse, 1, 2)) {
      for (const Vector3d& reading : profile.points_mm) {
        const Vector3d p = part_from_machine * MachineFromReading(reading, truth, plan.v0_mm);
        for (std::size_t i = 0; i < wanted.size(); ++i) seen[i] += (p - wanted[i]).norm() < 1 ? 1 : 0;
      }
    }
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_GE(seen[i], 20) << wanted[i].transpose();
}

}  // namespace
}  // namespace sixpoint::simulator
