// The simulated machine scans a blade by measuring plans, and the product's kernels find the blade from those scans. The plans know the blade as it is
// drawn; it is clamped by hand, and what the machine sees is traced by code that the plans do not share.
#include "metrology/measuring_plan/measuring_plan.h"

#include <gtest/gtest.h>

#include <set>

#include "metrology/frames/angles.h"
#include "metrology/registration/six_point.h"
#include "simulator/machine.h"

namespace sixpoint::simulator {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;
constexpr double kPitch_mm = 0.3;
// As the kernels find it where a person said where to scan (kernel_chain_test.cc).
constexpr double kPoseLimit_mm = 5e-3;

metrology::JointChain ChainOf(const MachineTruth& truth) {
  const auto joint = [](const char* axis, metrology::JointKind kind, const metrology::AxisLine& line, double limit) {
    metrology::Joint out;
    out.axis = axis;
    out.motion = {kind, line};
    out.minimum = -limit;
    out.maximum = limit;
    return out;
  };
  using metrology::JointKind;
  auto chain =
      metrology::JointChain::Make({joint("A", JointKind::kRotary, truth.axes.a, 100 * kRadPerDeg),
                                   joint("B", JointKind::kRotary, truth.axes.b, 360 * kRadPerDeg)},
                                  {joint("X", JointKind::kLinear, {Vector3d::UnitX(), Vector3d::Zero()}, 350),
                                   joint("Y", JointKind::kLinear, {Vector3d::UnitY(), Vector3d::Zero()}, 200),
                                   joint("Z", JointKind::kLinear, {Vector3d::UnitZ(), Vector3d::Zero()}, 400)});
  EXPECT_TRUE(chain.ok()) << chain.status();
  return *std::move(chain);
}

class MeasuringPlanRun : public ::testing::TestWithParam<int> {
 protected:
  std::uint64_t seed() const { return static_cast<std::uint64_t>(GetParam()); }
  metrology::MeasuringPlan Plan(const std::vector<metrology::NamedDisc>& discs) const {
    metrology::PlanTask task{
        *surface_,
        part_.zero_from_part_nominal,
        ChainOf(truth_),
        calibration_.sensor,
        {design_.scanner.mid_range_mm, design_.scanner.range_mm, design_.scanner.line_angle_deg * kRadPerDeg},
        discs,
        {}};
    task.options.body = {{-20, -50, design_.scanner.mid_range_mm}, {20, 50, design_.scanner.mid_range_mm + 100}};
    task.options.threads = 2;
    auto plan = metrology::MakeMeasuringPlan(task);
    EXPECT_TRUE(plan.ok()) << plan.status();
    return plan.ok() ? *std::move(plan) : metrology::MeasuringPlan();
  }
  // What the machine reads: the header of each scan says what its portion says.
  std::vector<metrology::ScanPortion> ScanBy(const metrology::MeasuringPlan& plan) const {
    metrology::Thinning thinning;
    for (const DesignedDatum& datum : part_.six_points)
      thinning.dense_places_mm.push_back(part_.zero_from_part_nominal * datum.point_mm);
    std::vector<metrology::ScanPortion> portions;
    for (const metrology::PlannedPortion& portion : plan.portions) {
      ScanPlan scan_plan;
      scan_plan.v0_mm = portion.v0_mm;
      scan_plan.a_deg = portion.pose.a_rad / kRadPerDeg;
      scan_plan.b_deg = portion.pose.b_rad / kRadPerDeg;
      scan_plan.last_x_mm = portion.length_mm;
      scan_plan.pitch_mm = kPitch_mm;
      const Scene scene = BladeScene({blade_}, truth_, zero_from_part_, scan_plan.a_deg, scan_plan.b_deg);
      metrology::LineScan scan;
      scan.id = "portion " + std::to_string(portions.size() + 1);
      scan.points_mm = PointsOf(Scan(scene, truth_, design_.scanner, scan_plan, seed() + portions.size(), 2));
      scan.v0_mm = scan_plan.v0_mm;
      scan.a_rad = portion.pose.a_rad;
      scan.b_rad = portion.pose.b_rad;
      scan.profile_pitch_mm = kPitch_mm;
      EXPECT_FALSE(scan.points_mm.empty()) << scan.id;
      if (!scan.points_mm.empty()) portions.push_back(metrology::Thin(scan, calibration_, thinning));
    }
    return portions;
  }
  double WorstPlace_mm(const metrology::PoseFit& fit) const {
    const Eigen::Isometry3d& found = fit.placed.value().zero_from_part;
    double worst_mm = 0;
    for (const DesignedHoleGroup& group : part_.hole_groups)
      for (const DesignedHole& hole : group.holes)
        worst_mm = std::max(worst_mm, (found * hole.start_mm - zero_from_part_ * hole.start_mm).norm());
    for (const DesignedDatum& datum : part_.six_points)
      worst_mm = std::max(worst_mm, (found * datum.point_mm - zero_from_part_ * datum.point_mm).norm());
    return worst_mm;
  }
  metrology::PoseFit BestFit(const std::vector<metrology::ScanPortion>& portions) const {
    auto fit = metrology::FitToSurface(*surface_, portions, part_.zero_from_part_nominal, calibration_, {});
    EXPECT_TRUE(fit.ok()) << fit.status();
    EXPECT_EQ(fit->outcome, metrology::Outcome::kConverged) << fit->evidence.remark;
    return *std::move(fit);
  }

  const MachineDesign design_;
  const MachineTruth truth_ = MountedByHand(design_, seed());
  const metrology::MachineCalibration calibration_{
      {truth_.machine_from_sensor, truth_.t_sm_mm, metrology::SensorCovariance::Zero()},
      truth_.axes,
      metrology::AxesCovariance::Zero()};
  const DesignedPart part_ = DesignPart({}, design_.centre_mm);
  const Eigen::Isometry3d zero_from_part_ = ClampedByHand(part_, 1, 1, seed() + 300);
  const std::shared_ptr<const Shape> blade_ = std::make_shared<TriangleShape>(part_.mesh);
  const std::shared_ptr<const metrology::Surface> surface_ = *metrology::Surface::Prepare(part_.mesh);
};

// Of places all over the blade those that the machine read a point beside: what the plan promises, before anybody knows how the blade is clamped.
double SeenShare(const DesignedPart& part, const Eigen::Isometry3d& zero_from_part,
                 const std::vector<metrology::ScanPortion>& portions) {
  constexpr double kBeside_mm = 0.8;  // two profiles and some columns: what was thinned out lies between
  using Cell = std::array<int, 3>;
  std::set<Cell> read;
  const auto cell = [&](const Vector3d& in_part_mm) {
    return Cell{static_cast<int>(std::floor(in_part_mm.x() / kBeside_mm)),
                static_cast<int>(std::floor(in_part_mm.y() / kBeside_mm)),
                static_cast<int>(std::floor(in_part_mm.z() / kBeside_mm))};
  };
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse();
  for (const metrology::ScanPortion& portion : portions)
    for (std::size_t i = 0; i < portion.sensor.size(); ++i) read.insert(cell(part_from_zero * portion.zero_mm(i)));
  const metrology::SurfaceSamples places = metrology::SampleSurface(part.mesh, 20'000);
  std::size_t seen = 0;
  for (const metrology::SurfaceSample& place : places.samples) {
    const Cell at = cell(place.point_mm);
    bool beside = false;
    for (int k = 0; k < 27; ++k)
      beside = beside || read.count({at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1}) > 0;
    seen += beside ? 1 : 0;
  }
  return static_cast<double>(seen) / static_cast<double>(places.samples.size());
}

TEST_P(MeasuringPlanRun, OfTheWholeBladeFindsIt) {
  const metrology::MeasuringPlan plan = Plan({});
  ASSERT_EQ(plan.regions.size(), 1u);
  const std::vector<metrology::ScanPortion> portions = ScanBy(plan);
  const metrology::PoseFit fit = BestFit(portions);
  const double seen = SeenShare(part_, zero_from_part_, portions), worst_mm = WorstPlace_mm(fit);
  std::printf("whole blade, seed %d: %zu sweeps, %.1f %% promised, %.1f %% read, %.2f um at the worst place\n",
              GetParam(), plan.portions.size(), 100 * plan.regions[0].Share(), 100 * seen, 1e3 * worst_mm);
  EXPECT_GE(plan.regions[0].Share(), 0.95);
  EXPECT_GE(seen, plan.regions[0].Share() - 0.01);  // as exact as the plan says that it is
  EXPECT_LT(worst_mm, kPoseLimit_mm);
}

TEST_P(MeasuringPlanRun, OfTheSixPointsFindsTheBladeByThem) {
  std::vector<metrology::NamedDisc> discs;
  std::vector<metrology::DatumPoint> datums;
  for (const DesignedDatum& datum : part_.six_points) {
    discs.push_back({datum.name, {datum.point_mm, datum.normal, 3}});
    datums.push_back({datum.name, datum.point_mm, datum.normal});
  }
  const metrology::MeasuringPlan plan = Plan(discs);
  ASSERT_EQ(plan.regions.size(), 6u);
  for (const metrology::RegionCoverage& region : plan.regions) EXPECT_GE(region.Share(), 0.95) << region.name;
  const std::vector<metrology::ScanPortion> portions = ScanBy(plan);
  const metrology::PoseFit best_fit = BestFit(portions);
  for (const auto variant : {metrology::SixPointVariant::kPairs, metrology::SixPointVariant::kNormals}) {
    const auto fit = metrology::FitSixPoints(*surface_, portions, datums, best_fit, variant, calibration_, {});
    ASSERT_TRUE(fit.ok()) << fit.status();
    ASSERT_EQ(fit->outcome, metrology::Outcome::kConverged) << fit->evidence.remark;
    std::printf("six points, seed %d: %zu sweeps, %.2f um at the worst place\n", GetParam(), plan.portions.size(),
                1e3 * WorstPlace_mm(*fit));
    EXPECT_LT(WorstPlace_mm(*fit), kPoseLimit_mm);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, MeasuringPlanRun, ::testing::Values(1, 2));

}  // namespace
}  // namespace sixpoint::simulator
