// A damaged blade's sections by height, from its cloud, and the nominal ones beside them (docs/methods/repair.md).
//
// Part frame, whose z is the blade's span; mm. The section frames share x, y and their origin's place; only z differs. Thread-safe; the same bits
// on any number of threads, and in whatever order points come.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "metrology/repair/camber_profile.h"
#include "metrology/sections/outlines.h"

namespace sixpoint::metrology {

struct SectionHeights {
  double first_mm = 0;       // the lowest section: above platform and fillet
  double cutoff_mm = 0;      // the repair line: nothing above it is the blade's own
  double target_mm = 0;      // z_max
  double line_width_mm = 1;  // b_r: between sections, and between the recontouring passes
};

struct StackOptions {
  SectionHeights heights;
  Eigen::Vector2d origin_mm = Eigen::Vector2d::Zero();  // of all section frames
  std::optional<Eigen::Vector2d>
      leading_mm;              // a place near the leading edge, part frame; none: the end at the smaller x
  double half_width_mm = 0.1;  // points so near to a section's plane are taken; at most half the line width
  double noise_um = 2;         // of a point, one sigma; 0: what the residuals show
  bool round_ends = false;     // both edges are drawn round: a few points about a small radius are no corner
  const Surface* surface =
      nullptr;  // the drawing's, along which points slide into their plane; none: the lean is fitted
  CamberMethod camber = CamberMethod::kBisected;
  int thread_count = 1;
};

struct BladeSection {
  double z_mm = 0;
  double half_width_mm = 0;  // of the slab that it was measured from; 0: of a surface
  Outline outline;
  CamberProfile profile;
};

// A section that is no closed airfoil, or not near its drawing: the others tell the blade.
struct LeftOutSection {
  std::size_t index = 0;  // among all that were given or asked for
  double z_mm = 0;
  absl::Status refusal;
};

struct MeasuredStack {
  std::vector<BladeSection> sections;  // by z
  std::vector<LeftOutSection> left_out;
};

// From first_mm on in steps of the line width. INVALID_ARGUMENT, by name: heights that do not follow each other, a cut-off below two thirds of the
// way from first to target, fewer sections below it than the regression needs; and where what is left without the sections left out is no longer
// enough ("sections"), with what each of them was refused for ("sections[3].outline").
absl::StatusOr<MeasuredStack> MeasureSections(const Points& points_mm, const StackOptions& options);

// Whether sections at these heights tell a regression enough: 12 of them, and, with the last one's slab, two thirds of the way from the lowest to the
// target. If not, the field is refused, and what was left out with it, under field[index].
absl::Status CheckEnough(const std::vector<double>& z_mm, double half_width_mm, double target_mm,
                         const std::string& field, const std::vector<LeftOutSection>& left_out);

// The nominal sections at any heights, by the same code.
absl::StatusOr<std::vector<BladeSection>> NominalSections(const Surface& surface, const std::vector<double>& z_mm,
                                                          const StackOptions& options);

// Of the sections that are measured: first_mm to cutoff_mm in line widths, the last one so far below the cut-off that all of its slab is: points of
// one side alone would stand for another height.
std::vector<double> MeasuredHeights(const SectionHeights& heights, double half_width_mm);

// As MeasureSections refuses; also what only this room's readers need of options.
absl::Status CheckHeights(const SectionHeights& heights);

}  // namespace sixpoint::metrology
