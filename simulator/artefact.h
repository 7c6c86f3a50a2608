// The calibration artefact: a square plate with three cones and three square slots (CONF 3.4), exact surfaces.
//
// Artefact frame: upper face z = 0, centred; cones open upwards and end in a flat floor; slots are square pockets.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "simulator/random.h"
#include "simulator/ray_tracer.h"

namespace sixpoint::simulator {

struct ArtefactGeometry {
  double side_mm = 24;
  double height_mm = 8;
  double cone_half_angle_deg = 45;
  double cone_top_radius_mm = 2.0;
  double cone_bottom_radius_mm = 0.5;
  double slot_width_mm = 2.4;
  double slot_depth_mm = 0.8;
  std::map<std::string, Eigen::Vector2d> cones_mm{{"C1", {-3.5, 0}}, {"C2", {3.5, 3.5}}, {"C3", {3.5, -3.5}}};
  std::map<std::string, Eigen::Vector2d> slots_mm{{"Q1", {-3.5, 6.5}}, {"Q2", {-3.5, -6.5}}, {"Q3", {9, 0}}};

  double cone_depth_mm() const;
};

class ArtefactShape : public Shape {
 public:
  explicit ArtefactShape(ArtefactGeometry geometry);
  std::optional<Hit> Intersect(const Ray& ray, double limit_mm) const override;

 private:
  ArtefactGeometry geometry_;
  std::vector<Eigen::Vector2d> cones_mm_, slots_mm_;
};

// What a touch probe reports of the artefact, machine frame.
struct TouchProbing {
  std::map<std::string, Eigen::Vector3d> centres_mm;  // cones and slots, at the height of the upper face
  metrology::Points plane_mm, side_x_mm, side_y_mm;   // on the upper face; on the faces x = side/2 and y = side/2
};
TouchProbing ProbeArtefact(const ArtefactGeometry& geometry, const Eigen::Isometry3d& machine_from_artefact,
                           double noise_um, Random random);

}  // namespace sixpoint::simulator
