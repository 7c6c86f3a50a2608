// How a rotary axis positions, from an encoder run over more than a turn and back
// (docs/methods/rotary_axes.md, characterisation).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "metrology/kinematics/angle_table.h"

namespace sixpoint::metrology {

struct AxisReading {
  double commanded_rad = 0;
  double measured_rad = 0;
  Travel travel = Travel::kForward;  // towards greater angles, or smaller ones
};

// The travel of each reading from the order of the commands, for runs that do not say it: towards where it came from its
// neighbour before. INVALID_ARGUMENT where the axis never moves.
absl::StatusOr<std::vector<Travel>> TravelOf(const std::vector<double>& commanded_rad);

// A figure and its standard uncertainty.
struct Estimate {
  double value = 0;
  double standard_uncertainty = 0;
};

// cosine cos(n angle) + sine sin(n angle), n = order (per turn).
struct Harmonic {
  int order = 0;
  double cosine_rad = 0, sine_rad = 0;
};

struct PeriodicError {
  int order = 0;           // the period is a turn / order
  Estimate amplitude_rad;  // peak to peak is twice that
};

struct AxisCharacterisation {
  // The model: error = mean + sum of harmonics +- (reversal + sum of reversal harmonics) / 2, + forward.
  Estimate mean_rad;
  Estimate reversal_rad;  // mean over the turn of forward minus backward
  std::vector<Harmonic> harmonics;
  std::vector<Harmonic> reversal_harmonics;
  // Of mean, reversal, then cosine and sine of each harmonic, then of each reversal harmonic.
  Eigen::MatrixXd covariance_rad2;

  // Strongest harmonic of order 1 to 3: eccentricity and tilt of scale and bearing. Always in the model.
  PeriodicError long_wave;
  // Strongest one above: the drive's or the scale's own period. Nothing where none stands out of the noise.
  std::optional<PeriodicError> periodic;
  double least_detectable_rad = 0;  // amplitude above which a harmonic stands out of the noise

  // Greatest |error| of the model, where, and on which way.
  Estimate greatest_error_rad;
  double greatest_error_at_rad = 0;
  Travel greatest_error_travel = Travel::kForward;

  // What one position contributes to the uncertainty of a pose: without the table its error is all there; with it, the
  // table's own and the scatter about it remain.
  Estimate standard_uncertainty_rad;
  Estimate compensated_standard_uncertainty_rad;

  Estimate noise_rad;  // standard deviation of one reading about the model
  int reading_count = 0;
  // Reached minus commanded; interpolation errs by less than a hundredth of the shortest harmonic's amplitude.
  AngleTable table;
  double table_standard_uncertainty_rad = 0;  // of one value, root mean square
};

// INVALID_ARGUMENT naming the reading that is not finite, not an angle in the unit, or of unknown travel;
// FAILED_PRECONDITION for runs that do not cover a turn on both ways, or leave gaps.
absl::StatusOr<AxisCharacterisation> CharacteriseAxis(const std::vector<AxisReading>& run);

}  // namespace sixpoint::metrology
