#include "services/inspection/profile_points.h"

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "services/inspection/deviation_rows.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

using Eigen::Vector3d;
using runtime::ThreeOf;

}  // namespace

absl::StatusOr<std::vector<exchange::DeviationPoint>> ProfilePoints(const storage::DeviationMapRow& map,
                                                                    const storage::DeviationProfileRow& profile,
                                                                    const storage::DeviationPatchesRow& patches) {
  const std::size_t count = patches.means_um.size();
  const auto row = std::find_if(map.regions.begin(), map.regions.end(), [&](const storage::DeviationRegionRow& region) {
    return region.region == profile.region;
  });
  if (row == map.regions.end() || static_cast<int>(count) != map.patch_count ||
      patches.centres_in_part_mm.size() != 3 * count || patches.normals_in_part.size() != 3 * count ||
      patches.areas_mm2.size() != count)
    return absl::DataLossError(runtime::NameOf("deviations", map.deviation_id) +
                               ": its patches or regions are not its own");
  const metrology::SurfaceRegion region = BoundsOf(*row);
  std::vector<exchange::DeviationPoint> points;
  Vector3d middle_mm = Vector3d::Zero();
  double area_mm2 = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d centre_mm(&patches.centres_in_part_mm[3 * i]), normal(&patches.normals_in_part[3 * i]);
    if (!std::isfinite(patches.means_um[i]) || !region.Has(centre_mm, normal)) continue;
    points.push_back({ThreeOf(centre_mm), ThreeOf(normal), runtime::kMmPerUm * patches.means_um[i]});
    middle_mm += patches.areas_mm2[i] * centre_mm;
    area_mm2 += patches.areas_mm2[i];
  }
  if (profile.motion.size() != 6 || area_mm2 == 0) return points;
  middle_mm /= area_mm2;
  const Vector3d turn_rad(&profile.motion[0]), shift_mm(&profile.motion[3]);
  for (exchange::DeviationPoint& point : points) {
    const Vector3d centre_mm(point.nominal_mm.data()), normal(point.normal.data());
    point.deviation_mm -= (centre_mm - middle_mm).cross(normal).dot(turn_rad) + normal.dot(shift_mm);
  }
  return points;
}

}  // namespace sixpoint::inspection
