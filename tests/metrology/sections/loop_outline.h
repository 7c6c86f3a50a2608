// The outline of a polygon that is known: what measured and nominal outlines are held against.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "metrology/sections/outline_fit.h"
#include "metrology/sections/outlines.h"
#include "metrology/sections/point_chain.h"

namespace sixpoint::metrology {

// A closed polygon, in order, section frame; its windows as narrow as its points allow. Refused as ChainOfLoop.
inline absl::StatusOr<SectionOutline> LoopOutline(const std::vector<Eigen::Vector2d>& loop_mm) {
  const auto chain = ChainOfLoop(loop_mm);
  if (!chain.ok()) return chain.status();
  std::vector<FitPoint> points;
  for (std::size_t i = 0; i < chain->points_mm.size(); ++i)
    points.push_back({chain->points_mm[i], chain->at_mm[i], 0, 0, 1});
  OutlineFitOptions options;
  options.exact = true;
  options.lean_known = true;
  auto fitted = FitOutline(*chain, points, options);
  if (!fitted.ok()) return fitted.status();
  SectionOutline made;
  made.fitted = *std::move(fitted);
  return made;
}

}  // namespace sixpoint::metrology
