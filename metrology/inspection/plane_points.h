// Of a blade's scans the points near some planes, in the part, and how uncertain it is where they lie together
// (docs/methods/sections.md).
//
// Units: mm, rad.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/inspection/hole_regions.h"
#include "metrology/inspection/part_mapping.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

struct PlanePointsOptions {
  double half_width_mm = 0.1;
  std::int64_t greatest_kept_count = 4'000'000;    // of all planes; beyond it the call is refused
  std::int64_t greatest_point_count = 60'000'000;  // of all scans
  int threads = 2;
  std::vector<HoleRegion> set_aside = {};  // pins stand there
  std::function<bool()> keep_going = {};   // false: stop with CANCELLED
};

// Scans are added one after another and need not be kept. Not thread-safe; computes on its own threads.
class PlanePoints {
 public:
  // part_from_section: a plane is its frame's z = 0.
  PlanePoints(PartMapping mapping, std::vector<Eigen::Isometry3d> part_from_section, PlanePointsOptions options);

  // A scan without its points, then its points as they come. RESOURCE_EXHAUSTED beyond what is kept, CANCELLED.
  void Begin(const LineScan& scan);
  absl::Status AddPoints(const Points& points_mm);

  // Part frame, in the order of the scans.
  const Points& in_part_mm(std::size_t plane) const { return in_part_mm_[plane]; }

  // Of where all the points together lie in the part, about their middle: by the pose, and by what mapped them, cause by cause as a rigid
  // motion. What of a cause both moved alike shows once. Of fewer than three points: 0.
  PoseCovariance Covariance() const;

 private:
  struct Sampled {
    Eigen::Vector3d in_part_mm, in_sensor_mm;
    std::size_t scan;
  };
  // Every so many of the kept points: a rigid motion needs few.
  std::vector<Sampled> Sample() const;

  PartMapping mapping_;
  std::vector<Eigen::Isometry3d> section_from_part_;
  PlanePointsOptions options_;
  HoleRegions set_aside_;
  std::vector<ScanPlace> scans_;
  std::vector<Points> in_part_mm_, in_sensor_mm_;        // of each plane
  std::vector<std::vector<std::size_t>> first_of_scan_;  // [scan][plane]: how many points there were before
  std::int64_t seen_count_ = 0, kept_count_ = 0;
};

}  // namespace sixpoint::metrology
