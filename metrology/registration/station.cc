#include "metrology/registration/station.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "metrology/surface/neighbours.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kTogether = 500'000;  // points that are looked at together: memory is theirs
constexpr std::size_t kLooks = 10'000;      // at points, from which side they were seen
constexpr double kSeenOnSurfaceMm = 0.1;
constexpr double kBehind = 0.2;  // cosine: so far from behind no fan of the scanner reaches, and no edge is rounded
constexpr double kMostSeenThrough = 0.1, kLeastSurface = 0.1;

std::vector<bool> AreOwn(const Points& zero_mm, const Surface& surface, const Station& station, int thread_count) {
  const std::vector<double> own_mm =
      DistancesAt(station.zero_from_part_nominal, surface, zero_mm, station.capture_mm, thread_count);
  return metrology::AreOwn(station.neighbours, surface, zero_mm, own_mm, station.capture_mm, thread_count);
}

// Of those from first on that are looked at together.
template <typename ZeroAt>
std::vector<bool> AreOwn(std::size_t count, const ZeroAt& zero_at, const Surface& surface, const Station& station,
                         int thread_count) {
  std::vector<bool> are_own;
  for (std::size_t first = 0; first < count; first += kTogether) {
    Points zero_mm;
    for (std::size_t i = first; i < std::min(count, first + kTogether); ++i) zero_mm.push_back(zero_at(i));
    const std::vector<bool> some = AreOwn(zero_mm, surface, station, thread_count);
    are_own.insert(are_own.end(), some.begin(), some.end());
  }
  return are_own;
}

// Of some of the points that lie on the surface, the share at which that looks away from the scanner.
double SeenThrough(const Surface& surface, const std::vector<ScanPortion>& portions, const Isometry3d& zero_from_part) {
  const Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  std::size_t total = 0, on_surface = 0, from_behind = 0;
  for (const ScanPortion& portion : portions) total += portion.sensor.size();
  const std::size_t stride = std::max<std::size_t>(1, total / kLooks);
  for (const ScanPortion& portion : portions) {
    // The scanner looks down its z.
    const Vector3d to_scanner = part_from_zero.linear() * portion.zero_from_sensor.linear().col(2).normalized();
    for (std::size_t i = 0; i < portion.sensor.size(); i += stride) {
      const SurfacePoint found = surface.ClosestWithin(part_from_zero * portion.zero_mm(i), kSeenOnSurfaceMm);
      if (std::isnan(found.signed_distance_mm) || found.feature != SurfaceFeature::kFace) continue;
      ++on_surface;
      if (found.normal.dot(to_scanner) < -kBehind) ++from_behind;
    }
  }
  return static_cast<double>(from_behind) / static_cast<double>(std::max<std::size_t>(1, on_surface));
}

Points Kept(const Points& points, const std::vector<bool>& are_kept) {
  Points kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (are_kept[i]) kept.push_back(points[i]);
  return kept;
}

}  // namespace

std::int64_t LeaveOutOthers(const Surface& surface, const Station& station, int thread_count, ScanPortion* portion) {
  const auto are_own = [&](std::size_t count, const auto& zero_at) {
    return AreOwn(count, zero_at, surface, station, thread_count);
  };
  const std::vector<bool> are_kept =
      are_own(portion->sensor.size(), [&](std::size_t i) { return portion->zero_mm(i); });
  CompactPoints own;
  own.reserve(static_cast<std::size_t>(std::count(are_kept.begin(), are_kept.end(), true)));
  for (std::size_t i = 0; i < portion->sensor.size(); ++i)
    if (are_kept[i]) own.Add(portion->sensor[i]);
  const auto left_out_count = static_cast<std::int64_t>(portion->sensor.size() - own.size());
  portion->sensor = std::move(own);
  const std::vector<bool> are_dense_kept =
      are_own(portion->dense_zero_mm.size(), [&](std::size_t i) { return portion->dense_zero_mm[i]; });
  portion->dense_sensor_mm = Kept(portion->dense_sensor_mm, are_dense_kept);
  portion->dense_zero_mm = Kept(portion->dense_zero_mm, are_dense_kept);
  return left_out_count;
}

void HoldToStation(const Surface& surface, const std::vector<ScanPortion>& portions, const Station& station,
                   const FitOptions& options, PoseFit* fit) {
  if (!fit->placed) return;
  const Isometry3d& zero_from_part = fit->placed->zero_from_part;
  const double off_mm = GreatestDisplacement_mm({surface.minimum_mm(), surface.maximum_mm()}, zero_from_part,
                                                station.zero_from_part_nominal);
  const double seen_through = SeenThrough(surface, portions, zero_from_part);
  char text[160];
  if (off_mm > station.capture_mm) {
    std::snprintf(text, sizeof text,
                  "the part would stand %.3g mm from its nominal place at the station, want at most its capture_mm, %g",
                  off_mm, station.capture_mm);
    fit->Withdraw(Outcome::kNotConverged, text);
  } else if (seen_through > kMostSeenThrough) {
    fit->Withdraw(Outcome::kTooLittleOverlap, "of the points on the surface " + Percent(seen_through) +
                                                  " would have been seen through the part, want at most " +
                                                  Percent(kMostSeenThrough) + ": they are of its fixture");
  } else if (options.regions_in.empty() && fit->evidence.surface_part < kLeastSurface) {
    fit->Withdraw(Outcome::kTooLittleOverlap, "of the part's surface " + Percent(fit->evidence.surface_part) +
                                                  " is seen at the station, want at least " + Percent(kLeastSurface) +
                                                  ", or regions_in: too little to tell it from what is beside it");
  }
}

}  // namespace sixpoint::metrology
