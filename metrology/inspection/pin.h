// The axis of a calibrated pin that stands in a drilled hole, from the points that the scanner saw of it
// (docs/methods/inspection.md, pin).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Where a pin is looked for; part frame.
struct NominalPin {
  Eigen::Vector3d start_mm = Eigen::Vector3d::Zero();  // where the nominal axis meets the surface
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();     // unit, out of the part
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // outward surface normal at the start, unit
  double hole_diameter_mm = 0;
};

// What a fit must show to be a measurement.
struct PinLimits {
  int least_point_count = 60;
  double least_arc_deg = 150;            // of the circumference, in cells of 10 deg with points
  double least_height_mm = 1;            // between the lowest and highest point used
  double least_diameter_ratio = 0.5;     // fitted diameter over the hole's
  double greatest_diameter_ratio = 1.6;  // pins are wider than the drawing's hole where it was drilled wider
  double greatest_sigma_um = 10;         // robust standard deviation of the residuals
  double least_used_share = 0.6;         // of the points, after the robust loss
  // Where all points together are no pin, the largest set of them that stands this far from the others is tried: a chip or a
  // neighbour's pin is left out. 0: it is not.
  double apart_mm = 0.15;
};

// The cylinder of free radius fitted to the points: axis through origin + c1 e1 + c2 e2, along axis + s1 e1 + s2 e2,
// with (e1, e2) across the nominal axis and origin its start.
struct PinFit {
  bool measured = false;
  std::string reason;  // why not
  Eigen::Matrix<double, 3, 2> across;
  Eigen::Vector2d offset_mm = Eigen::Vector2d::Zero();  // c1, c2
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();      // s1, s2
  double radius_mm = 0;
  // Of (c1, c2, s1, s2, radius) from the scanner's noise, by the residuals themselves (sandwich estimator).
  Eigen::Matrix<double, 5, 5> noise_covariance = Eigen::Matrix<double, 5, 5>::Zero();
  int point_count = 0;
  double residual_rms_um = 0;  // of the points used
  // Change of the five parameters per displacement of a point, for the points used (indices into the points given).
  std::vector<std::size_t> used;
  std::vector<Eigen::Matrix<double, 5, 3>> gain;
};

// Points of the pin and little else: off the surface, near the nominal axis. Robust (Tukey's biweight from an algebraic
// circle); the top of the pin and what the loss rejects take no part. The pin's length and diameter need not be known.
PinFit FitPin(const NominalPin& nominal, const Points& points_in_part_mm, const PinLimits& limits = {});

}  // namespace sixpoint::metrology
