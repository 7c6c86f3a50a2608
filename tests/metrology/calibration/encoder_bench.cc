#include "tests/metrology/calibration/encoder_bench.h"

#include <cmath>

namespace sixpoint::testing {

using metrology::AxisReading;
using metrology::Travel;

double Axis::ErrorAt(double angle, Travel travel) const {
  return mean + once * std::sin(angle + phase) + periodic * std::cos(order * angle - phase) +
         (travel == Travel::kForward ? reversal : -reversal) / 2;
}

std::optional<Eigen::VectorXd> Axis::ErrorOf(const metrology::AxisCharacterisation& axis) const {
  const int orders[4] = {1, 2, 3, order};
  Eigen::VectorXd error(10);
  error << axis.mean_rad.value - mean, axis.reversal_rad.value - reversal, Eigen::VectorXd::Zero(8);
  if (axis.harmonics.size() < 4) return std::nullopt;
  for (int k = 0; k < 4; ++k) {
    const metrology::Harmonic& h = axis.harmonics[static_cast<std::size_t>(k)];
    if (h.order != orders[k]) return std::nullopt;
    error(2 + 2 * k) = h.cosine_rad;
    error(3 + 2 * k) = h.sine_rad;
  }
  error.segment<2>(2) -= once * Eigen::Vector2d(std::sin(phase), std::cos(phase));
  error.segment<2>(8) -= periodic * Eigen::Vector2d(std::cos(phase), std::sin(phase));
  return error;
}

Eigen::MatrixXd Axis::Information(const std::vector<AxisReading>& run, double noise_rad) const {
  const int orders[4] = {1, 2, 3, order};
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(10, 10);
  for (const AxisReading& r : run) {
    Eigen::VectorXd row(10);
    row << 1, (r.travel == Travel::kForward ? 0.5 : -0.5), Eigen::VectorXd::Zero(8);
    for (int k = 0; k < 4; ++k) {
      row(2 + 2 * k) = std::cos(orders[k] * r.commanded_rad);
      row(3 + 2 * k) = std::sin(orders[k] * r.commanded_rad);
    }
    information += row * row.transpose() / (noise_rad * noise_rad);
  }
  return information;
}

Eigen::Vector4d Axis::Figures(double noise_rad) const {
  return {once, periodic, noise_rad,
          std::sqrt(mean * mean + reversal * reversal / 4 + once * once / 2 + periodic * periodic / 2 +
                    noise_rad * noise_rad)};
}

std::vector<AxisReading> EncoderRun(const Axis& axis, double noise_rad, std::mt19937_64* random, double step_deg) {
  constexpr double kDegree = M_PI / 180;
  std::normal_distribution<double> noise(0, 1);
  std::vector<AxisReading> run;
  const int count = static_cast<int>(std::lround(380 / step_deg));
  for (const Travel travel : {Travel::kForward, Travel::kBackward})
    for (int i = 0; i <= count; ++i) {
      const double angle = (-10 + step_deg * (travel == Travel::kForward ? i : count - i)) * kDegree;
      const double error = axis.ErrorAt(angle, travel) + (random == nullptr ? 0 : noise_rad * noise(*random));
      run.push_back({angle, angle + error, travel});
    }
  return run;
}

}  // namespace sixpoint::testing
