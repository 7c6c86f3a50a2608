// A profile's measured points in a QIF document: where they lie, and each one's deviation.
#pragma once

#include <vector>

#include "exchange/inspected_part.h"
#include "exchange/qif_elements.h"

namespace sixpoint::exchange::qif {

// Ids::with_points.
std::size_t WithPoints(const InspectedPart& part);
// One of each value that has points, in their order. Nothing where none has.
void WritePointSets(XmlWriter& xml, const InspectedPart& part, const Ids& ids);
// point_set: the set's id.
void WritePointDeviations(XmlWriter& xml, const std::vector<DeviationPoint>& points, std::size_t point_set);

}  // namespace sixpoint::exchange::qif
