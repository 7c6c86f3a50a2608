// The scanner's field as scans of a touched artefact show it (docs/methods/sensor_calibration.md, field of the scanner).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/scanner/scanner_field.h"

namespace sixpoint::metrology {

// What a lapped plate is usually flat to, root mean square, where its record does not say.
inline constexpr double kFlatnessMm = 5e-4;

// Legendre's products of the place on the artefact's upper face, of the second to the sixth order: lower ones are its pose.
inline constexpr int kFlatnessTermCount = 25;
using FlatnessTerms = Eigen::Matrix<double, 1, kFlatnessTermCount>;
// at: -1 to 1 over the face, along its x and y; each term's mean square over it is 1.
FlatnessTerms FlatnessTermsAt(const Eigen::Vector2d& at);

// What a calibration that knows no field leaves over, row by row.
struct FieldResidual {
  double off_mm = 0;
  FieldSeries by_field =
      FieldSeries::Zero();  // change of off_mm per term of the series, the calibration's response to it included
  FlatnessTerms by_flatness = FlatnessTerms::Zero();
  double variance_mm2 = 0;
  bool is_laser = false;  // a mean reading of a place of the measuring field; else a touched coordinate
};

// Bayes' estimate: the field's nine terms have FieldCovarianceOf's prior, the orders beyond one that goes with how great the nine are
// found to be, the flatness a smooth face's. What none of them explains of laser readings counts as noise of the places. Of what the residuals
// do not tell (what bends between two heights) the prior stays. What the orders beyond are found to be, and may still be, is added to the
// nine terms' covariance.
MeasuredField EstimateField(const std::vector<FieldResidual>& residuals, double stated_mm, double flatness_mm);

}  // namespace sixpoint::metrology
