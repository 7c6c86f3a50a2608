// What a fit is worth: points, spread, condition, and how scans and regions agree.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Of a figure that was not determined: no point is within the loss's reach, or no pose was found that it could be of.
inline constexpr double kUndetermined = std::numeric_limits<double>::quiet_NaN();

// One scan's share.
struct PortionEvidence {
  std::string scan;
  std::int64_t point_count = 0;
  std::int64_t points_used = 0;
  double residual_median_mm = kUndetermined;  // of the points within the loss's reach
};

// Two scans where they see the same surface: what the one says of its place and the other does not.
struct PortionAgreement {
  std::string scan, other;
  std::int64_t patch_count = 0;  // seen by both
  double difference_rms_mm = 0;  // of their offsets, patch by patch, each weighted by how well both saw it
  double expected_rms_mm = 0;    // from the scanner's noise alone
};

// The scan's offset from the CAD in one part of it.
struct RegionResidual {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // part frame
  std::int64_t point_count = 0;
  double mean_mm = 0;
  double used_part = 0;  // of the patches there, by the loss
};

struct DatumDistance {
  std::string name;
  double distance_mm = 0;  // of the scanned surface from the best-fitted CAD, along the normal
  double standard_uncertainty_mm = 0;
  std::int64_t point_count = 0;
};

// Whether the scans put the surface at one place (merged_views.h).
struct MergeTest {
  int freedom = 0;  // calibration errors that the overlaps can tell apart; 0: no overlap
  double chi_squared = 0;
  double limit = 0;  // of chi squared
  bool beyond = false;
  double scatter = 1;  // of the differences that no calibration error explains, by the noise
};

struct FitEvidence {
  std::int64_t point_count = 0;  // points looked at, after thinning
  std::int64_t points_used = 0;  // weight above 1/2
  int iteration_count = 0;
  double residual_rms_mm = kUndetermined;    // of the points used
  double residual_sigma_mm = kUndetermined;  // 1.4826 MAD of the points within the loss's reach
  double overlap = 0;
  double condition_number = kUndetermined;                 // rotation scaled by the part's radius of gyration
  Vector6d weakest_direction = NotYet<Vector6d>();         // rotation times that radius, translation; unit
  double weakest_standard_uncertainty_mm = kUndetermined;  // from noise and model error
  double noise_sigma_mm = 0;                               // of a point
  double model_sigma_mm = 0;                               // of a patch, beyond its points' noise: casting, sensor, CAD
  double patch_mm = 0;
  double correlation_widening = 1;  // of variances, because neighbouring patches err together
  double information_kept = 1;      // of what the points say along the weakest direction, by the loss
  double surface_part = 0;          // of the CAD's area that the scan covers
  double last_step_mm = 0;
  std::optional<std::int64_t> gap_point_count;  // points used near a gap of the CAD's faces; none: a CAD without
  int drawn_hole_count = 0;                     // of the part's, that its CAD shows as drilled; of a registration only
  std::optional<std::int64_t> left_out_count;   // points that are not its station's (station.h); of a registration only
  // zero_from_part where the search stopped, which the figures above are of: no place of the part unless the fit converged.
  std::optional<Eigen::Isometry3d> stopped_at;
  std::vector<PortionAgreement> agreements;
  std::optional<MergeTest> merge;  // of a converged fit
  std::vector<RegionResidual> regions;
  std::vector<PortionEvidence> portions;
  std::vector<DatumDistance> datums;
  std::string weakest_direction_in_words;  // of the part's axes; of a registration only (register.h)
  std::string remark;
};

// Added to the remark; nothing for no words.
void AddRemark(const std::string& more, FitEvidence* evidence);
// A part of one as remarks have it: "62 %", cut to a whole number.
std::string Percent(double part);

}  // namespace sixpoint::metrology
