// A scan summed up by patches of the surface: what FitToSurface works on once it stands near the pose.
//
// Millions of points become some thousands of sums, so that a fit reads the points once or twice. A patch, not a point, is
// the unit that is kept or thrown out: the mean of its points shows a casting's deviation of a fraction of the noise.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "metrology/registration/fit_evidence.h"
#include "metrology/registration/fit_options.h"
#include "metrology/surface/patch_key.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// A pose change here is scaled and in the part frame: rotation about the centroid times the radius of gyration, then
// translation; a row is a point's residual per such change, negated.
inline Vector6d PartRow(const Eigen::Vector3d& from_centroid_mm, const Eigen::Vector3d& normal, double radius_mm) {
  Vector6d row;
  row << from_centroid_mm.cross(normal) / radius_mm, normal;
  return row;
}

inline double PatchWidthMm(double radius_of_gyration_mm) {
  constexpr double kAcross = 16, kLeastMm = 0.25;
  return std::max(kLeastMm, radius_of_gyration_mm / kAcross);
}

// One portion's points on one patch; w is Tukey's weight of a point's residual r, J its row.
struct Patch {
  PatchKey key = 0;
  std::uint32_t portion = 0;
  std::int64_t count = 0;             // within the width
  std::int64_t used = 0;              // w above 1/2
  double used_squares = 0;            // of their residuals
  double weight = 0;                  // sum of w
  double pull = 0;                    // sum of w r
  double squares = 0;                 // sum of w r^2
  double gap_squares = 0;             // sum of w times the CAD's gap there, squared (Surface::GapNear)
  std::int64_t at_gap = 0;            // of those used
  Vector6d row = Vector6d::Zero();    // sum of w J
  Vector6d right = Vector6d::Zero();  // sum of w r J
  std::array<double, 21> matrix{};    // sum of w J J^T, lower triangle by rows

  Matrix6d Matrix() const;
  double Gap() const;  // mm, root mean square over the points
};

struct PortionCounts {
  std::int64_t points = 0;                    // within the regions asked for
  double residual_median_mm = kUndetermined;  // of the points within the width
};

struct PatchSums {
  std::vector<Patch> patches;  // in the order in which the points meet them
  std::vector<PortionCounts> portions;
  double residual_sigma_mm = kUndetermined;  // 1.4826 MAD of the points within the width
  // Over all points: sum of the loss's second derivative, and sum of w^2 r^2, by sum of w. 1 and the noise's variance where
  // nothing is cut off.
  double slope = 1;
  double variance = 0;
};

struct PatchSumOptions {
  double width_mm = 0;  // of the loss: points beyond it do not count
  double patch_mm = 0;
  bool robust = true;  // false: every point within the width counts fully
  // From this part to the one whose cells the patches are of: points stay in their patches while a pose changes.
  Eigen::Isometry3d cells_from_part = Eigen::Isometry3d::Identity();
};

// CANCELLED: options.keep_going said so.
absl::StatusOr<PatchSums> SumPatches(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Eigen::Isometry3d& zero_from_part, const PatchSumOptions& sum,
                                     const FitOptions& options);

}  // namespace sixpoint::metrology
