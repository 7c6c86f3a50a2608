// Names of places on a surface, some tenths of a millimetre to some millimetres wide: points of one place are looked at together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace sixpoint::metrology {

// A cubic cell of the part and the side its normals look to.
using PatchKey = std::uint64_t;
// The axis of the part along which a normal looks most: 0 to 5 for +x, -x, +y, ...
int SideOf(const Eigen::Vector3d& normal);
PatchKey PatchKeyOf(const Eigen::Vector3d& from_centroid_mm, const Eigen::Vector3d& normal, double patch_mm);
std::array<std::int64_t, 3> CellOf(PatchKey key);
int SideOf(PatchKey key);
PatchKey PatchKeyOf(const std::array<std::int64_t, 3>& cell, int side);
// The key of cells `times` as wide.
PatchKey CoarserKey(PatchKey key, int times);
// Middle of the key's cell, from the centroid; that of a coarser key with its times.
Eigen::Vector3d PatchCentre(PatchKey key, double patch_mm, int times = 1);

}  // namespace sixpoint::metrology
