// The scanner's housing as a box, and whether it keeps away from the part wherever a straight move takes it.
//
// Units: mm. Pure and thread-safe; the same inputs give the same answer.
#pragma once

#include <Eigen/Geometry>

#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

// Sensor frame: z towards the sensor, its lower face where the laser leaves it.
struct SensorBody {
  Eigen::Vector3d low_mm, high_mm;
};

// A box that may be turned: every centre + axes * (within +-half_mm).
struct TurnedBox {
  Eigen::Vector3d centre_mm;
  Eigen::Matrix3d axes;  // unit columns, orthogonal
  Eigen::Vector3d half_mm;
};

// All places of a body whose sensor frame goes straight from one origin to another, or, where each axis comes in its own time, anywhere between
// the two along the frame's axes: a box of the sensor's axes that holds them.
TurnedBox SweptBody(const SensorBody& body, const Eigen::Matrix3d& axes, const Eigen::Vector3d& from_mm,
                    const Eigen::Vector3d& to_mm);
// The same where every place of the box between the two origins, in the frame's own axes, may be passed: rapid moves.
TurnedBox BodyBetween(const SensorBody& body, const Eigen::Matrix3d& axes, const Eigen::Vector3d& from_mm,
                      const Eigen::Vector3d& to_mm);

// Whether no place of the box is nearer to the surface than that, nor within a closed one. By halving: a piece is clear where its middle is farther off
// than its corners reach. What 20,000 looks do not tell counts as too near.
bool IsClear(const TurnedBox& box, const Surface& surface, double clearance_mm);

}  // namespace sixpoint::metrology
