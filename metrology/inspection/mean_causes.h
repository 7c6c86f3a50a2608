// How means of points' distances to a surface follow the pose and all that mapped the points, cause by cause.
//
// Frames: part, sensor. Units: mm. The same bits on any number of threads.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "metrology/inspection/part_mapping.h"

namespace sixpoint::metrology {

// What a standard deviation of each cause does to the means, so that what they have in common is known.
struct DeviationCauses {
  struct Cause {
    std::string source;
    double degrees_of_freedom;
    Eigen::Index first, count;  // columns
  };
  std::vector<Cause> causes;
  Eigen::MatrixXd per_sigma_mm;  // a row a mean, 0 where it was not seen
};

// What one scan's points are of a mean.
struct MeanPart {
  ScanPlace place;
  double share = 0;                                  // of the mean's points
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of the surface there, outward, unit
  Eigen::Vector3d in_part_mm = Eigen::Vector3d::Zero(), in_sensor_mm = Eigen::Vector3d::Zero();  // middle of its points
};

// parts_of: a mean's, called once each by any thread; none: a row of 0.
DeviationCauses CausesOf(const PartMapping& mapping, std::size_t mean_count,
                         const std::function<std::vector<MeanPart>(std::size_t mean)>& parts_of, int threads);

}  // namespace sixpoint::metrology
