// A chain with its samples becomes an outline: local polynomials between corners and gaps, as wide as the outline's curvature allows.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <vector>

#include "metrology/sections/lean.h"
#include "metrology/sections/local_fit.h"
#include "metrology/sections/outline.h"
#include "metrology/sections/point_chain.h"

namespace sixpoint::metrology {

// What a node owes to the noise of each mean of samples: of means first, first + 1, ... around.
struct NodeNoise {
  std::size_t first = 0;
  std::vector<float> by_offset, by_slope;
};

struct FittedOutline {
  Outline outline;
  std::vector<NodeNoise> noise;       // of each node
  std::vector<double> mean_sigma_mm;  // standard deviation of each mean of samples
  double sample_sigma_mm = 0;         // of one sample: the greater of what was stated and what the residuals show
  double found_sigma_mm = 0;          // what the residuals show
  std::int64_t used_count = 0, outlier_count = 0;
};

struct OutlineFitOptions {
  double noise_mm = 0;  // of a sample
  bool exact = false;   // no noise: windows as narrow as the points allow
  bool lean_known = false;
  bool as_measured =
      false;       // exact, but with the windows of measured outlines: ripples of a CAD surface are averaged alike
  LeanField lean;  // already taken off the samples; nodes have it added to what is left
  bool without_corners = false;  // none is looked for
};

// The fit's points: samples far from their neighbours' line left out, then as means of short stretches.
std::vector<FitPoint> FitPointsOf(const std::vector<SectionSample>& samples, const std::vector<ChainedSample>& chained,
                                  const PointChain& chain, bool lean_known, std::int64_t* outliers);

absl::StatusOr<FittedOutline> FitOutline(const PointChain& chain, const std::vector<FitPoint>& points,
                                         const OutlineFitOptions& options);

}  // namespace sixpoint::metrology
