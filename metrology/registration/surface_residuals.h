// Distances of points to the surface at a pose, and their robust normal equations; the inside of FitToSurface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

constexpr std::size_t kChunkSize = 1024;  // points that a thread takes at a time, and that are summed together

// Tukey's biweight: 1 at 0, nothing from the width on.
inline double TukeyWeight(double residual, double width) {
  const double u = residual / width;
  return u * u < 1 ? (1 - u * u) * (1 - u * u) : 0;
}
// 95 % efficient for Gaussian noise; wider loses less to noise and more to a deviation's flanks.
constexpr double kTukeyWidth = 4.685;

struct Sample {
  Eigen::Vector3d zero_mm;
  std::uint32_t portion = 0;
  std::uint32_t index = 0;  // in the portion
  bool follows = false;     // the sample before it is its neighbour on the scan
  // Filled by Search.
  bool usable = false;  // near the inside of a face
  std::uint32_t triangle = Surface::kNoTriangle;
  double residual_mm = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // at zero
};

// Pose changes here are scaled: rotation times the part's radius of gyration, about a fixed reference, then translation.
class SurfaceResiduals {
 public:
  SurfaceResiduals(const Surface& surface, std::vector<Sample> samples, const Eigen::Vector3d& reference_mm,
                   int thread_count)
      : surface_(&surface),
        samples_(std::move(samples)),
        reference_mm_(reference_mm),
        radius_mm_(surface.radius_of_gyration_mm()),
        thread_count_(thread_count) {}

  // Closest points at a pose; those farther than reach are not usable.
  void Search(const Eigen::Isometry3d& zero_from_part, double reach_mm);

  // Change of a sample's residual per scaled pose change, negated.
  Vector6d Row(const Sample& sample) const {
    Vector6d row;
    row << (sample.zero_mm - reference_mm_).cross(sample.normal) / radius_mm_, sample.normal;
    return row;
  }

  // Normal equations of the residuals after a change of the pose, weighted by Tukey's biweight.
  struct Equations {
    Matrix6d matrix = Matrix6d::Zero();
    Vector6d right = Vector6d::Zero();
    double loss = 0;  // mean of 1 - (1 - u^2)^3 over all samples
  };
  Equations At(const Vector6d& change, double width_mm) const;

  // The scaled change that minimises the loss, the closest points held: iterated reweighting from `change`.
  Vector6d Minimise(Vector6d change, double width_mm, int step_limit) const;

  Vector6d Unscaled(const Vector6d& scaled) const {
    Vector6d pose_change = scaled;
    pose_change.head<3>() /= radius_mm_;
    return pose_change;
  }

  // Standard deviation of the noise from differences of neighbours, which a smooth deviation of the part leaves alone.
  double NeighbourNoise() const;

  const std::vector<Sample>& samples() const { return samples_; }
  const Eigen::Vector3d& reference_mm() const { return reference_mm_; }
  double radius_mm() const { return radius_mm_; }

 private:
  const Surface* surface_;
  std::vector<Sample> samples_;
  Eigen::Vector3d reference_mm_;
  double radius_mm_;
  int thread_count_;
};

}  // namespace sixpoint::metrology
