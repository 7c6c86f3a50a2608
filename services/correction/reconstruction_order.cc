#include "services/correction/reconstruction_order.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "refusal/message_text.h"
#include "services/correction/applied_value.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/surface_where.h"

namespace sixpoint::correction {
namespace {

// Bytes of a lattice's factor, at most: more than a blade of a hand's size takes at a millimetre.
constexpr double kMostFactorBytes = 4e9;

void AddListed(const geometry::v1::Point& point, std::vector<double>* out) {
  *out = {point.x_mm(), point.y_mm(), point.z_mm()};
}

storage::ShapeRegionRow ShapeRegionRowOf(const plant::v1::ShapeRegion& region) {
  storage::ShapeRegionRow row;
  row.region = region.region();
  if (region.has_minimum_in_part_mm()) AddListed(region.minimum_in_part_mm(), &row.minimum_in_part_mm);
  if (region.has_maximum_in_part_mm()) AddListed(region.maximum_in_part_mm(), &row.maximum_in_part_mm);
  if (region.has_facing_in_part()) {
    const geometry::v1::Direction& facing = region.facing_in_part();
    row.facing_in_part = {facing.x(), facing.y(), facing.z()};
    row.facing_within_deg = region.facing_within_deg();
  }
  row.kind = runtime::WordOf(region.kind());
  if (region.has_allowance_mm()) row.allowance_mm = region.allowance_mm();
  if (region.has_lower_mm()) row.lower_mm = region.lower_mm();
  if (region.has_upper_mm()) row.upper_mm = region.upper_mm();
  return row;
}

// Instead of what the part says, where its kind has such a limit.
absl::Status Try(const std::string& field, bool is_stated, double value, double least, std::optional<double>* limit) {
  if (!is_stated) return absl::OkStatus();
  if (!limit->has_value()) return runtime::Refuse(field, value, "none, for a region of this kind");
  *limit = value;
  if (value >= least && value <= metrology::kGreatestBand_mm) return absl::OkStatus();
  return runtime::Refuse(field, value, NumberText(least) + " to " + NumberText(metrology::kGreatestBand_mm));
}

absl::Status Try(const std::string& field, const v1::TriedLimits& tried, storage::ShapeRegionRow* row) {
  runtime::Refusals refusals;
  refusals.Add(Try(field + ".allowance_mm", tried.has_allowance_mm(), tried.allowance_mm(), 0, &row->allowance_mm));
  const double most = metrology::kGreatestBand_mm;
  refusals.Add(Try(field + ".lower_mm", tried.has_lower_mm(), tried.lower_mm(), -most, &row->lower_mm));
  refusals.Add(Try(field + ".upper_mm", tried.has_upper_mm(), tried.upper_mm(), -most, &row->upper_mm));
  if (row->lower_mm && !(*row->lower_mm < *row->upper_mm))
    refusals.Add(
        runtime::Refuse(field + ".lower_mm", *row->lower_mm, "less than upper_mm, " + NumberText(*row->upper_mm)));
  return refusals.status();
}

}  // namespace

metrology::ShapeRegion KernelOf(const storage::ShapeRegionRow& row) {
  metrology::ShapeRegion region;
  region.name = row.region;
  region.where = runtime::WhereOf<metrology::SurfaceRegion>(row);
  region.rest = row.minimum_in_part_mm.empty() && row.maximum_in_part_mm.empty() && row.facing_in_part.empty();
  region.kind = row.kind == "MACHINED" ? metrology::RegionKind::kMachined
                : row.kind == "FIXED"  ? metrology::RegionKind::kFixed
                                       : metrology::RegionKind::kDatum;
  region.allowance_mm = row.allowance_mm.value_or(0);
  region.lower_mm = row.lower_mm.value_or(0);
  region.upper_mm = row.upper_mm.value_or(0);
  return region;
}

absl::StatusOr<ReconstructionOrder> OrderOf(const v1::ReconstructRequest& request) {
  ReconstructionOrder order;
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("registration", "registrations", request.registration()).status());
  const v1::ReconstructionMethod& asked = request.method();
  storage::ReconstructionMethodRow& method = order.method;
  method.patch_mm = AppliedValue("patch_mm", asked.has_patch_mm(), asked.patch_mm(), 0.5, 0.1, 20, &refusals);
  method.farthest_mm =
      AppliedValue("farthest_mm", asked.has_farthest_mm(), asked.farthest_mm(), 1.5, 0.1, 5, &refusals);
  method.finest_spacing_mm = AppliedValue("finest_spacing_mm", asked.has_finest_spacing_mm(), asked.finest_spacing_mm(),
                                          2, 0.5, 100, &refusals);
  method.coarsest_spacing_mm =
      AppliedValue("coarsest_spacing_mm", asked.has_coarsest_spacing_mm(), asked.coarsest_spacing_mm(),
                   std::max(4.0, method.finest_spacing_mm), method.finest_spacing_mm, 100, &refusals);
  method.blend_mm = AppliedValue("blend_mm", asked.has_blend_mm(), asked.blend_mm(), 4, 0.1, 50, &refusals);
  method.coverage_factor =
      AppliedValue("coverage_factor", asked.has_coverage_factor(), asked.coverage_factor(), 3, 1, 10, &refusals);
  std::set<std::string> named;
  for (int i = 0; i < request.tried_limits_size(); ++i) {
    const v1::TriedLimits& tried = request.tried_limits(i);
    const std::string field = "tried_limits[" + std::to_string(i) + "]";
    if (!named.insert(tried.region()).second)
      refusals.Add(runtime::Refuse(field + ".region", tried.region(), "each region once"));
    if (!tried.has_allowance_mm() && !tried.has_lower_mm() && !tried.has_upper_mm())
      refusals.Add(runtime::Refuse(field, "no limit", "allowance_mm, lower_mm or upper_mm"));
    order.tried.push_back(tried);
  }
  if (!refusals.status().ok()) return refusals.status();
  return order;
}

absl::StatusOr<AppliedRegions> RegionsOf(const plant::v1::Part& part, const std::vector<v1::TriedLimits>& tried) {
  if (part.shape_regions().empty())
    return runtime::Refuse(
        "registration.part",
        runtime::RevisedName("parts", runtime::LastSegment(part.name()), part.revision()) + " has no shape_regions",
        "a part whose record says what is machined, fixed and datum");
  AppliedRegions applied;
  for (const plant::v1::ShapeRegion& region : part.shape_regions()) applied.rows.push_back(ShapeRegionRowOf(region));
  runtime::Refusals refusals;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    const std::string field = "tried_limits[" + std::to_string(i) + "]";
    const auto found = std::find_if(applied.rows.begin(), applied.rows.end(), [&](const storage::ShapeRegionRow& row) {
      return row.region == tried[i].region();
    });
    if (found == applied.rows.end())
      refusals.Add(runtime::Refuse(field + ".region", tried[i].region(), "one of the part's shape_regions"));
    else
      refusals.Add(Try(field, tried[i], &*found));
  }
  if (!refusals.status().ok()) return refusals.status();
  for (int i = 0; i < part.shape_regions_size(); ++i) {
    const storage::ShapeRegionRow &now = applied.rows[static_cast<std::size_t>(i)],
                                  own = ShapeRegionRowOf(part.shape_regions(i));
    applied.of_part_limits = applied.of_part_limits && now.allowance_mm == own.allowance_mm &&
                             now.lower_mm == own.lower_mm && now.upper_mm == own.upper_mm;
    applied.kernel.push_back(KernelOf(now));
  }
  return applied;
}

absl::Status CheckLatticeSize(const Eigen::Vector3d& minimum_mm, const Eigen::Vector3d& maximum_mm, double reach_mm,
                              double finest_spacing_mm) {
  std::array<double, 3> controls{};
  for (int axis = 0; axis < 3; ++axis)
    controls[static_cast<std::size_t>(axis)] =
        std::ceil((maximum_mm[axis] - minimum_mm[axis] + 2 * reach_mm) / finest_spacing_mm) + 3;
  // Layers across the longest side, each coupled with three that follow.
  std::sort(controls.begin(), controls.end());
  const double layer = controls[0] * controls[1], bytes = 4 * 8 * layer * layer * controls[2];
  if (bytes <= kMostFactorBytes) return absl::OkStatus();
  return runtime::Refuse("method.finest_spacing_mm", finest_spacing_mm,
                         "so wide that the lattice's factor takes at most 4 GB; it would take up to " +
                             NumberText(std::ceil(1e-9 * bytes)));
}

}  // namespace sixpoint::correction
