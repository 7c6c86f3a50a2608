// The calibration artefact: a plate with conical holes C1.. and square slots Q1.. in its upper face
// (docs/methods/sensor_calibration.md, artefact).
#pragma once

#include <absl/status/status.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Half the artefact: what an angle means in mm.
inline constexpr double kArtefactLever_mm = 10;

// A feature's centre at the height of the upper face, artefact frame.
struct PlaneFeature {
  std::string name;
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
};

// Artefact frame: the plate is side_mm x side_mm, centred on the origin, its upper face z = 0, z pointing out of it.
struct Artefact {
  double side_mm = 0;
  std::vector<PlaneFeature> cones;
  double cone_half_angle_rad = 0;
  double cone_top_radius_mm = 0;  // at the upper face
  double cone_bottom_radius_mm = 0;
  std::vector<PlaneFeature> slots;  // square, sides along the plate's
  double slot_width_mm = 0;
  double slot_depth_mm = 0;

  double ConeDepth() const;
};

// INVALID_ARGUMENT naming the value: sizes finite and positive, at least three cones that are not collinear, every
// feature on the plate and clear of the others.
absl::Status Validate(const Artefact& artefact);

struct TouchedPoint {
  std::string name;
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
};

// What the touch probe measured, machine frame: centres at the height of the upper face, points of the upper face, and
// points of the faces x = +-side / 2 and y = +-side / 2 of the artefact (corrected for the probe's sphere).
struct ArtefactTouch {
  std::vector<TouchedPoint> centres;
  Points plane_mm, side_x_mm, side_y_mm;
  // Of one coordinate. 0: not stated; then kTouchUncertaintyMm.
  double standard_uncertainty_mm = 0;
};

// Touch probing's +-1 um (CONF 3.1) as the standard uncertainty of a coordinate where none is stated. Residuals of 0.5 um
// do not make it smaller: they show the probe's repeatability, not its qualification, which all readings share.
constexpr double kTouchUncertaintyMm = 1e-3;

// Machine from artefact by the touched cone centres alone. INVALID_ARGUMENT where a cone's centre is missing, the centres
// do not have the record's distances (naming a unit error where it is one) or a value is not finite.
absl::Status CheckTouch(const Artefact& artefact, const ArtefactTouch& touch);
Eigen::Isometry3d MachineFromArtefactByCones(const Artefact& artefact, const ArtefactTouch& touch);

// The rigid transform that carries `from` onto `onto` with least squares (Kabsch, proper rotation).
Eigen::Isometry3d RigidFit(const Points& from, const Points& onto);

// The touched centre of a feature; null where it was not touched.
const Eigen::Vector3d* TouchedCentre(const ArtefactTouch& touch, const std::string& name);

}  // namespace sixpoint::metrology
