// Where a hole is against where it is drawn, with direction: in the surface, and of its axis (docs/methods/inspection.md, displacement).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/inspection/pin.h"
#include "metrology/inspection/stated_value.h"

namespace sixpoint::metrology {

// What tells the direction `along`: the hole's nominal axis, or, where that stands within 5 deg of the normal, the part's z; its x
// where z does too.
enum class SurfaceReference { kHoleAxis, kPartZ, kPartX };

// In the surface at a hole's nominal start; part frame, unit. along: the projection of the reference, pointed outward; across: normal x along.
struct SurfaceDirections {
  SurfaceReference reference = SurfaceReference::kHoleAxis;
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  Eigen::Vector3d across = Eigen::Vector3d::UnitY();
};
SurfaceDirections SurfaceDirectionsOf(const Eigen::Vector3d& axis, const Eigen::Vector3d& normal);

// How a cylinder's parameters (c1, c2, s1, s2, radius) follow one cause.
struct CylinderSource {
  std::string source;
  double degrees_of_freedom;
  bool common;                                         // other holes are off by the same draws
  Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma;  // a column a draw
};
ValueEffects EffectsOf(const Eigen::Matrix<double, 1, 5>& per_parameter, const std::vector<CylinderSource>& sources,
                       int hole);

// Where another positioning of the scans puts a hole.
struct MovedHole {
  Eigen::Vector3d start_in_part_mm, axis_in_part;
};

// A hole as measured, with what its values follow.
struct MeasuredHole {
  int index = 0;
  Eigen::Vector3d start_in_part_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_in_part = Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 3, 5> start_per_parameter = Eigen::Matrix<double, 3, 5>::Zero();
  std::vector<CylinderSource> sources;
  std::vector<MovedHole> moved;  // by each of the other positionings, in their order
};

// What other positionings say otherwise: difference / sqrt 3, the same one for all holes.
inline constexpr char kOtherPositionings[] = "other positionings";
ValueEffect OtherPositionings(double greatest_difference);

// What a displacement in the surface is uncertain by in the positioning that it is stated in, without what other positionings would say: a
// drawing that names its datums asks for no other.
struct SurfaceUncertainty {
  Eigen::Matrix2d covariance_mm2 = NotYet<Eigen::Matrix2d>();  // of (along, across)
  double coverage_factor = 0;                                  // 95 %; the greatest of all directions in the surface
};

struct HoleDisplacement {
  SurfaceDirections directions;
  StatedLength along, across;  // of the start from the nominal start
  SurfaceUncertainty in_stated_positioning;
  // Of the axis from the nominal axis: the angle in the plane of the nominal axis and `along`, positive where the axis leans further
  // towards `along` (a leaning hole is flatter than drawn), and the angle towards `across`.
  StatedAngle inclination_along, inclination_across;
};
HoleDisplacement DisplacementOf(const NominalPin& nominal, const PinFit& fit, const MeasuredHole& hole);

}  // namespace sixpoint::metrology
