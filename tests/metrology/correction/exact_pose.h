// A pose that nothing makes uncertain.
#pragma once

#include "metrology/correction/registered_pose.h"

namespace sixpoint::metrology {

inline RegisteredPose ExactPose(const Eigen::Isometry3d& zero_from_part) {
  return {zero_from_part, PoseCovariance(Matrix6d::Zero(), zero_from_part.translation()), {}};
}

}  // namespace sixpoint::metrology
