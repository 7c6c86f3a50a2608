#include "metrology/measuring_plan/measuring_plan.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/beyond_reach.h"
#include "metrology/measuring_plan/travel_order.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kGreatestIncidence_rad = 85 * kPi / 180;
constexpr double kGreatestDistance_mm = 1000, kGreatestBody_mm = 2000;
constexpr std::size_t kSamples = 12'000, kDiscSamples = 300;
constexpr int kDirections = 160;  // 16 deg from each other
// From a datum point's normal, where that itself sees too little.
constexpr double kTilts_rad[] = {20 * kPi / 180, 40 * kPi / 180};
constexpr int kTiltsAround = 8;

absl::Status CheckOptions(const PlanOptions& options) {
  Refusals refusals;
  const auto within = [&](const std::string& field, double value, double low, double high) {
    if (value >= low && value <= high) return;
    refusals.Add(Refuse(field, value, NumberText(low) + " to " + NumberText(high)));
  };
  if (!(options.coverage > 0 && options.coverage <= 1))
    refusals.Add(Refuse("coverage", options.coverage, "more than 0, at most 1"));
  if (!(options.greatest_incidence_rad > 0 && options.greatest_incidence_rad <= kGreatestIncidence_rad * (1 + 1e-12)))
    refusals.Add(
        Refuse("greatest_incidence_deg", options.greatest_incidence_rad * kDegPerRad, "more than 0, at most 85"));
  within("margin_mm", options.margin_mm, 0, kGreatestDistance_mm);
  within("clearance_mm", options.clearance_mm, 0, kGreatestDistance_mm);
  within("most_portions", options.most_portions, 1, kMostPlanPortions);
  for (const auto& [corner, at_mm] :
       {std::pair("body.low_mm", &options.body.low_mm), {"body.high_mm", &options.body.high_mm}})
    for (int i = 0; i < 3; ++i)
      within(std::string(corner) + "." + "xyz"[i] + "_mm", (*at_mm)[i], -kGreatestBody_mm, kGreatestBody_mm);
  within("rotary_travel_mm_per_deg", options.rotary_travel_mm_per_rad * kRadPerDeg, 0, kGreatestDistance_mm);
  return refusals.status();
}

absl::Status CheckDiscs(const std::vector<NamedDisc>& discs) {
  if (discs.size() > static_cast<std::size_t>(kMostPlanDiscs))
    return Refuse("regions", static_cast<double>(discs.size()), "at most " + std::to_string(kMostPlanDiscs));
  Refusals refusals;
  for (const NamedDisc& named : discs) {
    const std::string field = "regions[" + named.name + "].";
    if (!named.disc.centre_mm.allFinite()) refusals.Add(Refuse(field + "point_in_part_mm", "not finite", "a point"));
    if (!(std::abs(named.disc.normal.norm() - 1) < 1e-6))
      refusals.Add(Refuse(field + "normal_in_part", "length " + Rounded(named.disc.normal.norm()), "length 1"));
    if (!(named.disc.radius_mm > 0 && named.disc.radius_mm <= kGreatestDistance_mm))
      refusals.Add(Refuse(field + "radius_mm", named.disc.radius_mm, "more than 0, at most 1000"));
  }
  return refusals.status();
}

// Its linear joints carry either the scanner, or the table under both rotary ones: what a scan is mapped into is the table's frame.
absl::Status CheckTable(const JointChain& chain) {
  bool turned = false;
  for (int i = 0; i < chain.size(); ++i) {
    const Joint& joint = chain.joints()[static_cast<std::size_t>(i)];
    const bool rotary = joint.motion.kind == JointKind::kRotary, on_part = i < chain.part_side_size();
    if (rotary && !on_part)
      return Refuse("kinematics.tool_side", joint.axis + ", rotary", "a scanner that is not turned");
    if (!rotary && on_part && turned)
      return Refuse("kinematics.part_side", joint.axis + ", carried by a rotary joint",
                    "linear joints nearer to the bed");
    turned = turned || rotary;
  }
  return absl::OkStatus();
}

absl::StatusOr<ChainSolver> SolverOf(const PlanTask& task) {
  if (absl::Status status = CheckTable(task.chain); !status.ok()) return status;
  ChainSolverOptions options;
  options.tool.axis_in_tool = task.sensor.rotation.col(2);
  options.tool.gauge_in_tool_mm = task.sensor.t_sm_mm;
  for (const Joint& joint : task.chain.joints())
    if (joint.motion.kind == JointKind::kLinear && joint.axis != "X" && joint.axis != "Y" && joint.axis != "Z")
      options.held.push_back(joint.axis);
  return ChainSolver::Make(task.chain, options);
}

// Mean normals of what looks about the same way; then the directions that no surface looks in, for what is seen from them past an edge.
std::vector<Vector3d> DirectionsOf(const std::vector<SurfaceSample>& samples) {
  const std::vector<Vector3d> around = DirectionsAround(kDirections);
  std::vector<Vector3d> sums(around.size(), Vector3d::Zero());
  for (const SurfaceSample& sample : samples) {
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < around.size(); ++k)
      if (around[k].dot(sample.normal) > around[nearest].dot(sample.normal)) nearest = k;
    sums[nearest] += sample.normal;
  }
  std::vector<Vector3d> directions;
  for (const Vector3d& sum : sums)
    if (sum.norm() > 0) directions.push_back(sum.normalized());
  for (std::size_t k = 0; k < around.size(); ++k)
    if (!(sums[k].norm() > 0)) directions.push_back(around[k]);
  return directions;
}

std::vector<Vector3d> DirectionsAbout(const Vector3d& normal) {
  std::vector<Vector3d> directions = {normal};
  const Vector3d across = normal.unitOrthogonal(), other = normal.cross(across);
  for (const double tilt_rad : kTilts_rad)
    for (int k = 0; k < kTiltsAround; ++k) {
      const double turn_rad = 2 * kPi * k / kTiltsAround;
      directions.push_back((std::cos(tilt_rad) * normal +
                            std::sin(tilt_rad) * (std::cos(turn_rad) * across + std::sin(turn_rad) * other))
                               .normalized());
    }
  return directions;
}

std::vector<RegionToSee> RegionsOf(const PlanTask& task) {
  const TriangleMesh& mesh = task.surface.mesh();
  std::vector<RegionToSee> regions;
  for (const NamedDisc& named : task.discs) {
    RegionToSee region{named.name, SampleDisc(mesh, named.disc, kDiscSamples), DirectionsAbout(named.disc.normal),
                       named.disc.centre_mm};
    regions.push_back(std::move(region));
  }
  if (!regions.empty()) return regions;
  SurfaceSamples samples = SampleSurface(mesh, kSamples);
  std::vector<Vector3d> directions = DirectionsOf(samples.samples);
  regions.push_back({"", std::move(samples), std::move(directions), std::nullopt});
  return regions;
}

absl::Status Order(const PlanScene& scene, const PortionPlacer& placer, MeasuringPlan* plan) {
  const auto count = static_cast<Eigen::Index>(plan->portions.size());
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(count, count);
  const auto portion = [&](Eigen::Index i) -> PlannedPortion& { return plan->portions[static_cast<std::size_t>(i)]; };
  KeepGoing keep_going(scene.options.keep_going);
  ForEach(static_cast<std::size_t>(count), scene.options.threads, [&](std::size_t from) {
    const auto i = static_cast<Eigen::Index>(from);
    for (Eigen::Index j = 0; j < count; ++j)
      if (i != j && keep_going()) cost(i, j) = placer.Travel_mm(portion(i), portion(j));
  });
  const std::vector<int> order = ShortOrder(cost, [&] { return keep_going(); });
  if (keep_going.stopped()) return absl::CancelledError("measuring plan: the caller went away");
  std::vector<PlannedPortion> ordered;
  for (const int i : order) ordered.push_back(std::move(portion(i)));
  plan->portions = std::move(ordered);
  plan->travel_mm = TravelOf(order, cost);
  for (std::size_t i = 0; i < plan->portions.size(); ++i) {
    plan->sweep_mm += plan->portions[i].length_mm;
    if (i == 0) continue;
    PlannedPortion &from = plan->portions[i - 1], &to = plan->portions[i];
    placer.Join(&from, &to);
    const double turned_rad = std::abs(to.pose.a_rad - from.pose.a_rad) + std::abs(to.pose.b_rad - from.pose.b_rad);
    plan->turned_rad += turned_rad;
    plan->travel_mm -= scene.options.rotary_travel_mm_per_rad * turned_rad;
  }
  return absl::OkStatus();
}

absl::Status NothingSeen(const std::vector<RegionCoverage>& regions) {
  static constexpr const char* kWhy[kSeenCount] = {"seen",
                                                   "left out",
                                                   "too near to the part for the housing",
                                                   "beyond a linear axis's limits",
                                                   "hidden by the part",
                                                   "beyond a rotary axis's limits",
                                                   "too steep"};
  std::vector<Violation> violations;
  for (const RegionCoverage& region : regions) {
    std::string why;
    for (std::size_t k = 1; k < kSeenCount; ++k)
      if (region.area_mm2[k] > 0)
        why += (why.empty() ? "" : ", ") + Rounded(100 * region.area_mm2[k] / region.wanted_mm2) + " % " + kWhy[k];
    violations.push_back({region.name.empty() ? "part" : "regions[" + region.name + "]",
                          "nothing of it is seen: " + why, "a sweep within the machine's limits, clear of the part"});
  }
  return BeyondReach(violations);
}

}  // namespace

absl::StatusOr<MeasuringPlan> MakeMeasuringPlan(const PlanTask& task) {
  Refusals refusals;
  refusals.Add(CheckOptions(task.options)).Add(CheckDiscs(task.discs));
  if (const std::size_t triangles = task.surface.mesh().triangles.size(); triangles > kMostPlanTriangles)
    refusals.Add(
        Refuse("part.triangles", static_cast<double>(triangles), "at most " + std::to_string(kMostPlanTriangles)));
  const auto view = ScannerView::Make(task.sensor, task.optics, task.options.margin_mm);
  refusals.Add(view.status());
  const auto solver = SolverOf(task);
  refusals.Add(solver.status());
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  const auto axes = RotaryAxes::Of(task.chain);
  if (!axes.ok()) return axes.status();
  PlanScene scene{task.surface, task.zero_from_part, *solver, *axes, *view, task.options, {}};
  for (const Eigen::Isometry3d& neighbour : task.neighbours_zero_from_part)
    scene.neighbour_from_part.push_back(neighbour.inverse(Eigen::Isometry) * task.zero_from_part);
  const auto placer = PortionPlacer::Make(scene);
  if (!placer.ok()) return placer.status();

  MeasuringPlan plan;
  for (const RegionToSee& region : RegionsOf(task)) {
    const int left = task.options.most_portions - static_cast<int>(plan.portions.size());
    auto sweeps = CoverRegion(scene, *placer, region, left);
    if (!sweeps.ok()) return sweeps.status();
    plan.regions.push_back(std::move(sweeps->coverage));
    for (PlannedPortion& portion : sweeps->portions) plan.portions.push_back(std::move(portion));
  }
  if (plan.portions.empty()) return NothingSeen(plan.regions);
  if (absl::Status status = Order(scene, *placer, &plan); !status.ok()) return status;
  return plan;
}

}  // namespace sixpoint::metrology
