// Points of a STEP file's own surfaces, by OpenCASCADE: the truth beside which a prepared surface is judged.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace sixpoint::testing {

struct TruePoint {
  Eigen::Vector3d point_mm;  // of the face's surface, part frame
  Eigen::Vector3d normal;    // unit, outward
};

// Half of them spread by area, half as many to each piece of a coarse triangulation, so that narrow and strongly curved
// regions have their share. None within about `from_edges_mm` of an edge between two faces: there the nearest point may be
// the other's. The same for the same seed. Empty where the file cannot be read.
std::vector<TruePoint> TruePoints(const std::string& step_path, double from_edges_mm, std::size_t count,
                                  std::uint64_t seed);

// Unsigned distances of points from the file's shape, by OpenCASCADE's own search; milliseconds each.
std::vector<double> TrueDistances(const std::string& step_path, const std::vector<Eigen::Vector3d>& points_mm);

}  // namespace sixpoint::testing
