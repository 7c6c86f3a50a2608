#include "services/inspection/unit_conversion.h"

namespace sixpoint::inspection {

std::optional<UnitConversion> ConversionTo(plant::v1::CharacteristicUnit unit, const std::string& from) {
  using Conversion = std::optional<UnitConversion>;
  const bool mm = from == "mm" || from == "MM";
  const bool um = from == "um" || from == "UM" || from == "\xc2\xb5m" || from == "\xce\xbcm";
  const bool deg = from == "deg" || from == "DEG" || from == "\xc2\xb0";
  const bool ratio = from == "ratio" || from == "RATIO" || from == "1";
  switch (unit) {
    case plant::v1::CHARACTERISTIC_UNIT_MM:
      return mm ? Conversion({1, 1}) : um ? Conversion({1, 1000}) : std::nullopt;
    case plant::v1::CHARACTERISTIC_UNIT_UM:
      return mm ? Conversion({1000, 1}) : um ? Conversion({1, 1}) : std::nullopt;
    case plant::v1::CHARACTERISTIC_UNIT_DEG:
      return deg ? Conversion({1, 1}) : std::nullopt;
    case plant::v1::CHARACTERISTIC_UNIT_RATIO:
      return ratio ? Conversion({1, 1}) : std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace sixpoint::inspection
