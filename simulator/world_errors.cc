#include "simulator/world_errors.h"

#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {
namespace {

using metrology::kPi;
using metrology::kRadPerDeg;

// Anywhere within a circle, of that standard deviation a component.
Eigen::Vector2d InCircle(double standard, Random* random) {
  const double turn = random->Uniform(0, 2 * kPi), radius = 2 * standard * std::sqrt(random->Uniform());
  return radius * Eigen::Vector2d(std::cos(turn), std::sin(turn));
}

}  // namespace

ScannerField::ScannerField(double standard_um, Random random) : standard_um_(standard_um) {
  constexpr int kWaves = 12;
  for (int i = 0; i < kWaves; ++i) {
    const double along = random.Uniform(0, 2 * kPi), per_mm = 2 * kPi / random.Uniform(30, 60);
    const double phase = random.Uniform(0, 2 * kPi);
    const double height_mm = 1e-3 * standard_um * std::sqrt(2.0 / kWaves) * random.Gaussian();
    waves_.push_back({per_mm * std::cos(along), per_mm * std::sin(along), phase, height_mm});
  }
}

double ScannerField::At_mm(double y_mm, double z_mm) const {
  double off_mm = 0;
  for (const Wave& wave : waves_)
    off_mm += wave.height_mm * std::cos(wave.per_y * y_mm + wave.per_z * z_mm + wave.phase);
  return off_mm;
}

Speckle::Speckle(const SpeckleDesign& design, double pitch_mm, std::size_t profiles, int columns, Random random)
    : columns_(static_cast<std::size_t>(columns)), values_mm_(profiles * static_cast<std::size_t>(columns)) {
  const double stays = std::exp(-pitch_mm / design.length_mm), fresh = std::sqrt(1 - stays * stays);
  const auto shared = static_cast<std::size_t>(design.columns);
  const double unit_mm = 1e-3 * design.standard_um / std::sqrt(static_cast<double>(shared));
  std::vector<double> grains(columns_ + shared);
  for (std::size_t profile = 0; profile < profiles; ++profile) {
    // Grains of their own size; a column sees as many of them as it has neighbours to share with.
    for (double& grain : grains) grain = profile == 0 ? random.Gaussian() : stays * grain + fresh * random.Gaussian();
    for (std::size_t column = 0; column < columns_; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < shared; ++k) sum += grains[column + k];
      values_mm_[profile * columns_ + column] = unit_mm * sum;
    }
  }
}

AxisError AxisError::Draw(double greatest_reversal_deg, Random random) {
  AxisError axis;
  const auto phase = [&] { return random.Uniform(0, 2 * kPi); };
  axis.reversal_deg = random.Uniform(0.3, 1) * greatest_reversal_deg;
  axis.reversal_share = random.Uniform(0, 0.3);
  axis.reversal_phase_rad = phase();
  axis.worm_deg = random.Uniform(0.001, 0.003);
  constexpr int kTeeth[] = {72, 90, 120};
  axis.worm_teeth = kTeeth[random.Next() % 3];
  axis.worm_phase_rad = phase();
  axis.once_deg = random.Uniform(0.002, 0.008);
  axis.once_phase_rad = phase();
  axis.twice_deg = random.Uniform(0, 0.003);
  axis.twice_phase_rad = phase();
  axis.repeat_deg = random.Uniform(0.0002, 0.0005);
  return axis;
}

double AxisError::At_deg(double command_deg, bool upwards) const {
  const double angle = command_deg * kRadPerDeg;
  const double reversal = reversal_deg * (1 + reversal_share * std::cos(angle + reversal_phase_rad));
  const double tooth = worm_teeth * angle + worm_phase_rad;
  return (upwards ? 0.5 : -0.5) * reversal + worm_deg * (std::cos(tooth) + std::cos(2 * tooth) / 3) +
         once_deg * std::cos(angle + once_phase_rad) + twice_deg * std::cos(2 * angle + twice_phase_rad);
}

EncoderRun RunAxis(const AxisError& axis, double encoder_noise_deg, Random random) {
  EncoderRun run;
  constexpr int kSteps = 760;
  const auto read = [&](int step, int direction) {
    const double command_deg = -10 + 0.5 * step;
    run.commanded_deg.push_back(command_deg);
    run.direction.push_back(direction);
    const double scatter_deg = std::hypot(axis.repeat_deg, encoder_noise_deg) * random.Gaussian();
    run.error_deg.push_back(axis.At_deg(command_deg, direction > 0) + scatter_deg);
  };
  for (int step = 0; step <= kSteps; ++step) read(step, 1);
  for (int step = kSteps; step >= 0; --step) read(step, -1);
  return run;
}

ArmPlay ArmPlay::Draw(Random random) {
  ArmPlay play;
  for (int k = 0; k < 3; ++k) play.shift_um[k] = random.Uniform(1.5, 4);
  for (int k = 0; k < 2; ++k) play.turn_deg[k] = random.Uniform(0.0015, 0.004);
  play.turn_deg[2] = random.Uniform(0.004, 0.01);
  return play;
}

metrology::Vector6d ArmPlay::Swing(Random random) const {
  metrology::Vector6d swing;
  const Eigen::Vector3d turn = random.GaussianVector(), shift = random.GaussianVector();
  swing << kRadPerDeg * turn_deg.cwiseProduct(turn), 1e-3 * shift_um.cwiseProduct(shift);
  return swing;
}

Warmth Warmth::Draw(Random random) {
  Warmth warmth;
  warmth.is_measured = random.Uniform() < 0.5;
  warmth.part_c = 20 + random.Uniform(-warmth.half_range_k, warmth.half_range_k);
  warmth.scales_c = 20 + random.Uniform(-warmth.half_range_k, warmth.half_range_k);
  warmth.part_um_per_m_k = warmth.part_stated_um_per_m_k + warmth.coefficient_standard_um_per_m_k * random.Gaussian();
  warmth.scales_um_per_m_k =
      warmth.scales_stated_um_per_m_k + warmth.coefficient_standard_um_per_m_k * random.Gaussian();
  warmth.part_read_c = warmth.part_c + warmth.thermometer_k * random.Gaussian();
  warmth.scales_read_c = warmth.scales_c + warmth.thermometer_k * random.Gaussian();
  return warmth;
}

Eigen::Vector2d PinPlay::Off_mm(Random* random) const { return InCircle(1e-3 * clearance_um, random); }
Eigen::Vector2d PinPlay::Tilt_rad(Random* random) const { return InCircle(tilt_deg * kRadPerDeg, random); }

SmoothForm::SmoothForm(Random random) {
  constexpr int kWaves = 40;
  for (int i = 0; i < kWaves; ++i) {
    // A wave of length l has fallen to 0.6 after l / 6.8: lengths of 34 to 136 mm fade over 5 to 20.
    const double length_mm = 34 * std::pow(4.0, random.Uniform());
    const Eigen::Vector3d way = random.GaussianVector().normalized(), sides = random.GaussianVector();
    const double phase = random.Uniform(0, 2 * kPi);
    waves_.push_back({2 * kPi / length_mm * way, sides, phase, std::sqrt(2.0 / kWaves) * random.Gaussian()});
  }
}

double SmoothForm::At(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& normal) const {
  double sum = 0;
  for (const Wave& wave : waves_)
    sum += wave.height * std::cos(wave.per_mm.dot(point_mm) + wave.per_normal.dot(normal) + wave.phase);
  return sum;
}

WorldErrors DrawErrors(std::uint64_t seed, const std::set<std::string>& without) {
  WorldErrors errors;
  // A stream for each name: what is left out changes nothing of the others.
  std::uint64_t stream = 0;
  for (const std::string& name : kErrorNames) {
    Random random(Random::StreamSeed(seed, stream++));
    const auto own = [&] { return Random(random.Next()); };
    if (without.count(name) > 0) continue;
    if (name == "noise") errors.noise_um = random.Uniform(1.5, 3);
    if (name == "field") {
      const double standard_um = random.Uniform(1, 3);
      errors.field.emplace(standard_um, own());
    }
    if (name == "speckle") {
      errors.speckle.emplace();
      errors.speckle->standard_um = random.Uniform(0.5, 1.5);
      errors.speckle->columns = 3 + static_cast<int>(random.Next() % 3);
      errors.speckle->length_mm = random.Uniform(0.2, 0.4);
    }
    if (name == "ghosts") errors.ghosts.emplace();
    if (name == "axes") {
      errors.a_axis = AxisError::Draw(0.02, own());
      errors.b_axis = AxisError::Draw(0.01, own());
    }
    if (name == "arm") errors.arm = ArmPlay::Draw(own());
    if (name == "touch") {
      errors.touch_standard_um = random.Uniform(0.4, 0.9);
      errors.touch_off_mm = 1e-3 * errors.touch_standard_um * random.GaussianVector();
    }
    if (name == "temperature") errors.warmth = Warmth::Draw(own());
    if (name == "pins") {
      errors.pins.emplace();
      errors.pins->clearance_um = random.Uniform(1, 3);
      errors.pins->tilt_deg = random.Uniform(0.015, 0.04);
    }
    if (name == "latency") {
      errors.latency.emplace();
      errors.latency->standard_um = random.Uniform(1, 2);
      errors.latency->backward_um = errors.latency->standard_um * random.Gaussian();
    }
    if (name == "form") errors.form_um = random.Uniform(0.4, 1.2);
    if (name == "neighbour") errors.neighbour = true;
  }
  return errors;
}

}  // namespace sixpoint::simulator
