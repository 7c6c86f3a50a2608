// Values of another instrument's file as a drawing's characteristics have them: its units, halves of zones, each once.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "exchange/measured_file.h"
#include "services/inspection/drawn_characteristics.h"
#include "sixpoint/inspection/v1/measurement.pb.h"
#include "storage/measurements.h"

namespace sixpoint::inspection {

// What is said of a file as a whole.
struct FileStatement {
  std::string serial;  // of values under none; empty: not said
  std::optional<std::chrono::system_clock::time_point> measured_at;
  std::optional<double> lengths_expanded_uncertainty_um, angles_expanded_uncertainty_deg;
  std::string position_zone, profile_zone;  // DIAMETER, RADIUS; WIDTH, HALF_WIDTH, BORDERS; empty: not said
  bool only_drawn = false;                  // what the drawing does not have is left out
};

inline constexpr std::size_t kMostBladesOfFile = 200;
inline constexpr std::size_t kMostValuesOfBlade = 4000;

// A measurement a blade, in the order of the file: serial, moment, values and what was left out; the rest is the caller's.
absl::StatusOr<std::vector<storage::MeasurementRow>> MeasuredBlades(const std::vector<exchange::MeasuredRow>& rows,
                                                                    const DrawnCharacteristics& drawn,
                                                                    const FileStatement& statement);

}  // namespace sixpoint::inspection
