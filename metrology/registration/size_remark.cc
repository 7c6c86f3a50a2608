#include "metrology/registration/size_remark.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kSizePoints = 20'000;  // points of all scans
constexpr double kForeign = 0.01;            // of the points at either end, which may be chips and reflections
// Scans show a part of the blade, and never more than it, but for chips.
constexpr double kLeastShown = 0.35, kMostShown = 1.25;

// Longest extent along the nominal part's axes, without the outermost points.
double LongestExtent(const std::vector<ScanPortion>& portions, const Eigen::Isometry3d& zero_from_part) {
  const Eigen::Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  std::size_t total = 0;
  for (const ScanPortion& portion : portions) total += portion.sensor.size();
  const std::size_t stride = std::max<std::size_t>(1, total / kSizePoints);
  std::array<std::vector<double>, 3> coordinates;
  for (const ScanPortion& portion : portions)
    for (std::size_t i = 0; i < portion.sensor.size(); i += stride) {
      const Eigen::Vector3d p = part_from_zero * portion.zero_mm(i);
      for (std::size_t k = 0; k < 3; ++k) coordinates[k].push_back(p[static_cast<Eigen::Index>(k)]);
    }
  double longest = 0;
  for (std::vector<double>& values : coordinates) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const auto left_out = static_cast<std::size_t>(kForeign * static_cast<double>(values.size()));
    longest = std::max(longest, values[values.size() - 1 - left_out] - values[left_out]);
  }
  return longest;
}

}  // namespace

std::string SizeRemark(const Surface& surface, const std::vector<ScanPortion>& portions,
                       const Eigen::Isometry3d& zero_from_part_nominal) {
  const double scanned = LongestExtent(portions, zero_from_part_nominal);
  const double design = (surface.maximum_mm() - surface.minimum_mm()).maxCoeff();
  if (!(scanned > 0) || !(design > 0)) return "";
  const double ratio = scanned / design;
  struct Cause {
    double factor;
    const char* words;
  };
  constexpr std::array<Cause, 4> kCauses = {
      {{25.4, "as if the CAD were in inches and taken for millimetres (25.4)"},
       {1000, "as if the CAD were in metres and taken for millimetres (1000)"},
       {1 / 25.4, "as if the CAD were in millimetres and taken for inches (25.4)"},
       {1e-3, "as if the CAD were in micrometres, or in millimetres and taken for metres (1000)"}}};
  char text[160];
  for (const Cause& cause : kCauses)
    if (ratio > kLeastShown * cause.factor && ratio < kMostShown * cause.factor) {
      std::snprintf(text, sizeof text, "the scans are %.3g times as long as the CAD, %s", ratio, cause.words);
      return text;
    }
  if (ratio < kMostShown) return "";
  std::snprintf(text, sizeof text, "the scans are %.3g times as long as the CAD", ratio);
  return text;
}

}  // namespace sixpoint::metrology
