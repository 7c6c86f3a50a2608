// Points and directions as rows keep them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace sixpoint::inspection {

inline std::array<double, 3> ThreeOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline std::vector<double> ListOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace sixpoint::inspection
