#include "services/correction/plan_repair.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "metrology/inspection/part_mapping.h"
#include "services/correction/blade_points.h"
#include "services/correction/repair_order.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

using metrology::Points;

constexpr std::size_t kMostPoints = 10'000'000;

// Points of the blade and its weld, part frame: within the heights, and no farther from the CAD than asked.
class BladeCloud {
 public:
  BladeCloud(const clients::RegisteredBlade& blade, const storage::RepairMethodRow& method, int threads)
      : surface_(*blade.surface),
        mapping_(*blade.pose, blade.sensor, blade.axes),
        method_(method),
        // A section takes what lies by it.
        low_mm_(method.first_mm - method.line_width_mm / 2),
        threads_(threads) {}

  absl::Status Begin(const metrology::LineScan& scan) {
    place_ = mapping_.PlaceOf(scan);
    return absl::OkStatus();
  }
  absl::Status Add(const Points& in_sensor_mm) {
    Points read;
    for (const Eigen::Vector3d& point : in_sensor_mm) {
      const Eigen::Vector3d in_part_mm = mapping_.PartPoint(point, place_);
      if (in_part_mm.z() >= low_mm_ && in_part_mm.z() <= method_.target_mm)
        read.push_back(in_part_mm);
      else
        ++counts.left_out;
    }
    std::vector<double> outside_mm;
    surface_.SignedDistances(read, method_.farthest_mm, threads_, &outside_mm);
    for (std::size_t i = 0; i < read.size(); ++i) {
      if (!(std::abs(outside_mm[i]) < method_.farthest_mm)) {
        ++counts.left_out;
        continue;
      }
      ++(read[i].z() > method_.repair_line_mm ? counts.above_line : counts.below_line);
      points_mm.push_back(read[i]);
    }
    if (points_mm.size() <= kMostPoints) return absl::OkStatus();
    return absl::ResourceExhaustedError("scans: more than " + std::to_string(kMostPoints) +
                                        " points of the blade, want fewer");
  }

  Points points_mm;
  RepairCounts counts;

 private:
  const metrology::Surface& surface_;
  const metrology::PartMapping mapping_;
  const storage::RepairMethodRow& method_;
  const double low_mm_;
  const int threads_;
  metrology::ScanPlace place_;
};

// As the request calls what the kernel refuses.
absl::Status AsAskedOfRepair(const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  const std::pair<const char*, const char*> names[] = {{"heights.cutoff_mm", "heights.repair_line_mm"},
                                                       {"mill.radius_mm", "mill.diameter_mm"},
                                                       {"depth_of_cut_mm", "method.depth_of_cut_mm"},
                                                       {"finish_allowance_mm", "method.finish_allowance_mm"},
                                                       {"roughing_step_mm", "method.roughing_step_mm"},
                                                       {"scallop_mm", "method.scallop_um"},
                                                       {"guard_mm", "method.guard_um"},
                                                       {"half_width_mm", "heights.line_width_mm"}};
  for (Violation& violation : violations)
    for (const auto& [kernels, asked] : names)
      if (violation.field == kernels) {
        violation.field = asked;
        break;
      }
  return Refuse(violations);
}

}  // namespace

absl::StatusOr<PlannedRepair> PlanRepairOf(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                           const storage::RepairMethodRow& method, int threads,
                                           const runtime::Caller& caller) {
  const metrology::RepairOptions options = RepairOptionsOf(method, *blade.surface, threads, caller);
  // Before the scans are read.
  if (absl::Status good = metrology::CheckRepair(options); !good.ok()) return AsAskedOfRepair(good);
  BladeCloud cloud(blade, method, threads);
  const absl::Status read = ReadBladePoints(
      scans, blade, caller, [&](const metrology::LineScan& scan) { return cloud.Begin(scan); },
      [&](const Points& points_mm) { return cloud.Add(points_mm); });
  if (!read.ok()) return read;
  auto plan = metrology::PlanRepair(cloud.points_mm, options);
  if (!plan.ok()) return AsAskedOfRepair(plan.status());
  return PlannedRepair{*std::move(plan), cloud.counts};
}

}  // namespace sixpoint::correction
