// The flat faces in a raw cloud, largest first.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, towards the sensor
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double HeightOf(const Eigen::Vector3d& p) const { return normal.dot(p - point); }
};

// About `count` of the points, evenly spread over their order without the aliasing of a fixed stride. Deterministic.
Points EvenSample(const Points& points, std::size_t count);

// By consensus, each face without the points of those before it: tilted by less than 30 deg against the sensor, holding at
// least a thirtieth of the sample within band_mm. At most `most` of them. Deterministic.
std::vector<Plane> FlatFaces(const Points& sample, double band_mm, std::size_t most);

}  // namespace sixpoint::metrology
