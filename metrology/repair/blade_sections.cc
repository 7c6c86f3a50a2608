#include "metrology/repair/blade_sections.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metrology/parallel/loops.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastPart = 2.0 / 3;      // of the span that is the blade's own
constexpr std::size_t kLeastSections = 12;  // twice the coefficients of a polynomial of degree 5 in z
constexpr std::size_t kMostSections = 2000;
constexpr double kRounding_mm = 1e-9;

SectionPlane PlaneAt(double z_mm, const StackOptions& options) {
  SectionPlane plane;
  plane.origin_mm = {options.origin_mm.x(), options.origin_mm.y(), z_mm};
  return plane;
}

absl::StatusOr<BladeSection> SectionOf(const absl::StatusOr<SectionOutline>& found, double z_mm,
                                       const StackOptions& options) {
  if (!found.ok()) return found.status();
  BladeSection section;
  section.z_mm = z_mm;
  section.outline = ChebyshevOutline(found->fitted.outline);
  LeadingHint hint;
  if (options.leading_mm) hint.near_mm = *options.leading_mm - options.origin_mm;
  auto profile = ProfileOf(section.outline, hint, options.camber);
  if (!profile.ok()) return profile.status();
  section.profile = *std::move(profile);
  return section;
}

// What was made, in its order, and what was not.
MeasuredStack PartedOf(std::vector<absl::StatusOr<BladeSection>> made, const std::vector<double>& z_mm) {
  MeasuredStack stack;
  for (std::size_t k = 0; k < made.size(); ++k)
    if (made[k].ok())
      stack.sections.push_back(*std::move(made[k]));
    else
      stack.left_out.push_back({k, z_mm[k], made[k].status()});
  return stack;
}

void AddLeftOut(const std::vector<LeftOutSection>& left_out, const std::string& field, Refusals* refusals) {
  for (const LeftOutSection& one : left_out)
    refusals->Add(Under(field + "[" + std::to_string(one.index) + "].", one.refusal));
}

// Points of each section's slab, in one pass over the cloud; none from above the cut-off, where there is a weld.
std::vector<Points> SlabsOf(const Points& points_mm, const std::vector<double>& z_mm, double cutoff_mm,
                            double half_width_mm, double spacing_mm) {
  std::vector<Points> slabs(z_mm.size());
  const auto last = static_cast<double>(z_mm.size() - 1);
  for (const Eigen::Vector3d& point : points_mm) {
    const double step = std::round((point.z() - z_mm[0]) / spacing_mm);
    if (!(step >= 0 && step <= last + 1 && point.z() <= cutoff_mm)) continue;
    const auto add = [&](std::size_t k) {
      if (std::abs(point.z() - z_mm[k]) <= half_width_mm) slabs[k].push_back(point);
    };
    if (step < last) add(static_cast<std::size_t>(step));
    if (step >= last - 1) add(z_mm.size() - 1);  // which is not a whole step above the one before
  }
  return slabs;
}

std::vector<double> HeightsUpTo(const SectionHeights& heights) {
  std::vector<double> z_mm;
  for (std::size_t k = 0; k < kMostSections; ++k) {
    const double z = heights.first_mm + static_cast<double>(k) * heights.line_width_mm;
    if (z > heights.cutoff_mm + kRounding_mm) break;
    z_mm.push_back(z);
  }
  return z_mm;
}

}  // namespace

std::vector<double> MeasuredHeights(const SectionHeights& heights, double half_width_mm) {
  std::vector<double> z_mm = HeightsUpTo(heights);
  if (!z_mm.empty()) z_mm.back() = std::min(z_mm.back(), heights.cutoff_mm - half_width_mm);
  return z_mm;
}

absl::Status CheckHeights(const SectionHeights& heights) {
  Refusals refusals;
  for (const double z : {heights.first_mm, heights.cutoff_mm, heights.target_mm})
    if (!std::isfinite(z)) return Refuse("heights", z, "finite");
  if (!(heights.line_width_mm >= 0.01 && heights.line_width_mm <= 10))
    return Refuse("heights.line_width_mm", heights.line_width_mm, "0.01 to 10");
  if (!(heights.target_mm > heights.first_mm))
    return Refuse("heights.target_mm", heights.target_mm, "above first_mm, " + NumberText(heights.first_mm));
  if (!(heights.cutoff_mm < heights.target_mm))
    refusals.Add(Refuse("heights.cutoff_mm", heights.cutoff_mm, "below target_mm, " + NumberText(heights.target_mm)));
  const double least_mm = heights.first_mm + kLeastPart * (heights.target_mm - heights.first_mm);
  if (!(heights.cutoff_mm >= least_mm - kRounding_mm))
    refusals.Add(Refuse("heights.cutoff_mm", heights.cutoff_mm,
                        "at least " + Rounded(least_mm) + ": two thirds of the way from first_mm to target_mm"));
  const std::size_t count = HeightsUpTo(heights).size();
  if (count < kLeastSections || count >= kMostSections)
    refusals.Add(Refuse("heights.line_width_mm", heights.line_width_mm,
                        std::to_string(kLeastSections) + " to " + std::to_string(kMostSections) +
                            " sections up to the cut-off, not " + std::to_string(count)));
  return refusals.status();
}

absl::Status CheckEnough(const std::vector<double>& z_mm, double half_width_mm, double target_mm,
                         const std::string& field, const std::vector<LeftOutSection>& left_out) {
  Refusals refusals;
  const double least_mm = z_mm.empty() ? target_mm : z_mm.front() + kLeastPart * (target_mm - z_mm.front());
  if (z_mm.size() < kLeastSections)
    refusals.Add(Refuse(field, std::to_string(z_mm.size()) + " sections",
                        "at least " + std::to_string(kLeastSections) + ": a polynomial of degree 5 in z"));
  else if (!(z_mm.back() + half_width_mm >= least_mm - kRounding_mm))
    refusals.Add(Refuse(field, "sections up to " + Rounded(z_mm.back()),
                        "up to " + Rounded(least_mm) + ": two thirds of the way from the lowest to the target"));
  if (!refusals.status().ok()) AddLeftOut(left_out, field, &refusals);
  // What failed otherwise than by refusal is no property of a section.
  for (const LeftOutSection& one : left_out)
    if (ViolationsOf(one.refusal).empty()) refusals.Add(one.refusal);
  return refusals.status();
}

absl::StatusOr<MeasuredStack> MeasureSections(const Points& points_mm, const StackOptions& options) {
  if (const absl::Status status = CheckHeights(options.heights); !status.ok()) return status;
  const double most_mm = options.heights.line_width_mm / 2;
  if (!(options.half_width_mm > 0 && options.half_width_mm <= most_mm))
    return Refuse("half_width_mm", options.half_width_mm,
                  "above 0, at most half the line width, " + NumberText(most_mm));
  const std::vector<double> z_mm = MeasuredHeights(options.heights, options.half_width_mm);
  const std::vector<Points> slabs =
      SlabsOf(points_mm, z_mm, options.heights.cutoff_mm, options.half_width_mm, options.heights.line_width_mm);
  std::vector<absl::StatusOr<BladeSection>> made(z_mm.size(), absl::InternalError("not measured"));
  ForEach(z_mm.size(), options.thread_count, [&](std::size_t k) {
    OutlineOptions outline;
    outline.half_width_mm = options.half_width_mm;
    outline.noise_um = options.noise_um;
    outline.surface = options.surface;
    outline.without_corners = options.round_ends;
    made[k] = SectionOf(MeasuredOutline(slabs[k], PlaneAt(z_mm[k], options), outline), z_mm[k], options);
    if (made[k].ok()) made[k]->half_width_mm = options.half_width_mm;
  });
  MeasuredStack stack = PartedOf(std::move(made), z_mm);
  std::vector<double> kept_mm;
  for (const BladeSection& section : stack.sections) kept_mm.push_back(section.z_mm);
  const absl::Status enough =
      CheckEnough(kept_mm, options.half_width_mm, options.heights.target_mm, "sections", stack.left_out);
  if (!enough.ok()) return enough;
  return stack;
}

absl::StatusOr<std::vector<BladeSection>> NominalSections(const Surface& surface, const std::vector<double>& z_mm,
                                                          const StackOptions& options) {
  std::vector<absl::StatusOr<BladeSection>> made(z_mm.size(), absl::InternalError("not cut"));
  ForEach(z_mm.size(), options.thread_count, [&](std::size_t k) {
    made[k] =
        SectionOf(SurfaceOutline(surface, PlaneAt(z_mm[k], options), nullptr, options.round_ends), z_mm[k], options);
  });
  MeasuredStack stack = PartedOf(std::move(made), z_mm);
  Refusals refusals;
  AddLeftOut(stack.left_out, "sections", &refusals);
  if (const absl::Status status = refusals.status(); !status.ok()) return status;
  return std::move(stack.sections);
}

}  // namespace sixpoint::metrology
