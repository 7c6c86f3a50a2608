// What the point laser probe's calibration is computed from: checked readings on fitted faces. Internal to the kernel.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "metrology/calibration/probe_calibration.h"

namespace sixpoint::metrology {

// A face as its touched points fit it: n . (p - centre) = 0 by least squares of the distances.
struct FittedFace {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> across = Eigen::Matrix<double, 3, 2>::Zero();
  double spread_mm = 0;  // standard deviation along the direction in which the points spread least
};
FittedFace FitFace(const std::vector<Eigen::Vector3d>& points_mm);

// Displacements about mid range in half ranges make both parameters mm: (half a, t + mid a).
struct ProbeDesign {
  std::vector<FittedFace> faces;  // in the order given, read or not
  std::vector<int> face_of;       // of each reading
  double mid_mm = 0, half_mm = 0;
  Eigen::MatrixXd matrix;  // readings x 6: (gamma' n, n)
  Eigen::VectorXd right;   // n . (centre - position)
  double condition_number = 0;

  double Scaled(double displacement_mm) const { return (displacement_mm - mid_mm) / half_mm; }
  // (a, t) of the design's parameters, a 6 x 6 matrix.
  Matrix6d ParametersFromDesign() const;
};

// Numbers, names and range, then whether the readings determine the probe (the paper's section 6).
absl::StatusOr<ProbeDesign> DesignOf(const std::vector<ProbedFace>& faces, const std::vector<ProbeReading>& readings,
                                     const ProbeOptions& options);
// The first part alone; face_of is filled where it is given.
absl::Status CheckProbed(const std::vector<ProbedFace>& faces, const std::vector<ProbeReading>& readings,
                         const ProbeOptions& options, std::vector<int>* face_of);

}  // namespace sixpoint::metrology
