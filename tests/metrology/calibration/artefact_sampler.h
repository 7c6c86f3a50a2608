// A line scanner over the artefact, ray by ray: an independent model to test calibration against.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <random>
#include <string>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/calibration/sensor_calibration.h"

namespace sixpoint::testing {

struct ArtefactBench {
  metrology::Artefact artefact;
  metrology::SensorPose sensor = metrology::SensorPose::Exact();  // the truth
  Eigen::Isometry3d machine_from_artefact;                        // the truth
  metrology::LineSensorOptics optics;
  double touch_noise_mm = metrology::kTouchUncertaintyMm;
  double pitch_mm = 0.1;
  int columns = 320;
  double line_half_angle_rad = 10 * M_PI / 180;

  // Like the plant's: cones on a triangle, 7 mm and 45 deg; sensor turned by tenths of a degree; the plate by `turn_deg`.
  static ArtefactBench Usual(double turn_deg = -0.6);

  struct Ray {
    Eigen::Vector3d origin, direction;  // machine frame
  };
  Ray RayAt(double x_mm, double angle_rad, const Eigen::Vector3d& v0_mm) const;
  // Distance along the ray to the artefact's surface; face says where: the upper face, a cone's wall or a slot's floor.
  enum class Face { kUpper, kCone, kFloor };
  std::optional<double> Range(const Ray& ray, Face* face) const;

  // V0 so that the plate's middle stands at z_sensor.
  Eigen::Vector3d StartAt(double z_sensor_mm) const;
  // noise_mm 0: exact.
  metrology::LineScan Scan(const std::string& id, double z_sensor_mm, double noise_mm, std::mt19937_64* random) const;
  // 3 + 3 centres, 16 points of the upper face, 6 of each of two side faces.
  metrology::ArtefactTouch Touch(double noise_mm, std::mt19937_64* random) const;

  // Inverse of the Fisher information of all rays that meet the upper face or a cone (two scans at +-10 mm) and of all
  // touched points, by central differences of the ranges: the bound on any unbiased estimate's covariance.
  metrology::Matrix6d CramerRaoBound() const;
};

}  // namespace sixpoint::testing
