// Where the part stands: its pose at A = B = 0 from scans of its surface (docs/methods/registration.md, best fit).
//
// Best fit: robust point-to-surface least squares (Tukey's biweight), Gauss-Newton on the pose's tangent space, the loss
// annealed from the nominal pose's error down to the scanner's noise on some thousands of points; then all points, summed by
// patches of the surface, a patch kept or thrown out as a whole (patch_fit.h). Local: the same on one region. Six-point:
// from a best fit, each datum's distance along its normal out of a local robust quadratic fit of the scan's deviation
// there; then, once, the CAD is fitted to those six points alone: least squares over the six pairs (the paper's), or the
// one pose that takes all six distances to zero (a 3-2-1 nest; it multiplies every local error by the nest's condition).
//
// Same inputs give the same bits on any number of threads. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/registration/scan_portion.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

enum class Outcome {
  kConverged,
  kNotConverged,
  kNotDetermined,     // the points leave at least one direction free
  kTooLittleOverlap,  // too few of the points lie on the surface
  kInfeasible,        // no pose near leaves the stock asked for (allowance.h)
};

enum class SixPointVariant { kPairs, kNormals };

struct DatumPoint {
  std::string name;
  Eigen::Vector3d point_mm;  // part frame, on the surface
  Eigen::Vector3d normal;    // outward unit normal there
};

struct DatumDistance {
  std::string name;
  double distance_mm = 0;  // of the scanned surface from the best-fitted CAD, along the normal
  double standard_uncertainty_mm = 0;
  std::int64_t point_count = 0;
};

// A part of space in which points count, or do not; part frame.
struct Region {
  enum class Shape { kBox, kBall } shape = Shape::kBox;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_mm = Eigen::Vector3d::Zero();  // half the box's edges; a ball's radius in x

  // `margin_mm` makes it larger.
  bool Holds(const Eigen::Vector3d& point_mm, double margin_mm = 0) const {
    const Eigen::Vector3d from = point_mm - centre_mm;
    return shape == Shape::kBall ? from.norm() <= half_mm.x() + margin_mm
                                 : ((from.cwiseAbs() - half_mm).array() <= margin_mm).all();
  }
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

struct PortionEvidence {
  std::string scan;
  std::int64_t point_count = 0;
  std::int64_t points_used = 0;
  double residual_median_mm = 0;  // of the points within the loss's reach
};

struct FitEvidence {
  std::int64_t point_count = 0;  // points looked at, after thinning
  std::int64_t points_used = 0;  // weight above 1/2
  int iteration_count = 0;
  double residual_rms_mm = 0;    // of the points used
  double residual_sigma_mm = 0;  // 1.4826 MAD of the points within the loss's reach
  double overlap = 0;
  double condition_number = 0;                    // rotation scaled by the part's radius of gyration
  Vector6d weakest_direction = Vector6d::Zero();  // rotation times that radius, translation; unit
  double weakest_standard_uncertainty_mm = 0;     // from noise and model error
  double noise_sigma_mm = 0;                      // of a point
  double model_sigma_mm = 0;                      // of a patch, beyond its points' noise: casting, sensor, CAD
  double patch_mm = 0;
  double correlation_widening = 1;  // of variances, because neighbouring patches err together
  double information_kept = 1;      // of what the points say along the weakest direction, by the loss
  double surface_part = 0;          // of the CAD's area that the scan covers
  double last_step_mm = 0;
  std::vector<PortionAgreement> agreements;
  std::vector<RegionResidual> regions;
  std::vector<PortionEvidence> portions;
  std::vector<DatumDistance> datums;
  std::string remark;
};

struct PoseFit {
  Outcome outcome = Outcome::kNotConverged;
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();  // a pose to use only where converged
  PoseCovariance noise_covariance;  // of noise and model error; reference: the part's centroid at zero
  // 6 x 14: change of the pose (order of PoseCovariance) per calibration parameter.
  Eigen::Matrix<double, 6, kCalibrationParameterCount> calibration_sensitivity =
      Eigen::Matrix<double, 6, kCalibrationParameterCount>::Zero();
  PoseCovariance covariance;  // noise and calibrations
  FitEvidence evidence;
};

struct FitOptions {
  double model_error_um = 0.5;  // of mapping and surface: the loss never gets narrower than this and the noise
  // Of the part about its centroid, part axes: turns about x, y, z, shifts along x, y, z. A fixed one keeps the nominal's.
  std::array<bool, 6> free = {true, true, true, true, true, true};
  std::vector<Region> regions_in;    // where points count; empty: everywhere
  std::vector<Region> regions_out;   // where they do not
  std::vector<double> scan_weights;  // by portion; empty: 1
  double greatest_start_error_mm = 15;
  bool coarse_start = false;  // look for the part first: tens of millimetres off and turned in any way (coarse_start.h)
  double least_overlap = 0.3;
  double greatest_spread_mm = 0.25;  // robust standard deviation of a blade from its CAD, beyond which it is another
  double condition_limit = 2000;
  int iteration_limit = 60;  // of the steps that follow the pose from its start
  int thread_count = 2;
  std::function<bool()> keep_going;       // false: stop with CANCELLED; asked on any thread, one at a time
  std::function<void(int)> on_iteration;  // after each: how many there were; on the caller's thread
};

// Whether a point counts; regions larger by the margin.
bool InRegions(const FitOptions& options, const Eigen::Vector3d& part_mm, double margin_mm = 0);

// INVALID_ARGUMENT: fewer points than free directions, points metres apart, a nominal pose that is not finite, no free
// direction, weights that are not positive.
absl::Status CheckInputs(const std::vector<ScanPortion>& portions, const Eigen::Isometry3d& zero_from_part,
                         const FitOptions& options);

// Errors as CheckInputs; CANCELLED: keep_going said so.
absl::StatusOr<PoseFit> FitToSurface(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const Eigen::Isometry3d& zero_from_part_nominal,
                                     const MachineCalibration& calibration, const FitOptions& options);

// From a converged best fit of the same portions. INVALID_ARGUMENT: not six points, or points or normals that are not the
// surface's. A degenerate nest is kNotDetermined, with its condition number; a datum without points is kTooLittleOverlap.
absl::StatusOr<PoseFit> FitSixPoints(const Surface& surface, const std::vector<ScanPortion>& portions,
                                     const std::vector<DatumPoint>& datums, const PoseFit& best_fit,
                                     SixPointVariant variant, const MachineCalibration& calibration,
                                     const FitOptions& options);

}  // namespace sixpoint::metrology
