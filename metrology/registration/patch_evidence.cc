#include "metrology/registration/patch_evidence.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr double kLeastShareOfScan = 0.6;  // of the part used of all points, below which a scan is named
constexpr double kRegionsAcross = 2;       // of the part's radius of gyration

using PatchesAtPlaces = std::map<PatchKey, std::vector<std::size_t>>;

void CountPoints(const std::vector<ScanPortion>& portions, const PatchSums& sums, const PatchFit& patches,
                 FitEvidence* evidence) {
  evidence->portions.resize(portions.size());
  for (std::size_t p = 0; p < portions.size(); ++p) {
    evidence->portions[p].scan = portions[p].id;
    evidence->portions[p].point_count = sums.portions[p].points;
    evidence->portions[p].residual_median_mm = sums.portions[p].residual_median_mm;
    evidence->point_count += sums.portions[p].points;
  }
  double squares = 0;
  for (std::size_t k = 0; k < sums.patches.size(); ++k) {
    const Patch& patch = sums.patches[k];
    if (patches.weights[k] <= 0.5) continue;
    evidence->portions[patch.portion].points_used += patch.used;
    evidence->points_used += patch.used;
    squares += patch.used_squares;
  }
  if (evidence->points_used > 0)
    evidence->residual_rms_mm = std::sqrt(squares / static_cast<double>(evidence->points_used));
  evidence->overlap = static_cast<double>(evidence->points_used) /
                      static_cast<double>(std::max<std::int64_t>(1, evidence->point_count));
}

void DescribeRegions(const Surface& surface, const PatchSums& sums, const PatchFit& patches, double patch_mm,
                     FitEvidence* evidence) {
  struct RegionSum {
    std::int64_t points = 0;
    double weight = 0, pull = 0, used = 0, patches = 0;
  };
  std::map<PatchKey, RegionSum> regions;
  const int times = std::max(1, static_cast<int>(surface.radius_of_gyration_mm() / kRegionsAcross / patch_mm));
  for (std::size_t k = 0; k < sums.patches.size(); ++k) {
    const Patch& patch = sums.patches[k];
    RegionSum& region = regions[CoarserKey(patch.key, times)];
    region.points += patch.count;
    region.weight += patch.weight;
    region.pull += patch.weight * patches.offsets_mm[k];
    region.used += patches.weights[k];
    region.patches += 1;
  }
  for (const auto& [key, region] : regions)
    evidence->regions.push_back({surface.centroid_mm() + PatchCentre(key, patch_mm, times), region.points,
                                 region.pull / region.weight, region.used / region.patches});
}

void CompareScans(const std::vector<ScanPortion>& portions, const PatchesAtPlaces& places, const PatchSums& sums,
                  const PatchFit& patches, const FitOptions& options, FitEvidence* evidence) {
  const auto scan_weight = [&](std::uint32_t portion) {
    return options.scan_weights.empty() ? 1 : options.scan_weights[portion];
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, PortionAgreement> pairs;
  for (const auto& [key, here] : places) {
    for (std::size_t i = 0; i < here.size(); ++i)
      for (std::size_t j = i + 1; j < here.size(); ++j) {
        const Patch &one = sums.patches[here[i]], &other = sums.patches[here[j]];
        PortionAgreement& pair = pairs[{one.portion, other.portion}];
        const double difference = patches.offsets_mm[here[i]] - patches.offsets_mm[here[j]];
        // A place counts by how well both saw it: the variance that noise leaves there, in that of a point.
        const double variance = scan_weight(one.portion) / one.weight + scan_weight(other.portion) / other.weight;
        ++pair.patch_count;
        pair.difference_rms_mm += difference * difference / variance;
        pair.expected_rms_mm += 1 / variance;
      }
  }
  for (auto& [key, pair] : pairs) {
    pair.scan = portions[key.first].id;
    pair.other = portions[key.second].id;
    pair.difference_rms_mm = std::sqrt(pair.difference_rms_mm / pair.expected_rms_mm);
    pair.expected_rms_mm =
        patches.noise_sigma_mm * std::sqrt(static_cast<double>(pair.patch_count) / pair.expected_rms_mm);
    evidence->agreements.push_back(pair);
  }
}

}  // namespace

void DescribePatches(const Surface& surface, const std::vector<ScanPortion>& portions, const PatchSums& sums,
                     const PatchFit& patches, double patch_mm, const FitOptions& options, FitEvidence* evidence) {
  CountPoints(portions, sums, patches, evidence);
  if (surface.HasGaps()) {
    evidence->gap_point_count = 0;
    for (std::size_t k = 0; k < sums.patches.size(); ++k)
      if (patches.weights[k] > 0.5) *evidence->gap_point_count += sums.patches[k].at_gap;
  }
  DescribeRegions(surface, sums, patches, patch_mm, evidence);
  PatchesAtPlaces places;
  for (std::size_t k = 0; k < sums.patches.size(); ++k) places[sums.patches[k].key].push_back(k);
  CompareScans(portions, places, sums, patches, options, evidence);
  // A plane through a cubic cell has the cell's face as its projection along the side's axis; the slant is at most sqrt 3.
  evidence->surface_part = std::min(1.0, static_cast<double>(places.size()) * patch_mm * patch_mm / surface.area_mm2());
}

std::string StandingOff(const FitEvidence& evidence) {
  std::string listed;
  for (const PortionEvidence& portion : evidence.portions) {
    const double used =
        static_cast<double>(portion.points_used) / static_cast<double>(std::max<std::int64_t>(1, portion.point_count));
    if (used < kLeastShareOfScan * evidence.overlap)
      listed += (listed.empty() ? "" : ", ") + portion.scan + " (" + Percent(used) + ")";
  }
  return listed.empty() ? "" : "few points used of: " + listed + "; of all " + Percent(evidence.overlap);
}

}  // namespace sixpoint::metrology
