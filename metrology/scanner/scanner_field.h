// What a sensor's readings are off by, smoothly over its measuring field (docs/methods/uncertainty.md, error sources).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/calibration_parameters.h"

namespace sixpoint::metrology {

// Legendre's products up to the sixth order, without the constant: the field parameters' own, of the third, and what lies beyond.
inline constexpr int kFieldSeriesOrder = 6, kFieldSeriesCount = 27;
using FieldSeries = Eigen::Matrix<double, 1, kFieldSeriesCount>;

// The measuring field about the sensor frame's origin; none by default, and then no reading is off. Of a snapshot it lies along x and y.
struct ScannerField {
  double half_width_mm = 0;  // along y
  double half_range_mm = 0;  // along z

  // Of optics as a data sheet has them: as wide as the line is where it is longest.
  static ScannerField Of(double mid_range_mm, double range_mm, double line_angle_rad);
  // As wide as the view is where it is widest, both ways.
  static ScannerField OfSnapshot(double mid_range_mm, double range_mm, double view_angle_rad);

  // How far a reading at (y, z) is off along z per field parameter, in the order of kFieldParameters. Over the field each term's mean
  // square is 1, and the terms are orthogonal; a reading beyond it counts as one on its border.
  Eigen::Matrix<double, 1, kFieldParameterCount> TermsAt(double y_mm, double z_mm) const;
  // The same and on to kFieldSeriesOrder.
  FieldSeries SeriesAt(double y_mm, double z_mm) const;
};

// A field as a calibration found it.
struct MeasuredField {
  FieldTerms terms_mm = FieldTerms::Zero();
  FieldCovariance covariance_mm2 = NotYet<FieldCovariance>();
  double stated_mm = 0;  // root mean square that was stated of it before
};

// Of what is left of a field once the measured one is taken off: measured, and wider in proportion where more is stated by now than
// when it was. Where none was measured the stated root mean square is shared among the terms, low orders having more.
FieldCovariance FieldCovarianceOf(double stated_mm, const std::optional<MeasuredField>& measured);

}  // namespace sixpoint::metrology
