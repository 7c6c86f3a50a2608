// Numbers of other instruments, and of other revisions of a drawing, in the unit of a characteristic.
#pragma once

#include <optional>
#include <string>

#include "sixpoint/plant/v1/drawing.pb.h"

namespace sixpoint::inspection {

// By how much a number is multiplied, or divided: of thousands the one that leaves the decimal number that was written.
struct UnitConversion {
  double factor = 1, divisor = 1;
  double Of(double value) const { return value * factor / divisor; }
};

// from: mm, um, deg, ratio, as files write them, or MM, UM, DEG, RATIO, as the record does. None: of another kind, or no unit.
std::optional<UnitConversion> ConversionTo(plant::v1::CharacteristicUnit unit, const std::string& from);

}  // namespace sixpoint::inspection
