// A blank as its scans show it: patches of its surface, each with all that its place is uncertain by (docs/methods/reconstruction.md, blank).
//
// Which way the blank's surface looks is told by the points of one scan about a place, on the side that the scanner saw: so a thin edge's walls are
// told apart. What shows no surface was not seen. Frames: part, sensor. Units: mm. Not thread-safe; computes on its own threads. The same scans in
// the same order give the same bits on any number.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "metrology/inspection/part_mapping.h"
#include "metrology/inspection/surface_patches.h"
#include "metrology/reconstruction/blank_patch.h"

namespace sixpoint::metrology {

struct MeasuredBlankOptions {
  int threads = 2;
  double farthest_mm = 1.5;  // of a point from the design
  double cell_mm = 0.2;      // the surface is looked at over three of them
  int least_points = 8;      // of a patch, and of the cells about a place
  std::int64_t greatest_point_count = 10'000'000;
  std::function<bool()> keep_going = {};
};

struct BlankCounts {
  std::int64_t taken = 0;
  std::int64_t far_off = 0;    // outside the design's box and farthest_mm about it: not of this part
  std::int64_t shapeless = 0;  // too few about them, or no surface: chips, spray, rims
};

class MeasuredBlank {
 public:
  MeasuredBlank(std::shared_ptr<const Surface> design, PartMapping mapping, MeasuredBlankOptions options);
  ~MeasuredBlank();

  // A scan without its points, then its points in the sensor frame as they come. RESOURCE_EXHAUSTED beyond greatest_point_count, CANCELLED
  // where the caller is gone.
  absl::Status Begin(const LineScan& scan);
  absl::Status AddPoints(const Points& in_sensor_mm);
  // At the design's patches. FAILED_PRECONDITION where none was seen.
  absl::StatusOr<std::vector<BlankPatch>> Finish(const SurfacePatches& patches);

  const BlankCounts& counts() const { return counts_; }

 private:
  struct Places;
  // Tells which way the last scan's points look, and takes them over.
  absl::Status EndScan();

  std::shared_ptr<const Surface> design_;
  PartMapping mapping_;
  MeasuredBlankOptions options_;
  std::vector<ScanPlace> scans_;
  Points scan_in_part_mm_, scan_in_sensor_mm_;  // of the scan that is being read
  Points in_part_mm_, outward_;                 // of those before
  std::unique_ptr<Places> places_;              // where scans saw what
  BlankCounts counts_;
};

}  // namespace sixpoint::metrology
