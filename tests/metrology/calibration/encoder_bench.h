// A rotary axis of known errors, read by an encoder on the axis over more than a turn and back.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

#include "metrology/calibration/axis_characterisation.h"

namespace sixpoint::testing {

// The paper's A axis: 0.012 deg once a turn, 0.003 deg every 4 deg, 0.015 deg of reversal. Angles in rad.
struct Axis {
  double mean = 0.001 * M_PI / 180, once = 0.012 * M_PI / 180, phase = 0.4, periodic = 0.003 * M_PI / 180,
         reversal = 0.015 * M_PI / 180;
  int order = 90;

  double ErrorAt(double angle_rad, metrology::Travel travel) const;
  // Of mean, reversal, then cosine and sine of the orders 1, 2, 3 and `order`: found minus true; nothing where other orders
  // were found.
  std::optional<Eigen::VectorXd> ErrorOf(const metrology::AxisCharacterisation& found) const;
  // Fisher information of a run about them, their orders known; from the linear model alone, rad.
  Eigen::MatrixXd Information(const std::vector<metrology::AxisReading>& run, double noise_rad) const;
  // Long wave's and periodic amplitude, noise, and root mean square of the error with the noise.
  Eigen::Vector4d Figures(double noise_rad) const;
};

// From -10 deg to 370 deg and back. random: null for no noise.
std::vector<metrology::AxisReading> EncoderRun(const Axis& axis, double noise_rad, std::mt19937_64* random,
                                               double step_deg = 0.5);

}  // namespace sixpoint::testing
