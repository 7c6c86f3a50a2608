// Where the part stands: its pose at A = B = 0 from scans of its surface (METHODS 5).
//
// Best fit: robust point-to-surface least squares (Tukey's biweight), Gauss-Newton on the pose's tangent space, the loss
// annealed from the nominal pose's error down to the scanner's noise. Local: the same on a scan of one region. Six-point:
// from a best fit, each datum's distance along its normal out of a local robust quadratic fit of the scan's deviation
// there; then, once, the CAD is fitted to those six points alone: least squares over the six pairs (the paper's), or the
// one pose that takes all six distances to zero (a 3-2-1 nest; it multiplies every local error by the nest's condition).
//
// Same inputs give the same bits on any number of threads. Thread-safe.
#pragma once

#include <absl/status/statusor.h>

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
  double weakest_standard_uncertainty_mm = 0;     // from the scanner's noise
  std::vector<PortionEvidence> portions;
  std::vector<DatumDistance> datums;
  std::string remark;
};

struct PoseFit {
  Outcome outcome = Outcome::kNotConverged;
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();  // a pose to use only where converged
  PoseCovariance noise_covariance;                                   // reference: the part's centroid at zero
  // 6 x 14: change of the pose (order of PoseCovariance) per calibration parameter.
  Eigen::Matrix<double, 6, kCalibrationParameterCount> calibration_sensitivity =
      Eigen::Matrix<double, 6, kCalibrationParameterCount>::Zero();
  PoseCovariance covariance;  // noise and calibrations
  FitEvidence evidence;
};

struct FitOptions {
  double model_error_um = 0.5;  // of mapping and surface: the loss never gets narrower than this and the noise
  double greatest_start_error_mm = 15;
  double least_overlap = 0.3;
  double greatest_spread_mm = 0.25;  // robust standard deviation of a blade from its CAD, beyond which it is another
  double condition_limit = 2000;
  int iteration_limit = 150;
  int thread_count = 2;
  std::function<bool()> keep_going;  // false: stop with CANCELLED
};

// INVALID_ARGUMENT: fewer points than 6, a nominal pose that is not finite. CANCELLED: keep_going said so.
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
