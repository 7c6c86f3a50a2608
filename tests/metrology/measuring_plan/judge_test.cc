// Plans carried out by a machine of its own: plain rotations, axes that stand where they are commanded, rays against every triangle. It shares with the
// planner the task and nothing else.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "metrology/measuring_plan/measuring_plan.h"
#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// A prism with deep grooves: points and dents about the x axis.
TriangleMesh Star(double outer_mm, double inner_mm, double length_mm, int points) {
  TriangleMesh mesh = CylinderMesh(outer_mm, length_mm, 2 * points);
  for (std::uint32_t v = 0; v < 4u * static_cast<std::uint32_t>(points); ++v)
    if (v % 2 == 1) mesh.vertices_mm[v].tail<2>() *= inner_mm / outer_mm;
  return mesh;
}

struct Place {
  Vector3d point_mm;
  std::uint32_t triangle = 0;
  double area_mm2 = 0;
  bool seen = false;
};

// Each triangle in equal small ones, by their middles.
std::vector<Place> PlacesOf(const TriangleMesh& mesh, int pieces) {
  std::vector<Place> places;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d &a = mesh.vertices_mm[mesh.triangles[t][0]], &b = mesh.vertices_mm[mesh.triangles[t][1]],
                   &c = mesh.vertices_mm[mesh.triangles[t][2]];
    const double area_mm2 = 0.5 * (b - a).cross(c - a).norm() / (pieces * pieces);
    for (int i = 0; i < pieces; ++i)
      for (int j = 0; i + j < pieces; ++j) {
        places.push_back({a + (b - a) * (i + 1.0 / 3) / pieces + (c - a) * (j + 1.0 / 3) / pieces, t, area_mm2, false});
        if (i + j + 1 < pieces)
          places.push_back(
              {a + (b - a) * (i + 2.0 / 3) / pieces + (c - a) * (j + 2.0 / 3) / pieces, t, area_mm2, false});
      }
  }
  return places;
}

// By the areas of the three triangles that a point makes with the corners' projections.
std::optional<double> DistanceAlong(const Vector3d& from, const Vector3d& way, const Vector3d& a, const Vector3d& b,
                                    const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double slope = normal.dot(way);
  if (slope == 0) return std::nullopt;
  const double distance = normal.dot(a - from) / slope;
  const Vector3d at = from + distance * way;
  if (distance <= 1e-9 || (b - a).cross(at - a).dot(normal) < 0 || (c - b).cross(at - b).dot(normal) < 0 ||
      (a - c).cross(at - c).dot(normal) < 0)
    return std::nullopt;
  return distance;
}

class Judge {
 public:
  Judge(const PlanTask& task, const PlanMachine& machine)
      : task_(task), machine_(machine), mesh_(task.surface.mesh()) {}

  Eigen::Isometry3d MachineFromPart(const PlannedPortion& portion) const {
    // A, B, X, Y, Z by the chain's order.
    const Eigen::Quaterniond turned =
        Eigen::AngleAxisd(portion.start(0), Vector3d::UnitY()) * Eigen::AngleAxisd(portion.start(1), Vector3d::UnitX());
    return Eigen::Translation3d(machine_.centre_mm) * turned * Eigen::Translation3d(-machine_.centre_mm) *
           task_.zero_from_part;
  }
  Vector3d OriginAt(const PlannedPortion& portion, double share) const {
    return task_.sensor.t_sm_mm + portion.start.tail<3>() + share * (portion.end - portion.start).tail<3>();
  }

  // Marks what a sweep of its own rays meets, from profile to profile.
  void Scan(const PlannedPortion& portion, std::vector<Place>* places) {
    constexpr int kColumns = 161;
    constexpr double kPitch_mm = 0.25, kNear_mm = 0.35;
    const Eigen::Isometry3d part_from_machine = MachineFromPart(portion).inverse();
    const int profiles = static_cast<int>(portion.length_mm / kPitch_mm);
    for (int k = 0; k <= profiles; ++k) {
      const double x_mm = std::min(k * kPitch_mm, portion.length_mm);
      const Vector3d origin_mm = OriginAt(portion, x_mm / portion.length_mm);
      for (int column = 0; column < kColumns; ++column) {
        const double angle = task_.optics.line_angle_rad * (column / (kColumns - 1.0) - 0.5);
        const Vector3d source_mm = origin_mm + task_.sensor.rotation * Vector3d(0, 0, task_.optics.mid_range_mm);
        const Vector3d way = task_.sensor.rotation * Vector3d(0, std::sin(angle), -std::cos(angle));
        Look(part_from_machine * source_mm, part_from_machine.linear() * way, angle, x_mm, portion, places, kNear_mm);
      }
    }
  }
  double greatest_mapping_error_mm = 0;

 private:
  void Look(const Vector3d& from, const Vector3d& way, double angle, double x_mm, const PlannedPortion& portion,
            std::vector<Place>* places, double near_mm) {
    double nearest_mm = 1e9;
    std::uint32_t triangle = 0;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto distance_mm =
          DistanceAlong(from, way, mesh_.vertices_mm[mesh_.triangles[t][0]], mesh_.vertices_mm[mesh_.triangles[t][1]],
                        mesh_.vertices_mm[mesh_.triangles[t][2]]);
      if (distance_mm && *distance_mm < nearest_mm) nearest_mm = *distance_mm, triangle = t;
    }
    const double y_mm = nearest_mm * std::sin(angle), z_mm = task_.optics.mid_range_mm - nearest_mm * std::cos(angle);
    if (nearest_mm > 1e8 || std::abs(z_mm) > task_.optics.range_mm / 2) return;
    const TriangleCorners& corners = mesh_.triangles[triangle];
    const Vector3d& a = mesh_.vertices_mm[corners[0]];
    const Vector3d normal = (mesh_.vertices_mm[corners[1]] - a).cross(mesh_.vertices_mm[corners[2]] - a).normalized();
    if (-normal.dot(way) < std::cos(task_.options.greatest_incidence_rad)) return;
    const Vector3d at = from + nearest_mm * way;
    // What a plant makes of the reading by the header that the plan states.
    const Vector3d mapped =
        MachineFromPart(portion).inverse() * task_.sensor.MachineFromSensor({x_mm, y_mm, z_mm}, portion.v0_mm);
    greatest_mapping_error_mm = std::max(greatest_mapping_error_mm, (mapped - at).norm());
    for (Place& place : *places)
      if (place.triangle == triangle && !place.seen && (place.point_mm - at).squaredNorm() < near_mm * near_mm)
        place.seen = true;
  }

  const PlanTask& task_;
  const PlanMachine& machine_;
  const TriangleMesh& mesh_;
};

double SeenShare(const std::vector<Place>& places) {
  double seen = 0, all = 0;
  for (const Place& place : places) all += place.area_mm2, seen += place.seen ? place.area_mm2 : 0;
  return seen / all;
}

// As much is seen as the plan says. A quarter of a millimetre between profiles, and the places' own size: an edge of each face counts as seen or not,
// 1 % of the surface; a sweep sees a little more than what it is credited for.
TEST(PlanJudge, SeesWhatThePlanPromises) {
  const PlanMachine machine;
  const TriangleMesh star = Star(12, 7, 24, 7);
  const auto surface = SurfaceOf(star);
  PlanTask task = TaskOf(*surface, machine);
  task.options.margin_mm = 0;
  task.options.coverage = 0.9;
  const auto plan = MakeMeasuringPlan(task);
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_GE(plan->regions[0].Share(), 0.9);
  Judge judge(task, machine);
  std::vector<Place> places = PlacesOf(star, 24);
  for (const PlannedPortion& portion : plan->portions) judge.Scan(portion, &places);
  EXPECT_GE(SeenShare(places), plan->regions[0].Share() - 0.01);
  EXPECT_LE(SeenShare(places), plan->regions[0].Share() + 0.03);
  EXPECT_LT(judge.greatest_mapping_error_mm, 1e-9);
  // Fewer sweeps see less: the judge can fail.
  std::vector<Place> fewer = PlacesOf(star, 24);
  judge.Scan(plan->portions[0], &fewer);
  EXPECT_LT(SeenShare(fewer), plan->regions[0].Share() - 0.2);
}

// The dents are too steep from straight above each point: what one sweep promises is what it sees too.
TEST(PlanJudge, SeesWhatOneSweepOfAStillPartPromises) {
  PlanMachine still;
  still.a_limit_deg = still.b_limit_deg = 0.01;
  const TriangleMesh star = Star(12, 5, 24, 5);
  const auto surface = SurfaceOf(star);
  PlanTask task = TaskOf(*surface, still);
  task.options.margin_mm = 0;
  task.options.coverage = 1;
  task.options.greatest_incidence_rad = 75 * kPlanDegree;
  const auto plan = MakeMeasuringPlan(task);
  ASSERT_TRUE(plan.ok()) << plan.status();
  Judge judge(task, still);
  std::vector<Place> places = PlacesOf(star, 24);
  for (const PlannedPortion& portion : plan->portions) judge.Scan(portion, &places);
  EXPECT_NEAR(SeenShare(places), plan->regions[0].Share(), 0.015);
}

// How near the housing comes to the part and its neighbours, as a grid of its own places, at every place of every move: down, along, up, and over to
// the next.
double NearestHousing_mm(const PlanTask& task, const PlanMachine& machine, const MeasuringPlan& plan) {
  std::vector<Eigen::Isometry3d> zero_from_parts = task.neighbours_zero_from_part;
  zero_from_parts.push_back(task.zero_from_part);
  double least_mm = 1e9;
  const auto look = [&](double a_rad, double b_rad, const Vector3d& linear_mm) {
    PlannedPortion pose;
    pose.start = Eigen::VectorXd::Zero(5);
    pose.start << a_rad, b_rad, linear_mm;
    const Eigen::Isometry3d zero_from_machine =
        task.zero_from_part * Judge(task, machine).MachineFromPart(pose).inverse();
    const SensorBody& body = task.options.body;
    for (int i = 0; i < 5 * 9 * 9; ++i) {
      const Vector3d share(i % 5 / 4.0, i / 5 % 9 / 8.0, i / 45 / 8.0);
      const Vector3d in_sensor = body.low_mm + share.cwiseProduct(body.high_mm - body.low_mm);
      const Vector3d place = task.sensor.t_sm_mm + linear_mm + task.sensor.rotation * in_sensor;
      for (const Eigen::Isometry3d& zero_from_part : zero_from_parts)
        least_mm = std::min(
            least_mm, task.surface.Closest(zero_from_part.inverse() * zero_from_machine * place).signed_distance_mm);
    }
  };
  const auto go = [&](const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
    for (int step = 0; step <= 10; ++step) {
      const Eigen::VectorXd at = from + step / 10.0 * (to - from);
      look(at(0), at(1), at.tail<3>());
    }
  };
  for (std::size_t i = 0; i < plan.portions.size(); ++i) {
    const PlannedPortion& portion = plan.portions[i];
    go(portion.enter, portion.start);
    go(portion.start, portion.end);
    go(portion.end, portion.leave);
    if (i + 1 == plan.portions.size()) continue;
    Eigen::VectorXd turned = portion.leave;
    turned.head<2>() = plan.portions[i + 1].enter.head<2>();
    go(portion.leave, turned);
    go(turned, plan.portions[i + 1].enter);
  }
  return least_mm;
}

TEST(PlanJudge, KeepsTheHousingAwayOnEveryMove) {
  const PlanMachine machine;
  TriangleMesh mesh = Star(12, 7, 24, 7);
  AddBoxMesh({14, -6, -6}, {20, 6, 60}, false, &mesh);  // a fixture's arm
  const auto surface = SurfaceOf(mesh);
  PlanTask task = TaskOf(*surface, machine);
  task.options.coverage = 0.6;
  const auto plan = MakeMeasuringPlan(task);
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_GE(plan->portions.size(), 3u);
  const double least_mm = NearestHousing_mm(task, machine, *plan);
  EXPECT_GE(least_mm, task.options.clearance_mm + task.options.margin_mm - 1e-9);
  EXPECT_LT(least_mm, 200);
}

// Of a fixture with two, turned to each other: the plan of one alone would come too near to the other.
TEST(PlanJudge, KeepsTheHousingAwayFromANeighbour) {
  const PlanMachine machine;
  const auto surface = SurfaceOf(Star(12, 7, 24, 7));
  PlanTask task = TaskOf(*surface, machine);
  task.options.coverage = 0.6;
  const auto alone = MakeMeasuringPlan(task);
  ASSERT_TRUE(alone.ok()) << alone.status();
  task.neighbours_zero_from_part = {task.zero_from_part * Eigen::Translation3d(0, 30, 50) *
                                    Eigen::AngleAxisd(0.3, Vector3d::UnitX())};
  const auto plan = MakeMeasuringPlan(task);
  ASSERT_TRUE(plan.ok()) << plan.status();
  ASSERT_GE(plan->portions.size(), 2u);
  const double wanted_mm = task.options.clearance_mm + task.options.margin_mm - 1e-9;
  EXPECT_GE(NearestHousing_mm(task, machine, *plan), wanted_mm);
  EXPECT_LT(NearestHousing_mm(task, machine, *alone), wanted_mm);
}

// Every place of the program is one that the axes may take.
TEST(PlanJudge, StaysWithinEveryLimit) {
  PlanMachine machine;
  machine.a_limit_deg = 60;
  machine.x_mm = 60;
  machine.y_mm = 120;
  machine.z_low_mm = -300;
  machine.z_high_mm = -150;
  const auto surface = SurfaceOf(Star(12, 7, 24, 7));
  PlanTask task = TaskOf(*surface, machine);
  const auto plan = MakeMeasuringPlan(task);
  ASSERT_TRUE(plan.ok()) << plan.status();
  for (const PlannedPortion& portion : plan->portions)
    for (const Eigen::VectorXd* at : {&portion.enter, &portion.start, &portion.end, &portion.leave}) {
      EXPECT_LE(std::abs((*at)(0)), 60 * kPlanDegree + 1e-9);
      EXPECT_LE(std::abs((*at)(2)), 60 + 1e-6);
      EXPECT_LE(std::abs((*at)(3)), 120 + 1e-6);
      EXPECT_GE((*at)(4), -300 - 1e-6);
      EXPECT_LE((*at)(4), -150 + 1e-6);
    }
}

}  // namespace
}  // namespace sixpoint::metrology
