// A probing system on a calibrated sphere and on length standards, in the manner of ISO 10360-5 and -8.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/studies/study_verdict.h"

namespace sixpoint::metrology {

struct MeasuredLength {
  std::string standard;
  double calibrated_mm = 0;
  double calibrated_standard_uncertainty_mm = 0;
  double measured_mm = 0;
};

struct SphereCheckOptions {
  double diameter_mm = 0;  // calibrated
  double diameter_standard_uncertainty_mm = 0;
  double sphere_form_mm = 0;  // of the calibrated sphere itself
  // Greatest permitted errors; 0: none stated.
  double form_mpe_mm = 0, size_mpe_mm = 0;
  // MPE = A + L / K as the standards write it: A in length_mpe_mm, L in mm and L / K in um; K 0: no part that grows.
  double length_mpe_mm = 0, length_mpe_divisor = 0;
  int least_points = 25;
  // Of a scanner (ISO 10360-8): thousands of points. Form and size are of 25 representative ones, each the mean of its place on what is seen
  // of the sphere; beside them the size of all and what 95 % of all scatter by.
  bool optical = false;
  double dispersion_mpe_mm = 0;  // 0: none stated
  // Of a flat standard, and its own flatness; empty: none was measured.
  Points plane_points_mm = {};
  double plane_form_mm = 0, flat_form_mpe_mm = 0;
};

struct CheckedError {
  std::string quantity;  // "form", "size", "dispersion", "size of all points", "flat form", or the standard's name
  double error_mm = 0;
  double standard_uncertainty_mm = 0;  // of the test (ISO/TS 23165)
  double mpe_mm = 0;                   // 0: none stated
  StudyVerdict verdict = StudyVerdict::kReported;
};

struct SphereCheck {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d centre_covariance_mm2 = NotYet<Eigen::Matrix3d>();
  double diameter_mm = 0;
  double diameter_standard_uncertainty_mm = 0;  // of the fit
  double standard_deviation_mm = 0;             // of a probed point about the sphere
  std::vector<CheckedError> errors;
  StudyVerdict verdict = StudyVerdict::kReported;  // the worst of them
};

// Form: range of the radial distances from the least-squares sphere; size: its diameter less the calibrated one; each length
// less its calibrated one. Dispersion: the thinnest shell about the least-squares sphere's centre that holds 95 % of the points; flat form: the
// least distance of two planes, parallel to the least-squares one, that 95 % of its points lie between. INVALID_ARGUMENT for too few points, values that are not finite, or a sphere or length so far from
// its calibrated value (10 %) that it is of another unit; FAILED_PRECONDITION where the points do not determine the sphere.
absl::StatusOr<SphereCheck> CheckSphere(const Points& points_mm, const std::vector<MeasuredLength>& lengths,
                                        const SphereCheckOptions& options);

}  // namespace sixpoint::metrology
