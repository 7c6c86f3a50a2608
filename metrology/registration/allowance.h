// The pose at which the part lies inside its blank
// (docs/methods/registration.md, allowance; after Zhao, Lin and Fu 2021): of all poses that leave
// everywhere the stock asked for, the one nearest to a least-squares fit; or the proof that there is none near.
//
// The blank's surface is scanned; d is a patch's mean signed distance outside the design. Wanted: d >= least stock on every
// patch (the paper's D = d + t2 > 0 with t2 = -least stock). Solved by sequential quadratic programming in the six pose
// parameters, each step exactly as a least-distance problem (Lawson and Hanson 1974, chapter 23), whose multipliers are the
// proof where no step exists: patches whose pushes balance, so that no small motion frees one without hurting another.
#pragma once

#include <string>
#include <vector>

#include "metrology/registration/best_fit.h"
#include "metrology/registration/seen_sides.h"

namespace sixpoint::metrology {

struct AllowanceOptions {
  double least_stock_mm = 0;      // negative: the design's lower tolerance may be used up by this much
  double greatest_stock_mm = 5;   // points farther outside than this belong to something else
  double patch_mm = 1;            // stock is the mean over patches of this width
  std::int64_t least_points = 5;  // of a patch that counts
  // Of each side of the part with 4 mm2, what must have been seen, in cells of a patch or 1 mm: of what was not, nothing is certified.
  double least_side_part = 0.9;
};

// A patch that holds the pose, or that lacks stock.
struct AllowancePatch {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // part frame, about the middle of the patch
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    // outward, mean
  double stock_mm = 0;                                 // signed distance of the blank outside the design there
  double standard_uncertainty_mm = 0;
  double share = 0;  // of the forces that balance (the multipliers), 0 to 1
};

// What the stock is at the pose that was found, or at the one that lacks least.
struct AllowanceFinding {
  double least_stock_mm = 0;  // of any patch that was seen
  double lacking_mm = 0;      // by how much it falls short of what was asked; 0 where it does not
  // At most seven patches that keep the pose from being better, greatest share first.
  std::vector<AllowancePatch> holding;
  std::vector<SeenSide> sides;
};

struct AllowanceFit {
  PoseFit fit;  // kConverged, kNotConverged, kInfeasible, or kNotDetermined: a side was seen too little
  AllowanceFinding stock;
};

// From a pose near (a best fit's, or the nominal). Errors as FitToSurface; INVALID_ARGUMENT also for options out of range.
absl::StatusOr<AllowanceFit> FitWithAllowance(const Surface& surface, const std::vector<ScanPortion>& portions,
                                              const Eigen::Isometry3d& zero_from_part,
                                              const AllowanceOptions& allowance, const MachineCalibration& calibration,
                                              const FitOptions& options);

}  // namespace sixpoint::metrology
