// How far a part's surface is off its CAD, place by place: the mean of each patch's points with its uncertainty, how they spread, and what was
// not seen (docs/methods/deviation.md).
//
// Signed, positive outside. Frames: part. Units: mm. The same scans in the same order give the same bits on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "metrology/cloud/deviation_cloud.h"
#include "metrology/inspection/hole_regions.h"
#include "metrology/inspection/mean_causes.h"
#include "metrology/inspection/part_mapping.h"
#include "metrology/inspection/surface_patches.h"
#include "metrology/parallel/keep_going.h"

namespace sixpoint::metrology {

// A place of the surface at which the mean about it is wanted, as of a touched point of a characteristic.
struct DeviationPlace {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // on the CAD
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // outward
  double radius_mm = 0.5;                              // more than 0, at most four patches
};

struct DeviationOptions {
  int threads = 2;
  double farthest_mm = 1;  // a point farther from the CAD is not of this part
  double patch_mm = 1;
  int least_points = 10;                   // a patch with fewer was not seen
  std::vector<HoleRegion> set_aside = {};  // what stands there is no surface: pins
  std::vector<DeviationPlace> places = {};
  std::int64_t greatest_point_count = 60'000'000;
  std::function<bool()> keep_going = {};
};

struct PatchDeviation {
  std::int64_t point_count = 0;
  // Unset, and nothing else said, where it was not seen.
  std::optional<double> mean_mm;
  double standard_deviation_mm = 0;    // of a point about the mean
  double points_uncertainty_mm = 0;    // standard, of the mean: of its points alone
  double standard_uncertainty_mm = 0;  // of the mean, all sources
  double degrees_of_freedom = 0;
  double expanded_uncertainty_mm = 0;  // 95 %
};

struct PointCounts {
  std::int64_t compared = 0;
  std::int64_t at_edges = 0;  // their nearest place is a sharp edge or a rim, or so near that noise may have crossed it
  std::int64_t set_aside = 0;
  std::int64_t far_off = 0;  // beyond farthest_mm
};

// The patch's uncertainty by these effects of the causes on it: a row of per_sigma_mm, or what a fit has left of one.
void ExpandDeviation(const DeviationCauses& causes, const Eigen::Ref<const Eigen::RowVectorXd>& per_sigma_mm,
                     PatchDeviation* patch);

struct DeviationField;

// What each source contributes to the uncertainty of a mean, mm^2: over all patches that were seen, by area.
std::vector<UncertaintyComponent> UsualComponents(const DeviationField& field);

// Deviations of the points of some patches.
struct DeviationStatistics {
  double area_mm2 = 0, seen_area_mm2 = 0;
  std::int64_t point_count = 0;
  // Unset where nothing was seen.
  struct Values {
    double mean_mm, rms_mm;         // by area, of the patches' means
    double p05_mm, p50_mm, p95_mm;  // of points, to 0.1 um
    std::uint32_t lowest, highest;  // patches with the least and the greatest mean
  };
  std::optional<Values> values;
};

struct DeviationField {
  std::shared_ptr<const SurfacePatches> surface;
  std::vector<PatchDeviation> patches;  // of each of the surface's
  std::vector<PatchDeviation> places;   // of each that was asked for
  DeviationCauses causes;               // rows: patches, then places
  PointCounts points;
  DeviationStatistics whole;
  std::vector<DeviationStatistics> regions;  // as they were asked for
};

// Scans are added one after another and need not be kept. Not thread-safe; computes on its own threads.
class DeviationMap {
 public:
  // regions: lists of patches whose points' statistics are wanted together, at most 255.
  DeviationMap(std::shared_ptr<const Surface> surface, std::shared_ptr<const SurfacePatches> patches,
               PartMapping mapping, DeviationOptions options, std::vector<std::vector<std::uint32_t>> regions = {});
  ~DeviationMap();

  // RESOURCE_EXHAUSTED beyond greatest_point_count, CANCELLED where the caller is gone: then some are counted and some are not.
  absl::Status Add(const LineScan& scan);
  // The same in pieces: the scan without its points, then its points as they come. compared: those whose deviation counts are appended.
  void Begin(const LineScan& scan);
  absl::Status AddPoints(const Points& points_mm, DeviationPoints* compared = nullptr);
  // FAILED_PRECONDITION where no patch was seen.
  absl::StatusOr<DeviationField> Finish();

 private:
  struct Sums;
  struct Found;
  class Histogram;
  struct Counter;
  struct Compared {
    float deviation_mm;
    std::uint32_t patch;  // SurfacePatches::kNone where there is none
  };
  Points InPart(const Points& points_mm) const;
  // Of each chunk of the points; those compared are counted at once. deviations_mm: null, or set of those.
  std::vector<Found> Look(const Points& points_mm, const Points& in_part_mm, KeepGoing* keep_going,
                          std::vector<float>* deviations_mm);
  void Count(const std::vector<Compared>& compared, Counter* counter) const;
  void Take(const Found& found);
  DeviationStatistics StatisticsOf(const DeviationField& field, const std::vector<std::uint32_t>* patches,
                                   const Histogram& histogram) const;
  std::size_t CounterCount() const;  // so many that threads seldom wait for one another
  // Patches, then places.
  std::size_t MeanCount() const;
  void PutPlaces();
  void AddToPlaces(std::uint32_t patch, const SurfacePoint& found, const Sums& point,
                   std::vector<std::pair<std::uint32_t, Sums>>* sums) const;
  PatchDeviation Measured(std::size_t mean) const;
  DeviationCauses CausesOf(const std::vector<PatchDeviation>& means) const;

  std::shared_ptr<const Surface> surface_;
  std::shared_ptr<const SurfacePatches> patches_;
  PartMapping mapping_;
  DeviationOptions options_;
  std::vector<std::vector<std::uint32_t>> regions_;
  HoleRegions set_aside_;
  std::vector<std::vector<std::uint8_t>> regions_of_;  // of each patch
  std::vector<ScanPlace> scans_;
  std::vector<std::vector<std::uint32_t>> places_of_;  // of each patch, those that reach into it
  std::vector<std::vector<Sums>> sums_;                // [scan][mean]
  std::vector<std::unique_ptr<Counter>> counters_;     // which counts what changes nothing
  PointCounts counts_;
};

}  // namespace sixpoint::metrology
