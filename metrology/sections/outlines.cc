#include "metrology/sections/outlines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/sections/samples.h"
#include "metrology/sections/section_cut.h"
#include "metrology/statistics/ranks.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kNoiseSpacings =
    8;  // of a point's noise: a chain's points are no nearer, so that they follow each other

absl::Status Check(const OutlineOptions& options) {
  Refusals refusals;
  const auto within = [&](const char* field, double value, double least, double most) {
    if (!(value >= least && value <= most))
      refusals.Add(Refuse(field, value, NumberText(least) + " to " + NumberText(most)));
  };
  within("half_width_mm", options.half_width_mm, 0.001, 10);
  within("noise_um", options.noise_um, 0, 1000);
  within("surface_reach_mm", options.surface_reach_mm, 0.001, 100);
  within("nominal_reach_mm", options.nominal_reach_mm, 0.001, 100);
  within("gap_mm", options.gap_mm, 0, 1000);
  return refusals.status();
}

double ExtentOf(const std::vector<SectionSample>& samples) {
  Eigen::Vector2d extent;
  for (int k = 0; k < 2; ++k) {
    std::vector<double> values;
    for (const SectionSample& sample : samples) values.push_back(sample.point_mm[k]);
    const std::size_t few = values.size() / 100;
    const double high = AtRank(values.size() - 1 - few, &values);
    extent[k] = high - AtRank(few, &values);
  }
  return extent.norm();
}

absl::StatusOr<SectionOutline> OfLoop(const std::vector<Eigen::Vector2d>& loop_mm) {
  auto chain = ChainOfLoop(loop_mm);
  if (!chain.ok()) return chain.status();
  std::vector<FitPoint> points;
  for (std::size_t i = 0; i < chain->points_mm.size(); ++i)
    points.push_back({chain->points_mm[i], chain->at_mm[i], 0, 0, 1});
  auto fitted = FitOutline(*chain, points, {0, true, true});
  if (!fitted.ok()) return fitted.status();
  SectionOutline made;
  made.fitted = *std::move(fitted);
  return made;
}

}  // namespace

absl::StatusOr<SectionOutline> MeasuredOutline(const Points& points_mm, const SectionPlane& plane,
                                               const OutlineOptions& options) {
  if (const absl::Status status = Check(options); !status.ok()) return status;
  auto part_from_section = PartFromSection(plane);
  if (!part_from_section.ok()) return part_from_section.status();
  SectionSamples near = SamplesNear(points_mm, *part_from_section, options.half_width_mm, options.surface,
                                    options.surface_reach_mm, options.thread_count);
  SectionOutline made;
  OutlineEvidence& evidence = made.evidence;
  made.part_from_section = *part_from_section;
  evidence.not_finite_count = near.not_finite_count;
  evidence.platform_count = near.too_flat_count;
  evidence.far_count = near.far_from_surface_count;
  if (options.nominal != nullptr) {
    const auto far = [&](const SectionSample& sample) {
      const Outline& nominal = *options.nominal;
      return (nominal.PointAt(nominal.Nearest(sample.point_mm)) - sample.point_mm).norm() > options.nominal_reach_mm;
    };
    const auto kept = std::remove_if(near.samples.begin(), near.samples.end(), far);
    evidence.far_count += near.samples.end() - kept;
    near.samples.erase(kept, near.samples.end());
  }
  evidence.in_slab_count = static_cast<std::int64_t>(near.samples.size());
  if (near.samples.size() < 20)
    return Refuse("points", std::to_string(near.samples.size()) + " near the plane", "at least 20: it misses the part");
  const double extent_mm = ExtentOf(near.samples);
  ChainOptions chain_options;
  const double lean_mm = options.surface != nullptr ? 0 : 0.25 * options.half_width_mm;
  chain_options.spacing_mm = std::max({kNoiseSpacings * options.noise_um * 1e-3, extent_mm / 1500, lean_mm,
                                       3 * extent_mm / static_cast<double>(near.samples.size())});
  chain_options.gap_mm = options.gap_mm;
  const auto chain = ChainOf(near.samples, chain_options);
  if (!chain.ok()) return chain.status();
  const auto chained = Chained(near.samples, *chain, chain->spacing_mm, &evidence.stray_count);
  const bool lean_known = options.surface != nullptr;
  const std::vector<FitPoint> points = FitPointsOf(near.samples, chained, *chain, lean_known, &evidence.outlier_count);
  auto fitted = FitOutline(*chain, points, {options.noise_um * 1e-3, false, lean_known});
  if (!fitted.ok()) return fitted.status();
  made.fitted = *std::move(fitted);
  evidence.used_count = made.fitted.used_count;
  if (!lean_known) {
    // A surface that turns over the span by as much as the blade turns about its leading edge: w^2 / 2 by its curvature there.
    double steepest = 0;
    for (const OutlineNode& node : made.fitted.outline.nodes()) steepest = std::max(steepest, std::abs(node.lean));
    evidence.lean_bound_um = 1e3 * steepest * options.half_width_mm * options.half_width_mm / (2 * extent_mm);
  }
  return made;
}

absl::StatusOr<SectionOutline> SurfaceOutline(const Surface& surface, const SectionPlane& plane,
                                              const Eigen::Vector3d* near_mm) {
  auto part_from_section = PartFromSection(plane);
  if (!part_from_section.ok()) return part_from_section.status();
  auto loops = CutSurface(surface, *part_from_section);
  if (!loops.ok()) return loops.status();
  std::size_t chosen = 0;
  if (near_mm != nullptr) {
    const Eigen::Vector2d near = (part_from_section->inverse() * *near_mm).head<2>();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < loops->size(); ++k)
      for (const Eigen::Vector2d& point_mm : (*loops)[k])
        if ((point_mm - near).norm() < least) least = (point_mm - near).norm(), chosen = k;
  } else if (loops->size() > 1) {
    return Refuse("plane", std::to_string(loops->size()) + " outlines of the surface",
                  "one, or a place near the one meant");
  }
  auto made = OfLoop((*loops)[chosen]);
  if (!made.ok()) return made.status();
  made->part_from_section = *part_from_section;
  return made;
}

absl::StatusOr<SectionOutline> LoopOutline(const std::vector<Eigen::Vector2d>& loop_mm) { return OfLoop(loop_mm); }

}  // namespace sixpoint::metrology
