// What a plant's files say, for kernels that are tested on them.
#pragma once

#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace sixpoint::testing {

inline std::string ReadFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

inline Eigen::Vector3d VectorOf(const nlohmann::json& in) {
  return Eigen::Vector3d(in.at(0).get<double>(), in.at(1).get<double>(), in.at(2).get<double>());
}

// Of three or four rows.
inline Eigen::Isometry3d PoseOf(const nlohmann::json& in) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      pose.matrix()(row, column) =
          in.at(static_cast<std::size_t>(row)).at(static_cast<std::size_t>(column)).get<double>();
  return pose;
}

}  // namespace sixpoint::testing
