// Scans of the artefact by the simulator's ray tracer, once without noise and then any number of times with it; and the
// Fisher information of their readings and of touched coordinates, from the true model alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/frames/pose.h"
#include "metrology/scanner/line_scanner.h"
#include "simulator/artefact.h"
#include "simulator/machine.h"

namespace sixpoint::bench {

// Order: rotation vector of R_sm, T_sm, the artefact's rotation vector about its origin, its translation; machine axes.
using Matrix12d = Eigen::Matrix<double, 12, 12>;

struct Reading {
  std::uint16_t profile = 0, column = 0;
  double x_mm = 0;
  double distance_mm = 0;  // along the ray, from the source
};

struct TracedScan {
  Eigen::Vector3d v0_mm;
  double pitch_mm = 0;
  std::vector<Eigen::Vector3d> fan;  // a column's ray, sensor frame
  std::vector<Reading> readings;
  Matrix12d information = Matrix12d::Zero();  // of all readings, for a noise of 1 mm along the ray
  // Of those on the upper face and on cones' walls that lie 0.05 mm from every edge: where a laser's spot is on one face.
  Matrix12d inner_information = Matrix12d::Zero();
};

// Rays that meet the artefact carry information; what else stands in the scene is read too and carries none.
TracedScan Trace(const simulator::Scene& scene, const simulator::ArtefactGeometry& artefact,
                 const simulator::MachineTruth& truth, const simulator::ScannerDesign& scanner,
                 const simulator::ScanPlan& plan, int threads);

// With noise along the rays and rounded to the raw steps of the sensor.
metrology::LineScan WithNoise(const TracedScan& traced, const simulator::ScannerDesign& scanner, std::uint64_t seed);

// Of one reading that hits a face with this normal at a point (machine frame), for a noise of 1 mm along the ray. The
// first-order change of the distance at which a ray meets a face that moves with the artefact.
void AddReadingInformation(const simulator::MachineTruth& truth, const Eigen::Vector3d& point_mm, double x_mm,
                           const Eigen::Vector3d& v0_mm, const Eigen::Vector3d& direction,
                           const Eigen::Vector3d& normal, Matrix12d* information);

// Of the cones' touched centres and the touched points of the upper and side faces, for a noise of 1 mm a coordinate. The
// slots take no part in a calibration: they check it.
Matrix12d TouchInformation(const simulator::MachineTruth& truth, const metrology::Artefact& artefact,
                           const metrology::ArtefactTouch& touch);

// The bound on the covariance of the sensor's six parameters.
metrology::Matrix6d SensorBound(const Matrix12d& information);

// The product's view of the simulator's artefact and of what its touch probe says.
metrology::Artefact RecordOf(const simulator::ArtefactGeometry& geometry);
metrology::ArtefactTouch TouchOf(const simulator::TouchProbing& probing);

// Error of a sensor's pose in the order above.
metrology::Vector6d ErrorOf(const metrology::SensorPose& found, const simulator::MachineTruth& truth);

}  // namespace sixpoint::bench
