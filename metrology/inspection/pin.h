// The axis of a calibrated pin that stands in a drilled hole, from the points that the scanner saw of it
// (docs/methods/inspection.md, pin).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// A calibrated pin, as its certificate has it, and how it stands in its hole.
struct GaugePin {
  double diameter_mm = 0;
  double diameter_standard_uncertainty_mm = 0;
  double greatest_play_mm = 0;                          // across the hole as drilled
  std::optional<double> least_depth_mm = std::nullopt;  // in the hole; none: the hole's
};

// How pins stand in their holes where that is known as a spread instead of as the greatest play: each way across.
struct PinStanding {
  double clearance_standard_uncertainty_mm = 0;  // of the pin's axis from the hole's, at the surface
  double tilt_standard_uncertainty_rad = 0;
};

// Where a pin is looked for; part frame.
struct NominalPin {
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();  // where the nominal axis meets the surface
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     // unit, out of the part
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // outward surface normal at the start, unit
  double hole_diameter_mm = 0;
  double hole_depth_mm = 0;                            // > 0
  std::optional<GaugePin> gauge = std::nullopt;        // none: any pin that goes into the hole
  std::optional<PinStanding> standing = std::nullopt;  // stated: instead of the play
};

// What a fit must show to be a measurement.
struct PinLimits {
  int least_point_count = 60;
  double least_arc_deg = 150;                   // of the circumference, in cells of 10 deg with points
  double least_height_mm = 1;                   // between the lowest and highest point used
  double least_diameter_ratio = 0.5;            // fitted diameter over the hole's
  double greatest_diameter_ratio = 1.6;         // pins are wider than the drawing's hole where it was drilled wider
  double greatest_diameter_difference_um = 10;  // of the fitted diameter from a gauge pin's, beside both uncertainties
  double greatest_sigma_um = 10;                // robust standard deviation of the residuals
  double least_used_share = 0.6;                // of the points, after the robust loss
  // Where all points together are no pin, the largest set of them that stands this far from the others is tried: a chip or a
  // neighbour's pin is left out. 0: it is not.
  double apart_mm = 0.15;
  int held_step_count = 0;  // so many more of the fit's steps, the residuals' scale held, where it has not settled
};

// What the fit leaves of a point that it used.
struct PinResidual {
  double residual_mm = 0;                                     // positive outward
  double around_rad = 0;                                      // of the axis, from e1 (PinFit)
  double height_mm = 0;                                       // along the nominal axis, above the nominal start
  Eigen::Vector3d outward_in_part = Eigen::Vector3d::Zero();  // unit, from the axis to the point
};

// The cylinder of free radius fitted to the points: axis through origin + c1 e1 + c2 e2, along axis + s1 e1 + s2 e2,
// with (e1, e2) across the nominal axis and origin its start.
struct PinFit {
  bool measured = false;
  std::string reason;  // why not
  Eigen::Matrix<double, 3, 2> across;
  Eigen::Vector2d offset_mm = Eigen::Vector2d::Zero();  // c1, c2
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();      // s1, s2
  double radius_mm = 0;                                 // as seen, as residual_rms_um is, whatever a certificate says
  // Of (c1, c2, s1, s2, radius) from the scanner's noise, by the residuals themselves (sandwich estimator).
  Eigen::Matrix<double, 5, 5> noise_covariance = NotYet<Eigen::Matrix<double, 5, 5>>();
  int point_count = 0;
  double residual_rms_um = 0;  // of the points used
  // Change of the five parameters per displacement of a point, for the points used (indices into the points given).
  std::vector<std::size_t> used;
  std::vector<Eigen::Matrix<double, 5, 3>> gain;
  std::vector<PinResidual> residuals;  // of the points used, as seen
  // Of the radius as seen: its variance from noise, and by what part of its own changes per displacement it is in `gain`, where a
  // certificate's diameter has taken the rest.
  double seen_radius_variance_mm2 = 0, radius_kept = 1;
};

// A fit's reason; format: printf's, of what was found and what is wanted.
std::string ReasonText(const char* format, double found, double wanted);

// Points of the pin and little else: off the surface, near the nominal axis. Robust (Tukey's biweight from an algebraic
// circle); the top of the pin and what the loss rejects take no part. The pin's length need not be known, nor its diameter; a gauge
// pin's takes part with its uncertainty, and what is seen with another diameter is not that pin.
PinFit FitPin(const NominalPin& nominal, const Points& points_in_part_mm, const PinLimits& limits = {});

// How far a pin's axis may stand from its hole's.
struct PinPlay {
  // At the surface and at the pin's foot: by the part's record, else what the drawing's diameter leaves.
  double half_mm = 0;
  double depth_mm = 0;  // of the foot
  // Where the part's record states no play: if the hole was drilled as wide as any is (PinLimits::greatest_diameter_ratio). Else 0.
  double unstated_half_mm = 0;
  PinStanding standing = {};  // where that is stated: instead of all play
};
PinPlay PlayOf(const NominalPin& nominal, const PinFit& fit, const PinLimits& limits = {});
// Of (c1, c2, s1, s2, radius) about the hole's axis: either end of the pin touches the hole somewhere.
Eigen::Matrix<double, 5, 5> PlayCovariance(const PinPlay& play);

}  // namespace sixpoint::metrology
