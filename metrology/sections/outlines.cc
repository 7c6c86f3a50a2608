#include "metrology/sections/outlines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/sections/lean.h"
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

struct Ordered {
  PointChain chain;
  std::vector<FitPoint> points;
  std::int64_t stray_count = 0, outlier_count = 0;
};

// scatter_mm: how far from the outline points are beside their noise.
absl::StatusOr<Ordered> OrderOf(const std::vector<SectionSample>& samples, double extent_mm, double noise_mm,
                                double scatter_mm, const OutlineOptions& options) {
  Ordered ordered;
  const double thin_mm = 3 * extent_mm / static_cast<double>(samples.size());
  auto chain =
      ChainOf(samples, {std::max({kNoiseSpacings * noise_mm, extent_mm / 1500, scatter_mm, thin_mm}), options.gap_mm});
  if (!chain.ok()) return chain.status();
  ordered.chain = *std::move(chain);
  std::int64_t unsettled_count = 0;
  Settle(Chained(samples, ordered.chain, ordered.chain.spacing_mm, &unsettled_count), &ordered.chain);
  const auto chained = Chained(samples, ordered.chain, ordered.chain.spacing_mm, &ordered.stray_count);
  ordered.points = FitPointsOf(samples, chained, ordered.chain, options.surface != nullptr, &ordered.outlier_count);
  return ordered;
}

absl::StatusOr<SectionOutline> OfLoop(const std::vector<Eigen::Vector2d>& loop_mm, bool without_corners) {
  auto chain = ChainOfLoop(loop_mm);
  if (!chain.ok()) return chain.status();
  std::vector<FitPoint> points;
  for (std::size_t i = 0; i < chain->points_mm.size(); ++i)
    points.push_back({chain->points_mm[i], chain->at_mm[i], 0, 0, 1});
  auto fitted = FitOutline(*chain, points, {0, true, true, true, {}, without_corners});
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
  const bool lean_known = options.surface != nullptr;
  double noise_mm = options.noise_um * 1e-3;
  auto ordered = OrderOf(near.samples, extent_mm, noise_mm, lean_known ? 0 : 0.25 * options.half_width_mm, options);
  if (!ordered.ok()) return ordered.status();
  LeanField lean = LeanOf(ordered->chain, LocalFit(ordered->points, ordered->chain.length_mm, lean_known, true));
  noise_mm = std::max(noise_mm, lean.noise_mm);
  if (!lean_known) {
    // Ordered once more when the lean is known: then they scatter by their noise alone.
    for (SectionSample& sample : near.samples) sample.point_mm -= sample.beyond_mm * lean.At(sample.point_mm);
    ordered = OrderOf(near.samples, extent_mm, noise_mm, 3 * lean.scatter * options.half_width_mm, options);
    if (!ordered.ok()) return ordered.status();
  } else {
    lean = LeanField{};
  }
  evidence.stray_count = ordered->stray_count;
  evidence.outlier_count = ordered->outlier_count;
  auto fitted =
      FitOutline(ordered->chain, ordered->points, {noise_mm, false, lean_known, false, lean, options.without_corners});
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
                                              const Eigen::Vector3d* near_mm, bool without_corners) {
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
  auto made = OfLoop((*loops)[chosen], without_corners);
  if (!made.ok()) return made.status();
  made->part_from_section = *part_from_section;
  return made;
}

}  // namespace sixpoint::metrology
