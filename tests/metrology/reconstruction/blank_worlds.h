// Blanks that no lattice made: a design's surface carried off by waves, twist, bending and dents, with edges that lack stock; seen through patches
// with noise. What is true of them is known everywhere.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "metrology/reconstruction/blank_patch.h"
#include "metrology/reconstruction/design_places.h"
#include "metrology/reconstruction/free_form_deformation.h"

namespace sixpoint::testing {

inline constexpr double kPatch_mm = 0.5;

// Where a point of the design's surface is on the blank.
using BlankOf = std::function<Eigen::Vector3d(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal)>;

struct BlankPoint {
  Eigen::Vector3d place_mm, normal;   // of the design
  Eigen::Vector3d point_mm, outward;  // of the blank, unit
};

// Of places of the design that are off its sharp edges; the blank's normals by differences along its surface.
std::vector<BlankPoint> BlankPoints(const metrology::Surface& design, const std::vector<metrology::DesignPlace>& places,
                                    const BlankOf& blank);

// Each as a patch off by noise of this standard uncertainty: normal, or the mean of sixty points with Student's, three degrees of freedom.
std::vector<metrology::BlankPatch> Measured(const std::vector<BlankPoint>& points, double uncertainty_mm,
                                            bool heavy_tails, std::mt19937_64* random);

// A closed blade: half axes along x (chord), y (thickness), z (span), so that its edges have radii of y^2 / x. Vertices and normals are exact.
std::shared_ptr<const metrology::Surface> LensBlade(const Eigen::Vector3d& half_axes_mm, int steps);

// The shape as a surface of its own, made anew from the moved mesh: a judge that shares nothing with the product's feet.
std::shared_ptr<const metrology::Surface> MovedSurface(const metrology::Surface& design,
                                                       const metrology::FreeFormDeformation& deformation);

// 0 to 1, three times differentiable at its ends.
double Ramp(double t);

}  // namespace sixpoint::testing
