// What a reconstruction says in words.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {

// Which machined or fixed regions were seen too little to say anything; empty: none.
std::string UnseenText(const std::vector<ShapeRegion>& regions, const std::vector<RegionFinding>& findings,
                       double least_seen_part);
// Of the kind of limit that is missed most: of which region, by how much.
std::string MissedText(const std::vector<ShapeRegion>& regions, const ShapeMisses& misses);
// how: before the number, with its space; or empty.
std::string RegionMissedText(const ShapeRegion& region, const std::string& how, double missed_mm);
std::string KinkText(const std::vector<ShapeRegion>& regions, const ShapeTransition& transition);
// INVALID_ARGUMENT, field "options.finest_spacing_mm".
absl::Status TooCoarseAt(double spacing_mm, const std::string& what);

}  // namespace sixpoint::metrology
