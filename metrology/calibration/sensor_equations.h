// Normal equations of a sensor's calibration: what laser readings and touched points say of the sensor's and the artefact's
// poses.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "metrology/calibration/field_estimate.h"
#include "metrology/calibration/sensor_calibration.h"

namespace sixpoint::metrology {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

// Order of the unknowns: rotation vector of R_sm, T_sm, then the artefact's pose (rotation vector about its origin,
// translation), all in machine axes.
struct SensorState {
  SensorPose sensor;
  Eigen::Isometry3d machine_from_artefact;

  SensorState Perturbed(const Vector12d& w) const {
    SensorState next = *this;
    next.sensor.rotation = RotationFromVector(w.head<3>()) * sensor.rotation;
    next.sensor.t_sm_mm += w.segment<3>(3);
    next.machine_from_artefact =
        metrology::Perturbed(machine_from_artefact, w.tail<6>(), machine_from_artefact.translation());
    return next;
  }
};

// Weighted normal equations. Laser rows are divided by n . ray only; sigma enters when they are joined.
struct SensorEquations {
  Matrix12d normal = Matrix12d::Zero();
  Vector12d right = Vector12d::Zero();
  double squares = 0;  // of the whitened residuals
  double distance_squares = 0;
  std::size_t count = 0;
  std::vector<std::size_t> cone_counts, cone_seen;  // used, and seen where the wall should be

  void Add(const Vector12d& row, double residual, double weight) {
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    right -= weight * residual * row;
  }
  void Join(const SensorEquations& o, double scale) {
    normal += scale * o.normal;
    right += scale * o.right;
  }
};

// Which readings count.
struct Gate {
  size_t stride = 1;
  // From a face's edge. Two or three readings wide: what a laser spot blurs there. Costs 7 % of the angles' variance, 3.6 % over
  // all six parameters (`bench/run calibration`): the estimate's whole distance from the bound of all readings.
  double margin_mm = 0.05;
  double reach_mm = 0;  // greatest |distance along the ray| that counts
};

// All scans, in fixed chunks joined in order: the same bits on any number of threads. Counts of cones are scan by scan. The
// median of the readings where it is asked for.
SensorEquations LaserEquations(const std::vector<LineScan>& scans, const Artefact& artefact, const SensorState& state,
                               const SensorCalibrationOptions& options, const Gate& gate, double* median_reading);

// How the right-hand side follows each term of the field's series, for a standard deviation of 1 mm along the ray; from every stride-th
// reading, as many times.
using FieldPulls = Eigen::Matrix<double, 12, kFieldSeriesCount>;
FieldPulls FieldPull(const std::vector<LineScan>& scans, const Artefact& artefact, const SensorState& state,
                     const SensorCalibrationOptions& options, const Gate& gate);
// Readings of the upper face, the mean of each scan's at each place of the measuring field; response: of the solution to the series.
std::vector<FieldResidual> FieldResidualsOf(const std::vector<LineScan>& scans, const Artefact& artefact,
                                            const SensorState& state, const SensorCalibrationOptions& options,
                                            const Gate& gate, double noise_mm, const FieldPulls& response);

// Touched cone centres, upper and side faces, for a standard uncertainty of 1 mm.
struct TouchEquations {
  SensorEquations equations;
  std::vector<std::pair<Vector12d, double>> rows;  // and how far off each is, mm
  double worst_mm = 0;
  std::string worst;
};
TouchEquations EquationsOfTouch(const Artefact& artefact, const ArtefactTouch& touch, const SensorState& state);
// 12 x 3 a cone: how the right-hand side follows each coordinate of its touched centre.
std::vector<Eigen::Matrix<double, 12, 3>> TouchedCentrePulls(const Artefact& artefact, const SensorState& state);

}  // namespace sixpoint::metrology
