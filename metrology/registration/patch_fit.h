// The robust pose change that takes patches to the surface, and how well it is known.
//
// Each patch is one observation: the mean of its points, with variance noise / points + model error + what the pose itself
// leaves open there. The model error (of the casting, the sensor, the CAD) is estimated from the spread of the patches. The
// last term keeps patches that alone hold a direction, as a blade's tip holds its span: what the others cannot know is no
// reason to throw a patch out.
#pragma once

#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/linear_algebra/pose_directions.h"
#include "metrology/registration/patch_sums.h"

namespace sixpoint::metrology {

struct PatchFit {
  Vector6d change = Vector6d::Zero();        // scaled, in the part frame (PartRow)
  Matrix6d covariance = NotYet<Matrix6d>();  // of the change, from noise and model error
  Matrix6d normal = NotYet<Matrix6d>();      // of the patches kept
  double noise_sigma_mm = 0;                 // of a point
  double model_sigma_mm = 0;                 // of a patch
  double correlation_widening = 1;           // of variances: neighbouring patches err together
  double information_kept = 1;               // of the weakest direction's, by the loss
  std::vector<double> offsets_mm;            // of each patch, after the change
  std::vector<double> weights;               // of each patch: Tukey's, 0 to 1
  std::vector<double> slopes;                // of each patch: how its offset pulls at the pose still, relative
};

struct PatchFitOptions {
  Matrix6d start_covariance = NotYet<Matrix6d>();  // of the pose at which the patches were summed
  PoseDirections free = Matrix6d::Identity();      // that may change
  double patch_mm = 0;
  double condition_limit = 2000;  // directions held less well than this do not change
};

PatchFit FitPatches(const PatchSums& sums, const PatchFitOptions& options);

}  // namespace sixpoint::metrology
