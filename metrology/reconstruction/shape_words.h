// What a reconstruction says in words.
#pragma once

#include <string>
#include <vector>

#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::metrology {

// Which machined or fixed regions were seen too little to say anything; empty: none.
std::string UnseenText(const std::vector<ShapeRegion>& regions, const std::vector<RegionFinding>& findings,
                       double least_seen_part);
// Of the kind of limit that is missed most: of which region, by how much.
std::string MissedText(const std::vector<ShapeRegion>& regions, const ShapeMisses& misses);

}  // namespace sixpoint::metrology
