// Diameters: of the pin that stands in a hole, and of the hole itself (docs/methods/inspection.md, diameters).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "metrology/inspection/hole_displacement.h"
#include "metrology/inspection/pin.h"
#include "metrology/inspection/stated_value.h"

namespace sixpoint::metrology {

// Sources by name, beside those of the scans.
inline constexpr char kPinPoints[] = "points of the pin", kBorePoints[] = "points of the bore";
inline constexpr char kPinStanding[] = "how the pin stands";
inline constexpr char kPinForm[] = "form of the pin", kBoreForm[] = "form of the bore";
inline constexpr char kPinCertificate[] = "certificate of the pin";
inline constexpr char kSeenOtherwise[] = "how a scanner sees a diameter";
inline constexpr char kPlayInHole[] = "play of the pin";

struct PinDiameter {
  // As the scanner sees it: uncertain by the points, the scans, the calibrations and the form. How a pin shines is in no part of it, and
  // a certificate takes no part.
  StatedLength seen;
  // The pin's own: the certificate's where one is stated; else as seen, which a scanner may see otherwise by
  // PinLimits::greatest_diameter_difference_um.
  StatedLength own;
};
PinDiameter PinDiameterOf(const NominalPin& nominal, const PinFit& fit, const MeasuredHole& hole,
                          const PinLimits& limits);

// Of the hole as drilled. From a pin it is an interval: not narrower than the pin, not wider than the pin and its greatest play; the
// value is the middle, and the expanded uncertainty has half of the interval whole.
struct HoleDiameter {
  StatedLength diameter;
  double half_interval_mm = 0;  // 0: of a bore
  ValueEffects effects_mm;      // without the interval
};
struct HoleDiameterFinding {
  std::optional<HoleDiameter> found;
  std::string reason;  // why not
};
HoleDiameterFinding DiameterByPin(const NominalPin& nominal, const PinFit& fit);
HoleDiameter DiameterOfBore(const PinFit& fit, const MeasuredHole& hole, const PinLimits& limits);

}  // namespace sixpoint::metrology
