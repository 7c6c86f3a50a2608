// A point laser probe of known parameters measuring a block that a touch probe located, both with noise.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "metrology/calibration/probe_calibration.h"

namespace sixpoint::testing {

struct ProbeBench {
  struct Plane {
    std::string face;
    Eigen::Vector3d drawn, normal, middle_mm;  // normal and middle in the machine frame
  };

  Eigen::Vector3d approach = 1.0007 * Eigen::Vector3d(0.021, -0.034, -1).normalized();
  Eigen::Vector3d offset_mm{12.31, -7.42, -150.27};
  std::vector<Plane> planes;
  double noise_mm = 0.00218, touch_mm = 0.00053, position_noise_mm = 0;
  double face_side_mm = 20;
  int per_side = 4;  // readings and touched points on a face: its square
  metrology::ProbeOptions options;

  // Three faces whose normals lean by `lean_rad` from the block's axis; the block turned and put somewhere.
  explicit ProbeBench(double lean_rad = 0.785, const Eigen::Vector3d& place_mm = {60, 45, -210}, double turn_rad = 0.3)
      : ProbeBench(Leaning(lean_rad), place_mm, turn_rad) {}
  // Faces of these normals, which look upwards.
  ProbeBench(const std::vector<Eigen::Vector3d>& drawn_normals, const Eigen::Vector3d& place_mm, double turn_rad) {
    options.noise_mm = noise_mm;
    options.touch_uncertainty_mm = touch_mm;
    options.least_displacement_mm = -5;
    options.greatest_displacement_mm = 5;
    const Eigen::Matrix3d machine_from_block =
        (Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    for (const Eigen::Vector3d& drawn : drawn_normals) {
      const Eigen::Vector3d out = machine_from_block * drawn;
      planes.push_back({"F" + std::to_string(planes.size() + 1), drawn, out, place_mm + 15 * out});
    }
  }

  static std::vector<Eigen::Vector3d> Leaning(double lean_rad) {
    std::vector<Eigen::Vector3d> normals;
    for (int j = 0; j < 3; ++j)
      normals.push_back(Eigen::AngleAxisd(j * 2 * M_PI / 3, Eigen::Vector3d::UnitZ()) *
                        Eigen::Vector3d(std::sin(lean_rad), 0, std::cos(lean_rad)));
    return normals;
  }

  double Meets(const Plane& plane, const Eigen::Vector3d& position_mm) const {
    return plane.normal.dot(plane.middle_mm - position_mm - offset_mm) / plane.normal.dot(approach);
  }

  // random: null for no noise.
  std::vector<metrology::ProbedFace> Touch(std::mt19937_64* random) const {
    std::vector<metrology::ProbedFace> faces;
    for (const Plane& plane : planes) {
      metrology::ProbedFace& face = faces.emplace_back();
      face.face = plane.face;
      face.nominal_normal = plane.drawn;
      for (const Eigen::Vector3d& p : Spread(plane))
        face.touched_mm.push_back(p + Noise(touch_mm, random) * plane.normal);
    }
    return faces;
  }
  // Displacements go up and down over `span_mm` about `about_mm`.
  std::vector<metrology::ProbeReading> Measure(std::mt19937_64* random, double span_mm = 8, double about_mm = 0) const {
    std::vector<metrology::ProbeReading> readings;
    for (const Plane& plane : planes) {
      int i = 0;
      const std::vector<Eigen::Vector3d> spread = Spread(plane);
      for (const Eigen::Vector3d& p : spread) {
        // 7 has no factor in common with 16 or 9: displacement and place on the face stay apart.
        const double step = static_cast<double>(i++ * 7 % static_cast<int>(spread.size())) / (spread.size() - 1.0);
        const double gamma = about_mm + span_mm * (step - 0.5);
        const Eigen::Vector3d recorded = p - offset_mm - gamma * approach;
        const Eigen::Vector3d jitter(Noise(position_noise_mm, random), Noise(position_noise_mm, random),
                                     Noise(position_noise_mm, random));
        readings.push_back({plane.face, recorded, Meets(plane, recorded + jitter) + Noise(noise_mm, random)});
      }
    }
    return readings;
  }

  // Of (a, t), found minus true.
  metrology::Vector6d ErrorOf(const metrology::ProbeCalibration& found) const {
    metrology::Vector6d error;
    error << found.approach - approach, found.offset_mm - offset_mm;
    return error;
  }
  // The Cramer-Rao bound on the covariance of (a, t) for readings at these positions, from the true model alone.
  metrology::Matrix6d Bound(const std::vector<metrology::ProbeReading>& readings) const;

  static double Noise(double sigma, std::mt19937_64* random) {
    return random == nullptr ? 0 : std::normal_distribution<double>(0, sigma > 0 ? sigma : 1e-300)(*random);
  }
  std::vector<Eigen::Vector3d> Spread(const Plane& plane) const {
    const Eigen::Vector3d u = plane.normal.unitOrthogonal(), v = plane.normal.cross(u);
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < per_side; ++i)
      for (int k = 0; k < per_side; ++k)
        points.push_back(plane.middle_mm + face_side_mm * (i / (per_side - 1.0) - 0.5) * u +
                         face_side_mm * (k / (per_side - 1.0) - 0.5) * v);
    return points;
  }
};

}  // namespace sixpoint::testing
