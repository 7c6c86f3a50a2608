// A point laser probe on a machine's spindle, from readings on the faces of a block that a touch probe located
// (docs/methods/probe.md; Smith, Zheng 2000).
//
//   p = position + t + gamma a       position: machine position of a reading; gamma: displacement the probe shows
//
// a = scale * beam direction (away from the probe), t = offset of gamma = 0 on the beam. The probe turns with nothing:
// the rotary axes stand still over all readings. A face is n . p = d. With gamma as read, n . (position + t + gamma a) = d
// is linear in h = (a, t): the paper's solution. Noise of gamma there multiplies a, so a comes out short. The weighted fit
// takes gamma as what is observed, gamma = (d - n . (position + t)) / (n . a) + noise, together with the touched points of
// the faces, whose planes are fitted along: every noise where it arises, hence the Cramer-Rao bound.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// One face of the block.
struct ProbedFace {
  std::string face;
  Eigen::Vector3d nominal_normal = Eigen::Vector3d::Zero();  // outward, in the block's own frame, from its drawing
  std::vector<Eigen::Vector3d> touched_mm;                   // machine frame
};

struct ProbeReading {
  std::string face;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // of the spindle, machine frame
  double displacement_mm = 0;
};

struct ProbeOptions {
  double noise_mm = 0;                                // of one displacement, > 0
  double touch_uncertainty_mm = kTouchUncertaintyMm;  // of one touched point along the face's normal, > 0
  double position_uncertainty_mm = 0;  // of one coordinate of a position, independent from reading to reading
  double least_displacement_mm = 0, greatest_displacement_mm = 0;  // the probe's measuring range
  double greatest_approach_angle_rad = M_PI / 2;  // between a face's normal and the beam, of the probe's data sheet
};

// The moved block, face by face: plane through the probe's points against plane through the touched points.
struct ProbeFaceCheck {
  std::string face;
  double angle_rad = 0;
  double origin_distance_mm = 0;  // touch minus probe, of the planes' distances from the machine's origin (the paper's)
  double distance_mm = 0;         // the same at the middle of the touched points
  double residual_range_mm = 0;   // of the probe's points about their own plane
  int reading_count = 0;
};

struct ProbeCalibration {
  Eigen::Vector3d approach = Eigen::Vector3d::Zero();   // a
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();  // t
  Matrix6d covariance = NotYet<Matrix6d>();             // of (a, t): 1, mm
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // a / |a|
  double scale = 0;                                     // |a|
  double scale_standard_uncertainty = 0;
  double direction_standard_uncertainty_rad = 0;  // of the worst direction across the beam
  // Of a point measured at mid range, from the calibration alone; machine frame.
  Eigen::Vector3d point_standard_uncertainty_mm = Eigen::Vector3d::Zero();
  double noise_factor = 1;      // > 1: the residuals are clearly worse than stated, and the covariance follows them
  double residual_rms_mm = 0;   // of displacements
  double touch_rms_mm = 0;      // of touched points about their faces
  double condition_number = 0;  // of the design: faces exact, displacements about mid range in half ranges
  double paper_condition_number = 0;  // kappa(G), G in h = (a, t) of 1 and mm, as the paper prints it
  double worst_approach_angle_rad = 0;
  int iterations = 0;
  bool converged = false;
  std::vector<double> residuals_mm;  // displacement read minus expected, of each reading in its order
};

// The paper's: equation (5), solved by QR on planes that the touched points fit. Covariance by propagation of the same
// noise through the linear solution.
// The weighted one. Both:
// INVALID_ARGUMENT "field: value, want ..." for numbers that are not finite, beyond the probe's range, of a face that is
// not there, or that only other units or another block explain. FAILED_PRECONDITION naming the parameter that the
// readings do not determine and what would. No threads inside: the same readings give the same bits.
absl::StatusOr<ProbeCalibration> CalibrateProbeLinearly(const std::vector<ProbedFace>& faces,
                                                        const std::vector<ProbeReading>& readings,
                                                        const ProbeOptions& options);
absl::StatusOr<ProbeCalibration> CalibrateProbe(const std::vector<ProbedFace>& faces,
                                                const std::vector<ProbeReading>& readings, const ProbeOptions& options);

// The paper's section 9: the block moved, touched and measured again. At least three readings on each face, spread.
absl::StatusOr<std::vector<ProbeFaceCheck>> CheckProbe(const ProbeCalibration& probe,
                                                       const std::vector<ProbedFace>& moved_faces,
                                                       const std::vector<ProbeReading>& moved_readings,
                                                       const ProbeOptions& options);

}  // namespace sixpoint::metrology
