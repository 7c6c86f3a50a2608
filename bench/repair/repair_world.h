// Blades for `bench/run repair`: plant-a's rotor blade, each one's deviations drawn from a world that no method of the kernels assumes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "metrology/repair/blade_sections.h"

namespace sixpoint::bench {

// What a blade is off its CAD, as a displacement within the planes of constant z: so that a section of it is the displaced nominal section.
class BladeWorld {
 public:
  BladeWorld(std::uint64_t seed, const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm);
  // Of a point of the nominal surface with its outward normal.
  Eigen::Vector3d Displacement(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& normal) const;

 private:
  struct Wave {
    Eigen::Vector3d by_mm;  // phase for each mm
    double phase = 0, height_mm = 0;
  };
  Eigen::Vector3d low_mm_, high_mm_;
  double twist_rad_ = 0, twist_power_ = 1, bend_power_ = 2;
  Eigen::Vector2d bend_mm_ = Eigen::Vector2d::Zero(), shift_mm_ = Eigen::Vector2d::Zero();
  std::vector<Wave> waves_;
  double leading_wear_mm_ = 0, trailing_wear_mm_ = 0, wear_reach_mm_ = 3, wear_slope_ = 0;
};

struct NominalBlade {
  std::shared_ptr<const metrology::Surface> surface;
  Eigen::Vector3d low_mm, high_mm;
};
// No surface: the file is not there.
NominalBlade LoadBlade(const std::string& step_file);

// Points of the nominal wall between two heights, evenly over its area, with their normals: displaced for each blade anew.
struct WallPoints {
  metrology::Points points_mm, normals;
};
WallPoints WallOf(const metrology::Surface& surface, std::size_t count, double from_z_mm, double to_z_mm,
                  std::uint64_t seed);

inline constexpr double kNoise_mm = 2e-3;  // of a point
metrology::Points ScanOf(const WallPoints& wall, const BladeWorld& world, double noise_mm, std::uint64_t seed);

}  // namespace sixpoint::bench
