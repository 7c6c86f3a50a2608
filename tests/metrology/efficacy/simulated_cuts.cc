#include "tests/metrology/efficacy/simulated_cuts.h"

#include <array>
#include <cmath>
#include <random>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

// A and B of the hole groups.
constexpr std::array<std::array<double, 2>, 4> kGroups = {{{0, 55}, {20, -30}, {-15, 80}, {40, 10}}};

struct Draws {
  explicit Draws(std::uint64_t seed) : random(seed) {}
  double Normal() { return normal(random); }
  double Uniform() { return uniform(random); }
  // Of unit variance.
  double HeavyTailed() { return student(random) / std::sqrt(2.0); }
  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::student_t_distribution<double> student{4};
};

// What is the same on every blade.
struct Hole {
  std::string name;
  double a_rad = 0, b_rad = 0;
  Eigen::Vector3d start_in_part_mm, own_mm = Eigen::Vector3d::Zero();
  double noise = 1;
};

std::vector<Hole> HolesOf(const CutWorld& world, Draws* draws) {
  std::vector<Hole> holes;
  for (std::size_t g = 0; g < kGroups.size(); ++g)
    for (int h = 0; h < world.holes_a_group; ++h) {
      Hole& hole = holes.emplace_back();
      hole.name = "G" + std::to_string(g + 1) + "/H" + std::to_string(h + 1);
      hole.a_rad = kGroups[g][0] * kRadPerDeg;
      hole.b_rad = kGroups[g][1] * kRadPerDeg;
      hole.start_in_part_mm = {40 * draws->Uniform() - 20, 20 * draws->Uniform() - 10, 80 * draws->Uniform()};
      if (!world.harsh) continue;
      hole.noise = 0.5 + 1.5 * draws->Uniform();
      hole.own_mm = {0.004 * draws->Normal(), 0.004 * draws->Normal(), 0};
    }
  return holes;
}

Eigen::Isometry3d Clamped(Draws* draws) {
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();
  zero_from_part.translation() =
      Eigen::Vector3d(30, -5, -40) + 0.3 * Eigen::Vector3d(draws->Normal(), draws->Normal(), draws->Normal());
  zero_from_part.linear() = (Eigen::AngleAxisd(0.3 + 0.01 * draws->Normal(), Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(0.01 * draws->Normal(), Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
  return zero_from_part;
}

}  // namespace

std::vector<BladeOutcome> Cut(const CutWorld& world, std::uint64_t seed) {
  Draws draws(seed);
  const RotaryAxes axes;
  const std::vector<Hole> holes = HolesOf(world, &draws);
  std::vector<BladeOutcome> blades;
  for (int i = 0; i < world.blade_count; ++i) {
    BladeOutcome& blade = blades.emplace_back();
    blade.blade = "SN-" + std::to_string(i + 1);
    blade.time_days = i;
    const Eigen::Isometry3d zero_from_part = Clamped(&draws);
    const auto of_blade = [&] { return world.harsh ? draws.HeavyTailed() : draws.Normal(); };
    const Eigen::Vector3d blade_mm = world.blade_mm * Eigen::Vector3d(of_blade(), of_blade(), of_blade()) +
                                     Eigen::Vector3d(world.drift_mm_a_day * i, 0, 0);
    const Eigen::Vector2d blade_rad = world.blade_rad * Eigen::Vector2d(of_blade(), of_blade());
    const bool few = world.harsh && draws.Uniform() < 0.3;
    for (const Hole& hole : holes) {
      const double wild = world.harsh && draws.Uniform() < 0.025 ? 6 : 1;
      const double noise_mm = world.hole_mm * hole.noise * wild, noise_rad = world.hole_rad * hole.noise * wild;
      const Eigen::Vector3d noise = noise_mm * Eigen::Vector3d(draws.Normal(), draws.Normal(), draws.Normal());
      const Eigen::Vector2d tilt = blade_rad + noise_rad * Eigen::Vector2d(draws.Normal(), draws.Normal());
      if (world.harsh && draws.Uniform() < 1.0 / 7) continue;
      if (few && hole.name[1] == '4') continue;
      HoleOutcome& outcome = blade.holes.emplace_back();
      outcome.hole = hole.name;
      outcome.a_rad = hole.a_rad;
      outcome.b_rad = hole.b_rad;
      const Eigen::Isometry3d predicted = axes.MachineFromZero(hole.a_rad, hole.b_rad) * zero_from_part;
      const Eigen::Isometry3d reached =
          axes.MachineFromZero(hole.a_rad + world.a_zero_rad, hole.b_rad + world.b_zero_rad) * zero_from_part;
      const Eigen::Vector3d tool = predicted * hole.start_in_part_mm + world.offset_mm + blade_mm + hole.own_mm + noise;
      const Eigen::Vector3d tool_axis = Eigen::Vector3d(tilt[0], tilt[1], 1).normalized();
      const Eigen::Isometry3d& other = world.part_from_other;
      outcome.zero_from_part = zero_from_part * other;
      outcome.predicted_start_mm = other.inverse() * hole.start_in_part_mm;
      outcome.predicted_axis = other.linear().transpose() * (predicted.linear().transpose() * Eigen::Vector3d::UnitZ());
      outcome.found_axis = other.linear().transpose() * (reached.linear().transpose() * tool_axis);
      // Where the axis pierces the surface: anywhere along it.
      outcome.found_start_mm =
          other.inverse() * (reached.inverse() * tool) + 0.02 * draws.Normal() * outcome.found_axis;
      outcome.position_standard_uncertainty_mm = 0.006;
      outcome.inclination_standard_uncertainty_rad = 1e-3;
    }
    if (blade.holes.empty()) blades.pop_back();
  }
  return blades;
}

}  // namespace sixpoint::metrology
