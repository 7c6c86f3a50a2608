#include "metrology/registration/fit_samples.h"

#include <algorithm>

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;

constexpr double kRegionMarginMm = 5;

}  // namespace

std::vector<Sample> SamplesOf(const std::vector<ScanPortion>& portions, const Isometry3d& zero_from_part,
                              const FitOptions& options, std::size_t count) {
  const Isometry3d part_from_zero = zero_from_part.inverse(Eigen::Isometry);
  std::size_t total = 0;
  for (const ScanPortion& portion : portions) total += portion.sensor.size();
  const bool everywhere = options.regions_in.empty();
  FitOptions nearby;  // what lies in a region to be left out may still show the way
  nearby.regions_in = options.regions_in;
  // Regions leave few of the points: look at more.
  const std::size_t stride =
      std::max<std::size_t>(1, total / std::max<std::size_t>(1, everywhere ? count : 10 * count));
  std::vector<Sample> samples;
  for (std::size_t p = 0; p < portions.size(); ++p) {
    bool before = false;
    for (std::size_t i = 0; i < portions[p].sensor.size(); ++i) {
      if (stride > 1 && i % (2 * stride) >= 2) {
        i += 2 * stride - i % (2 * stride) - 1;
        before = false;
        continue;
      }
      Sample sample;
      sample.zero_mm = portions[p].zero_mm(i);
      if (!everywhere && !InRegions(nearby, part_from_zero * sample.zero_mm, kRegionMarginMm)) {
        before = false;
        continue;
      }
      sample.portion = static_cast<std::uint32_t>(p);
      sample.index = static_cast<std::uint32_t>(i);
      sample.follows = before;
      samples.push_back(sample);
      before = true;
    }
  }
  return samples;
}

}  // namespace sixpoint::metrology
