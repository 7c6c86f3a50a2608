// Blades that are known everywhere: an airfoil that twists, leans and tapers over its height, and the same one bent, twisted on and worn.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "metrology/repair/blade_sections.h"

namespace sixpoint::metrology {

// What an individual is off the nominal airfoil at a height and a place on the outline: within the section's plane.
using SectionMotion = std::function<Eigen::Vector2d(double z_mm, const Eigen::Vector2d& point_mm)>;

// The polygon at a height, counter-clockwise; of the nominal blade where there is no motion.
std::vector<Eigen::Vector2d> KnownPolygon(double z_mm, const SectionMotion& motion);
// The same as a section, by the code that the kernels use.
BladeSection KnownSection(double z_mm, const SectionMotion& motion);

// The nominal blade's wall between two heights as a surface without end faces.
std::shared_ptr<const Surface> KnownSurface(double from_mm, double to_mm);

// Points on the wall from one height to another, each with noise along its outline's normal.
Points KnownWall(double from_mm, double to_mm, std::size_t count, double noise_mm, const SectionMotion& motion,
                 std::uint64_t seed);

// A bend that grows with the square of the height, and a twist with the height; a wave along both.
SectionMotion Bent(double bend_mm, double twist_rad, double wave_mm);

}  // namespace sixpoint::metrology
