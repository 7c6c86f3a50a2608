#include "metrology/surface/patch_key.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr int kCellBits = 20;  // of each coordinate
constexpr std::int64_t kCellOffset = std::int64_t{1} << (kCellBits - 1);
constexpr int kSideBits = 3;
// Of a cell, off the centroid: a flat face of a part that is symmetric lies a round number of millimetres from it, and on the
// border of two cells rounding would choose.
constexpr double kCellShift = 0.3183;

}  // namespace

std::array<std::int64_t, 3> CellOf(PatchKey key) {
  constexpr PatchKey kMask = (PatchKey{1} << kCellBits) - 1;
  std::array<std::int64_t, 3> cell{};
  for (int k = 0; k < 3; ++k)
    cell[k] = static_cast<std::int64_t>(key >> (kSideBits + k * kCellBits) & kMask) - kCellOffset;
  return cell;
}

int SideOf(PatchKey key) { return static_cast<int>(key & ((PatchKey{1} << kSideBits) - 1)); }

PatchKey PatchKeyOf(const std::array<std::int64_t, 3>& cell, int side) {
  auto key = static_cast<PatchKey>(side);
  for (int k = 0; k < 3; ++k) key |= static_cast<PatchKey>(cell[k] + kCellOffset) << (kSideBits + k * kCellBits);
  return key;
}

int SideOf(const Vector3d& normal) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

PatchKey PatchKeyOf(const Vector3d& from_centroid_mm, const Vector3d& normal, double patch_mm) {
  std::array<std::int64_t, 3> cell{};
  for (int k = 0; k < 3; ++k) {
    const double at = std::clamp(from_centroid_mm[k] / patch_mm + kCellShift, static_cast<double>(-kCellOffset),
                                 static_cast<double>(kCellOffset - 1));
    // Its floor, for which older processors have no instruction.
    const auto towards_0 = static_cast<std::int64_t>(at);
    cell[k] = towards_0 - (at < static_cast<double>(towards_0) ? 1 : 0);
  }
  return PatchKeyOf(cell, SideOf(normal));
}

Vector3d PatchCentre(PatchKey key, double patch_mm, int times) {
  const std::array<std::int64_t, 3> cell = CellOf(key);
  const Vector3d low(static_cast<double>(cell[0]), static_cast<double>(cell[1]), static_cast<double>(cell[2]));
  return patch_mm * (times * (low + Vector3d::Constant(0.5)) - Vector3d::Constant(kCellShift));
}

PatchKey CoarserKey(PatchKey key, int times) {
  std::array<std::int64_t, 3> cell = CellOf(key);
  for (std::int64_t& c : cell) c = c >= 0 ? c / times : -((-c + times - 1) / times);
  return PatchKeyOf(cell, SideOf(key));
}

}  // namespace sixpoint::metrology
