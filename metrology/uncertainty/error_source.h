// The causes that make results uncertain, each by its name (docs/methods/uncertainty.md, error sources). Results that share a source
// are off together; what a source does to a value is a component of its uncertainty (GUM 5.1), and the components are the budget.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/calibration_parameters.h"

namespace sixpoint::metrology {

// One cause, as independent unit normal draws: what one standard deviation of each does. Of two results a source is the same one where
// its name is.
struct ErrorSource {
  std::string name;
  // Of its estimate; infinite where it is taken as known.
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
  Eigen::Matrix<double, kCalibrationParameterCount, Eigen::Dynamic> parameters_per_sigma;  // a column a draw
  // Of a pose that was found with these parameters (order of PoseCovariance, about its reference); as many columns.
  Eigen::Matrix<double, 6, Eigen::Dynamic> pose_per_sigma = {};
};

// Of parameters that are uncertain by a covariance. What rounding makes negative counts as 0.
ErrorSource SourceOf(const std::string& name, const CalibrationCovariance& covariance);

// Of all of them: the sum of what each contributes.
CalibrationCovariance CovarianceOf(const std::vector<ErrorSource>& sources);
Matrix6d PoseCovarianceOf(const std::vector<ErrorSource>& sources);

// What a source is for a pose that follows the parameters so.
void ActOnPose(const PoseSensitivity& sensitivity, std::vector<ErrorSource>* sources);

// A share of a value's variance, in the square of its unit.
struct UncertaintyComponent {
  std::string source;
  double variance = 0;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
};

// Welch and Satterthwaite (GUM G.4); infinite where all are known, or nothing is uncertain.
double EffectiveDegreesOfFreedom(const std::vector<UncertaintyComponent>& components);
// By what an interval of normal errors is to be widened for it: Student's quantile over the normal's and, for the distance of several
// components, Fisher's over the chi-squared's (Hotelling). 1 for infinite ones; fewer than 1 count as 1. components: 1 or more, need not be whole
// (ComponentsOf).
double WideningOf(double probability, double degrees_of_freedom, double components = 1);
// As how many equal components a distance with this covariance is spread: 1 along a line, 3 alike every way.
double ComponentsOf(const Eigen::Matrix3d& covariance);

// What a calibration says of its own noise, by its name.
ErrorSource SensorCalibrationSource(const SensorCovariance& covariance, double degrees_of_freedom,
                                    const std::string& calibration);
ErrorSource RotationCalibrationSource(const AxesCovariance& covariance, double degrees_of_freedom,
                                      const std::string& calibration);

// Common to all that a touch probe finds: the place of the scanner (found against touched features) and of both axes (found by touched
// spheres) move with it along the same coordinate.
ErrorSource TouchOffset(double standard_uncertainty_mm, const Eigen::Vector3d& a_direction,
                        const Eigen::Vector3d& b_direction);

// The scanner's field, or what is left of it (FieldCovarianceOf). A calibration was off by its response to it.
ErrorSource ScannerFieldSource(const FieldCovariance& covariance_mm2, const FieldResponse& response);

// Linear axes whose scales are off, each for itself, or that are not square to each other: of a part that is turned between scan and
// drilling only the turned share is seen (docs/methods/uncertainty.md, error sources). ratio: mm in a mm.
ErrorSource ScalesOfLinearAxes(double standard_uncertainty_ratio, const LinearResponse& response);
ErrorSource SquarenessOfLinearAxes(double standard_uncertainty_ratio, const LinearResponse& response);
// A part that is longer than it is taken for, measured by the scales, each way alike.
ErrorSource Expansion(const std::string& name, double standard_uncertainty_ratio, const LinearResponse& response);

// How far apart along X a scan forward and one backward put the same.
ErrorSource EncoderLatency(const std::string& name, double standard_uncertainty_mm);

// An arm that was swung stands elsewhere, by a spread that a study found.
ErrorSource ArmSwing(const std::string& name, const SensorCovariance& spread, double degrees_of_freedom);

}  // namespace sixpoint::metrology
