// What a fit is asked: which directions are free, which points count, when it may be called one, and when to stop.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <vector>

#include "metrology/registration/region.h"
#include "metrology/registration/scan_portion.h"

namespace sixpoint::metrology {

struct FitOptions {
  double model_error_um = 0.5;  // of mapping and surface: the loss never gets narrower than this and the noise
  double form_error_um =
      0.25;  // of the part from its CAD and of the CAD's own preparation, smooth; standard deviation, at least
  // Of the part about its centroid, part axes: turns about x, y, z, shifts along x, y, z. A fixed one keeps the nominal's.
  std::array<bool, 6> free = {true, true, true, true, true, true};
  // How far from the nominal's the part may stand in the fixed directions, standard uncertainty of each; 0: not stated, and in no uncertainty.
  double held_turn_rad = 0, held_shift_mm = 0;
  std::vector<Region> regions_in;    // where points count; empty: everywhere
  std::vector<Region> regions_out;   // where they do not
  std::vector<double> scan_weights;  // by portion; empty: 1
  double greatest_start_error_mm = 15;
  bool coarse_start = false;  // look for the part first: tens of millimetres off and turned in any way (coarse_start.h)
  double least_overlap = 0.3;
  double greatest_spread_mm = 0.25;  // robust standard deviation of a blade from its CAD, beyond which it is another
  double condition_limit = 2000;
  int iteration_limit = 60;  // of the steps that follow the pose from its start
  int thread_count = 2;
  std::function<bool()> keep_going;       // false: stop with CANCELLED; asked on any thread, one at a time
  std::function<void(int)> on_iteration;  // after each: how many there were; on the caller's thread
};

// Whether a point counts; regions larger by the margin.
bool InRegions(const FitOptions& options, const Eigen::Vector3d& part_mm, double margin_mm = 0);

// Of each direction that is held, turns counted at radius_mm: standard uncertainty, mm; 0 of a free one.
Vector6d HeldUncertainty(const FitOptions& options, double radius_mm);

// INVALID_ARGUMENT: fewer points than free directions, points metres apart, a nominal pose that is not finite, no free
// direction, weights that are not positive.
absl::Status CheckInputs(const std::vector<ScanPortion>& portions, const Eigen::Isometry3d& zero_from_part,
                         const FitOptions& options);

}  // namespace sixpoint::metrology
