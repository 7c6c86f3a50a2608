#include "metrology/studies/gauge_study.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "metrology/statistics/ranks.h"
#include "metrology/statistics/spread.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kLeastFlatMm = 0.05;

absl::Status Check(const std::vector<LineScan>& scans, const GaugeStudyOptions& options) {
  if (scans.size() < kFewestGaugeScans)
    return Refuse("scans", std::to_string(scans.size()) + " of them", "at least 10 superposed scans");
  for (const LineScan& scan : scans) {
    if (scan.points_mm.empty()) return Refuse("scans", scan.id + " without points", "scans with points");
    for (const Eigen::Vector3d& p : scan.points_mm)
      if (!p.allFinite()) return Refuse("scans", scan.id + " with a point that is not finite", "finite coordinates");
  }
  if (!std::isfinite(options.station_pitch_mm) || options.station_pitch_mm <= 0)
    return Refuse("station_pitch_mm", Rounded(options.station_pitch_mm), "> 0");
  if (!std::isfinite(options.limit_um) || options.limit_um < 0)
    return Refuse("limit_um", Rounded(options.limit_um), "> 0, or 0 for none");
  if (!options.region) return absl::OkStatus();
  const StripRegion& r = *options.region;
  for (const double v : {r.x_minimum_mm, r.x_maximum_mm, r.y_minimum_mm, r.y_maximum_mm})
    if (!std::isfinite(v)) return Refuse("region", Rounded(v), "finite bounds");
  if (r.x_minimum_mm >= r.x_maximum_mm || r.y_minimum_mm >= r.y_maximum_mm)
    return Refuse("region",
                  "x " + Rounded(r.x_minimum_mm) + " to " + Rounded(r.x_maximum_mm) + ", y " + Rounded(r.y_minimum_mm) +
                      " to " + Rounded(r.y_maximum_mm),
                  "the lower bound first");
  return absl::OkStatus();
}

StripRegion CommonBox(const std::vector<LineScan>& scans) {
  const double infinity = std::numeric_limits<double>::infinity();
  StripRegion box{-infinity, infinity, -infinity, infinity};
  for (const LineScan& scan : scans) {
    Eigen::Vector3d least = scan.points_mm.front(), greatest = least;
    for (const Eigen::Vector3d& p : scan.points_mm) {
      least = least.cwiseMin(p);
      greatest = greatest.cwiseMax(p);
    }
    box.x_minimum_mm = std::max(box.x_minimum_mm, least.x());
    box.x_maximum_mm = std::min(box.x_maximum_mm, greatest.x());
    box.y_minimum_mm = std::max(box.y_minimum_mm, least.y());
    box.y_maximum_mm = std::min(box.y_maximum_mm, greatest.y());
  }
  return box;
}

struct Grid {
  StripRegion region;
  double pitch_mm;
  int columns, rows;
  int CellOf(const Eigen::Vector3d& p) const {
    const double cx = std::floor((p.x() - region.x_minimum_mm) / pitch_mm);
    const double cy = std::floor((p.y() - region.y_minimum_mm) / pitch_mm);
    if (!(cx >= 0 && cy >= 0 && cx < columns && cy < rows)) return -1;
    return static_cast<int>(cy) * columns + static_cast<int>(cx);
  }
  Eigen::Vector2d MiddleOf(int cell) const {
    return {region.x_minimum_mm + (cell % columns + 0.5) * pitch_mm,
            region.y_minimum_mm + (cell / columns + 0.5) * pitch_mm};
  }
};

// readings[cell][scan]; cells that some scan does not show are empty.
std::vector<Points> ReadingsOf(const std::vector<LineScan>& scans, const Grid& grid) {
  const int cells = grid.columns * grid.rows;
  std::vector<Points> readings(cells);
  std::vector<const Eigen::Vector3d*> nearest;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    nearest.assign(cells, nullptr);
    for (const Eigen::Vector3d& p : scans[s].points_mm) {
      const int cell = grid.CellOf(p);
      if (cell < 0) continue;
      const Eigen::Vector2d middle = grid.MiddleOf(cell);
      if (nearest[cell] == nullptr ||
          (p.head<2>() - middle).squaredNorm() < (nearest[cell]->head<2>() - middle).squaredNorm())
        nearest[cell] = &p;
    }
    for (int cell = 0; cell < cells; ++cell)
      if (nearest[cell] != nullptr && readings[cell].size() == s) readings[cell].push_back(*nearest[cell]);
  }
  for (Points& cell : readings)
    if (cell.size() < scans.size()) cell.clear();
  return readings;
}

// z = c0 + c1 (x - x0) + c2 (y - y0), and the rms about it of each station's mean.
struct StripPlane {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double rms_mm = 0;
};

StripPlane PlaneOf(const std::vector<Points>& readings) {
  Points means;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Points& cell : readings) {
    if (cell.empty()) continue;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& p : cell) mean += p;
    means.push_back(mean / static_cast<double>(cell.size()));
    centre += means.back();
  }
  centre /= static_cast<double>(means.size());
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& m : means) {
    const Eigen::Vector2d d = (m - centre).head<2>();
    normal += d * d.transpose();
    right += d * (m.z() - centre.z());
  }
  // A single line of stations says nothing of the slope across it: none is taken there.
  normal += 1e-12 * std::max(normal.trace(), 1e-12) * Eigen::Matrix2d::Identity();
  StripPlane plane;
  plane.slope = normal.ldlt().solve(right);
  for (const Eigen::Vector3d& m : means) {
    const double r = m.z() - centre.z() - plane.slope.dot((m - centre).head<2>());
    plane.rms_mm += r * r / static_cast<double>(means.size());
  }
  plane.rms_mm = std::sqrt(plane.rms_mm);
  return plane;
}

void Summarise(const std::vector<double>& scan_means, GaugeStudy* study) {
  std::vector<double> oscillations;
  double squares = 0;
  for (const GaugeStation& s : study->stations) {
    oscillations.push_back(s.oscillation_mm);
    squares += s.standard_deviation_mm * s.standard_deviation_mm;
  }
  const double stations = static_cast<double>(oscillations.size());
  study->median_oscillation_mm = Median(oscillations);
  study->greatest_oscillation_mm = *std::max_element(oscillations.begin(), oscillations.end());
  // Of a median: sqrt(pi / 2) of a mean's.
  study->median_oscillation_standard_uncertainty_mm =
      std::sqrt(M_PI / 2) * SpreadOf(oscillations).standard_deviation / std::sqrt(stations);
  study->standard_deviation_mm = std::sqrt(squares / stations);
  const double n = study->scan_count;
  study->standard_deviation_standard_uncertainty_mm = study->standard_deviation_mm / std::sqrt(2 * stations * (n - 1));
  double products = 0, turns = 0, about = 0;
  const double mean = SpreadOf(scan_means).mean;
  for (int i = 0; i < study->scan_count; ++i) {
    const double t = i - (n - 1) / 2;
    products += t * (scan_means[i] - mean);
    turns += t * t;
  }
  const double slope = products / turns;
  for (int i = 0; i < study->scan_count; ++i) {
    const double r = scan_means[i] - mean - slope * (i - (n - 1) / 2);
    about += r * r;
  }
  study->drift_mm = slope * (n - 1);
  study->drift_standard_uncertainty_mm = (n - 1) * std::sqrt(about / (n - 2) / turns);
}

}  // namespace

absl::StatusOr<GaugeStudy> StudyGauge(const std::vector<LineScan>& scans, const GaugeStudyOptions& options) {
  if (absl::Status s = Check(scans, options); !s.ok()) return s;
  Grid grid{options.region ? *options.region : CommonBox(scans), options.station_pitch_mm, 0, 0};
  const double width = grid.region.x_maximum_mm - grid.region.x_minimum_mm;
  const double height = grid.region.y_maximum_mm - grid.region.y_minimum_mm;
  if (!(width >= 0 && height >= 0))
    return absl::FailedPreconditionError("scans: no place that all of them show, want superposed scans");
  const double columns = std::max(1.0, std::floor(width / grid.pitch_mm + 1e-9));
  const double rows = std::max(1.0, std::floor(height / grid.pitch_mm + 1e-9));
  if (columns * rows > kMostStations)
    return Refuse("station_pitch_mm", Rounded(options.station_pitch_mm) + " (" + Rounded(columns * rows) + " stations)",
                  "at most 10000 stations: a larger pitch or a smaller region");
  grid.columns = static_cast<int>(columns);
  grid.rows = static_cast<int>(rows);
  const std::vector<Points> readings = ReadingsOf(scans, grid);
  const auto seen = std::count_if(readings.begin(), readings.end(), [](const Points& c) { return !c.empty(); });
  if (seen < kFewestStations)
    return absl::FailedPreconditionError("scans: " + std::to_string(seen) +
                                         " stations that all of them show, want at least 10");
  const StripPlane plane = PlaneOf(readings);
  if (plane.rms_mm > kLeastFlatMm)
    return Refuse("region", Rounded(1000 * plane.rms_mm) + " um rms about its plane",
                  "a flat face (at most 50 um): no edge, cone or slot in it");

  GaugeStudy study;
  study.scan_count = static_cast<int>(scans.size());
  std::vector<double> scan_means(scans.size(), 0);
  for (std::size_t cell = 0; cell < readings.size(); ++cell) {
    if (readings[cell].empty()) continue;
    const Eigen::Vector2d middle = grid.MiddleOf(static_cast<int>(cell));
    std::vector<double> z;
    for (const Eigen::Vector3d& p : readings[cell]) z.push_back(p.z() - plane.slope.dot(p.head<2>() - middle));
    const Spread spread = SpreadOf(z);
    study.stations.push_back(
        {middle.x(), middle.y(), spread.mean, (spread.maximum - spread.minimum) / 2, spread.standard_deviation});
    for (std::size_t s = 0; s < z.size(); ++s) scan_means[s] += (z[s] - spread.mean) / static_cast<double>(seen);
  }
  Summarise(scan_means, &study);
  study.verdict = JudgeAgainst(options.limit_um, 1000 * study.median_oscillation_mm,
                               1000 * study.median_oscillation_standard_uncertainty_mm);
  return study;
}

}  // namespace sixpoint::metrology
