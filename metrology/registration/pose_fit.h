// What a fit comes to: a pose with all that makes it uncertain where it converged, none elsewhere, and evidence always.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/registration/fit_evidence.h"
#include "metrology/registration/machine_calibration.h"
#include "metrology/registration/mapping_sensitivity.h"
#include "metrology/registration/outcome.h"

namespace sixpoint::metrology {

// Where the part stands at A = B = 0.
struct PlacedPose {
  // noise: of the pose about the reference, from noise and model error. sensitivity: of six rows; of a pose that no scans' angles act on the
  // calibration parameters' columns alone.
  PlacedPose(const Eigen::Isometry3d& zero_from_part_in, const Eigen::Vector3d& reference_mm, const Matrix6d& noise,
             const MappingSensitivity& sensitivity, const MachineCalibration& calibration);

  MappingSensitivity Sensitivity() const;
  // One more that acts on it, by what each of its draws does to the pose (a column a draw) and to no parameter. Nothing where none does.
  void AddSource(const std::string& name, const Eigen::Matrix<double, 6, Eigen::Dynamic>& pose_per_sigma);

  Eigen::Isometry3d zero_from_part;
  PoseCovariance noise_covariance;          // of noise and model error; reference: the part's centroid at zero
  PoseSensitivity calibration_sensitivity;  // about the same reference
  // The same per radian that each portion's a and b are taken greater, in turn.
  Eigen::Matrix<double, 6, Eigen::Dynamic> angle_sensitivity;
  std::vector<ErrorSource> sources;  // that act on it, with what each does to it
  PoseCovariance covariance;         // noise and sources
};

// The sources of directions that were held, and may not be where they were held, of a part that smoothly deviates from its CAD, and of a CAD
// whose faces do not meet.
inline constexpr char kHeldDirections[] = "held directions", kFormDeviation[] = "form", kCadGap[] = "CAD gap";
// Of one part in one fit: another blade's is another.
inline bool IsOfBlade(const std::string& source) {
  return source == kHeldDirections || source == kFormDeviation || source == kCadGap;
}

// What the part's form and its CAD's gaps add to what noise leaves open along a direction (rotation times radius_mm, translation; unit).
double WithFormAndGaps(const PlacedPose& placed, const Vector6d& direction, double radius_mm, double noise_mm);

struct PoseFit {
  Outcome outcome = Outcome::kNotConverged;
  std::optional<PlacedPose> placed;  // where the outcome is kConverged, and only there
  FitEvidence evidence;

  // Takes the pose back, and says why.
  void Withdraw(Outcome why, const std::string& remark);
};

}  // namespace sixpoint::metrology
