// Our values of a drawing's characteristics beside those that another instrument measured of the same blades.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "metrology/inspection/instrument_bias.h"
#include "sixpoint/plant/v1/drawing.pb.h"
#include "storage/measurements.h"

namespace sixpoint::inspection {

// Of a blade, as it was found by a revision of the drawing.
struct OurValue {
  std::string blade_serial, characteristic, feature;
  std::string unit;  // MM, UM, DEG, RATIO
  double value = 0;  // of a position the distance, of a profile the signed deviation
  std::optional<double> expanded_uncertainty;
};

// Both newest first: of each blade, characteristic and feature the first of each side counts. In the drawing's units and order; what the
// drawing does not have, and what is in a unit of another kind there, has no pair. Where the other instrument tells the half width of a
// profile, ours counts without its sign.
std::vector<metrology::ValuePair> PairedValues(const plant::v1::Drawing& drawing, const std::vector<OurValue>& ours,
                                               const std::vector<storage::MeasurementRow>& theirs);

}  // namespace sixpoint::inspection
