// One random blade of `bench/run repair`: scanned, extrapolated by each method, and held against its own undamaged tip.
#pragma once

#include <vector>

#include "bench/repair/repair_world.h"
#include "metrology/repair/extrapolation.h"

namespace sixpoint::bench {

inline constexpr double kMostKept = 0.9;  // of the span

// The part as it is drawn, prepared once: its sections at all heights that blades are cut to.
struct DrawnBlade {
  NominalBlade nominal;
  metrology::StackOptions options;  // with the greatest cut-off
  std::vector<metrology::BladeSection> sections;
};
DrawnBlade DrawBlade(const NominalBlade& nominal, int thread_count);
// Highest section that stays of a blade which keeps a part of its span.
std::size_t KeptSections(const DrawnBlade& drawn, double part_of_span);

// The drawn section of a measured one's height.
const metrology::BladeSection& DrawnAt(const DrawnBlade& drawn, double z_mm);

// The nominal outline displaced by the world: what this blade really is at that height, uncut.
metrology::Outline TrueOutline(const metrology::BladeSection& nominal, const BladeWorld& world,
                               const metrology::StackOptions& options);

// Errors of a target along its normals, over the truth's nodes, each with the length that it stands for.
struct TargetErrors {
  double weighted_squares_mm3 = 0, length_mm = 0, worst_mm = 0, held_mm = 0;
  double weighted_expanded_mm3 = 0;  // of the squares of U
  void Add(const metrology::TargetSection& target, const metrology::Outline& truth);
  void Add(const TargetErrors& other);
  double Rms_mm() const;
  double Held_percent() const { return 100 * held_mm / length_mm; }
};

}  // namespace sixpoint::bench
