// What a scanner repeats: superposed scans of one flat, ground face (CONF 3.2.2).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/scanner/line_scanner.h"
#include "metrology/studies/study_verdict.h"

namespace sixpoint::metrology {

// Sensor frame.
struct StripRegion {
  double x_minimum_mm = 0, x_maximum_mm = 0, y_minimum_mm = 0, y_maximum_mm = 0;
};

struct GaugeStudyOptions {
  std::optional<StripRegion> region;  // nothing: the box that every scan covers
  double station_pitch_mm = 0.1;
  double limit_um = 0;  // of the median oscillation; 0: none
};

struct GaugeStation {
  double x_mm = 0, y_mm = 0;
  double mean_z_mm = 0;
  double oscillation_mm = 0;  // half of the range over the scans
  double standard_deviation_mm = 0;
};

struct GaugeStudy {
  int scan_count = 0;
  std::vector<GaugeStation> stations;
  double median_oscillation_mm = 0;
  double median_oscillation_standard_uncertainty_mm = 0;
  double greatest_oscillation_mm = 0;
  double standard_deviation_mm = 0;  // of one reading, over all stations
  double standard_deviation_standard_uncertainty_mm = 0;
  double drift_mm = 0;  // of a scan's mean z from the first to the last, along a straight line
  double drift_standard_uncertainty_mm = 0;
  StudyVerdict verdict = StudyVerdict::kReported;
};

inline constexpr int kFewestGaugeScans = 10;
inline constexpr int kFewestStations = 10;
inline constexpr int kMostStations = 10000;

// At each station of a grid over the region, each scan's reading nearest to the station's middle, carried there along the
// strip's plane (one plane through all readings: how the sensor is mounted is not its noise). Stations that a scan does not
// show are left out. INVALID_ARGUMENT for too few scans, too many stations, values that are not finite, and a face that is
// not flat (rms of the stations' means about the plane above 0.05 mm); FAILED_PRECONDITION where fewer than ten stations
// are seen by every scan.
absl::StatusOr<GaugeStudy> StudyGauge(const std::vector<LineScan>& scans, const GaugeStudyOptions& options);

}  // namespace sixpoint::metrology
