// A plant as files, in the form that `sixpoint plant run` reads (docs/cli.md): dataset.json, blade.stl, scans; and truth.json beside them,
// which the product never sees.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "simulator/plant_world.h"

namespace sixpoint::simulator {

struct PlantFiles {
  int scan_count = 0;
  std::int64_t point_count = 0;
};
// Into a folder that is made where it is not there. The same seed writes the same bytes on any number of threads.
absl::StatusOr<PlantFiles> WritePlant(const PlantWorld& world, const std::string& folder, int threads);

}  // namespace sixpoint::simulator
