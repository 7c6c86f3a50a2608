// What another instrument's file says, value by value, whatever its format: QIF, AQDEF, CSV. Which of a drawing's characteristics each
// value is of, and whether it can be, is not asked here.
//
// CSV (docs/exchange.md, import): a head with the columns characteristic, value and unit, and any of serial, feature,
// expanded_uncertainty, measured_at, zone and reason, in any order; or the head of our own export.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sixpoint::exchange {

enum class MeasuredFormat { kQif, kAqdef, kCsv };

struct MeasuredRow {
  std::string at;                              // where it stands, for messages: "row 7", "SN-1: 17"
  std::string serial;                          // empty: not told
  std::string characteristic, feature;         // as the file calls them; feature: empty: not told
  std::string unit;                            // as the file has it; empty: not told
  std::optional<double> value;                 // none: not measured, or whoever measured says that it does not count
  std::optional<double> expanded_uncertainty;  // 95 %
  // What value and uncertainty are the size of: DIAMETER, RADIUS, WIDTH, HALF_WIDTH, BORDERS; empty: not told.
  std::string zone;
  std::string reason;  // why there is no value; else empty
  std::optional<std::chrono::system_clock::time_point> measured_at;
};

inline constexpr std::size_t kMostMeasuredBytes = 4 << 20;
inline constexpr std::size_t kMostMeasuredRows = 20000;

// At least one row. INVALID_ARGUMENT names what cannot be read, and the row or line.
absl::StatusOr<std::vector<MeasuredRow>> ReadMeasuredFile(MeasuredFormat format, std::string_view file);

}  // namespace sixpoint::exchange
