// Random near-net-shape blanks of plant-a's vane: twisted, bent, wavy and dented as a whole, short at both edges, with stock at the tip; and the
// bands that each case states.
#pragma once

#include <memory>
#include <string>

#include "metrology/reconstruction/reconstruct_shape.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::bench {

inline constexpr double kPatchNoise_mm = 3e-4;  // of a patch's mean

struct BladeCase {
  testing::BlankOf blank;
  std::vector<metrology::ShapeRegion> regions;
  double lacking_mm = 0;  // along the chord, at the worse edge
  Eigen::Vector3d piece_low_mm,
      piece_high_mm;  // about where that edge lacks most, with some of the fixed surface beside it
};

// Null without the file.
std::shared_ptr<const metrology::Surface> LoadVane(const std::string& step_file);
BladeCase RandomCase(const metrology::Surface& vane, std::uint64_t seed);
metrology::ReconstructionOptions BladeOptions();

}  // namespace sixpoint::bench
