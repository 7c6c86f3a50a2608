#include <Eigen/LU>
#include <cmath>

#include "metrology/calibration/sensor_calibration.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// Touched centres of C1, C2, C3 (machine), and each scan's (sensor).
struct Centres {
  Points touched;
  std::vector<Points> seen;
  std::vector<Eigen::Vector3d> v0_mm;

  Eigen::Index size() const { return 3 * static_cast<Eigen::Index>(3 + 3 * seen.size()); }
  double& At(Eigen::Index i) {
    const Eigen::Index point = i / 3;
    return point < 3 ? touched[point](i % 3) : seen[(point - 3) / 3][(point - 3) % 3](i % 3);
  }
};

// Alpha and gamma from C2 and C3, beta from the two scans farthest apart in height, turned on until nothing changes; then
// T_sm from the mean of the cones (CONF 12, 14).
SensorPose Sequence(const Centres& c) {
  SensorPose sensor;
  const auto mapped = [&](size_t scan, int cone) {
    return sensor.MachineFromSensor(c.seen[scan][cone], c.v0_mm[scan]);
  };
  size_t low = 0, high = 0;
  for (size_t s = 0; s < c.seen.size(); ++s) {
    if (c.seen[s][0].z() < c.seen[low][0].z()) low = s;
    if (c.seen[s][0].z() > c.seen[high][0].z()) high = s;
  }
  for (int iteration = 0; iteration < 30; ++iteration) {
    const Eigen::Vector3d t = c.touched[2] - c.touched[1];
    Eigen::Vector3d laser = Eigen::Vector3d::Zero();
    for (size_t s = 0; s < c.seen.size(); ++s) laser += mapped(s, 2) - mapped(s, 1);
    const double alpha = std::atan(t.z() / t.y()) - std::atan(laser.z() / laser.y());
    const double gamma = std::atan(-t.x() / t.y()) - std::atan(-laser.x() / laser.y());
    // The artefact stands still: what its x moves between the heights is the turn about Y.
    double moved = 0;
    for (int k = 0; k < 3; ++k) moved += (mapped(high, k) - mapped(low, k)).x() / 3;
    const double beta = std::asin(-moved / (c.seen[high][0].z() - c.seen[low][0].z()));
    sensor.rotation = RotationFromCardan({alpha, beta, gamma}) * sensor.rotation;
    if (std::abs(alpha) + std::abs(beta) + std::abs(gamma) < 1e-12) break;
  }
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (size_t s = 0; s < c.seen.size(); ++s)
    for (int k = 0; k < 3; ++k) shift += c.touched[k] - mapped(s, k);
  sensor.t_sm_mm = shift / (3.0 * static_cast<double>(c.seen.size()));
  return sensor;
}

// First order, by central differences over every coordinate that went in.
Matrix6d CovarianceOfSequence(const Centres& centres, const SensorPose& sensor, double sigma_touch,
                              double sigma_laser) {
  constexpr double kStepMm = 1e-4;
  Matrix6d covariance = Matrix6d::Zero();
  for (Eigen::Index i = 0; i < centres.size(); ++i) {
    Centres up = centres, down = centres;
    up.At(i) += kStepMm;
    down.At(i) -= kStepMm;
    const SensorPose a = Sequence(up), b = Sequence(down);
    Vector6d slope;
    slope << VectorFromRotation(a.rotation * sensor.rotation.transpose()) -
                 VectorFromRotation(b.rotation * sensor.rotation.transpose()),
        a.t_sm_mm - b.t_sm_mm;
    slope /= 2 * kStepMm;
    const double sigma = i < 9 ? sigma_touch : sigma_laser;
    covariance += sigma * sigma * slope * slope.transpose();
  }
  return covariance;
}

}  // namespace

absl::StatusOr<SensorCalibration> CalibrateSensorSequentially(const std::vector<LineScan>& scans,
                                                              const Artefact& artefact, const ArtefactTouch& touch,
                                                              const SensorCalibrationOptions& options) {
  const absl::StatusOr<SensorStart> start = StartSensor(scans, artefact, touch);
  if (!start.ok()) return start.status();
  const std::string names[3] = {"C1", "C2", "C3"};
  Centres centres;
  for (const std::string& name : names) {
    const Eigen::Vector3d* touched = TouchedCentre(touch, name);
    if (touched == nullptr) return Refuse("touch.centres", "no " + name, "C1, C2 and C3");
    centres.touched.push_back(*touched);
  }
  if (std::abs(centres.touched[2].y() - centres.touched[1].y()) <
      0.5 * (centres.touched[2] - centres.touched[1]).norm())
    return absl::FailedPreconditionError(
        "alpha and gamma are not determined by C2 and C3: they differ too little in machine "
        "Y; turn the artefact or use method JOINT");
  SensorCalibration result;
  result.sensor = start->sensor;
  result.sensor.rotation.setIdentity();  // the paper starts from an unturned sensor
  result.machine_from_artefact = MachineFromArtefactByCones(artefact, touch);
  // Measure, compensate, measure again (CONF 14).
  for (int round = 0; round < 4; ++round) {
    if (options.keep_going && !options.keep_going()) return absl::CancelledError("sensor calibration stopped");
    centres.seen.clear();
    centres.v0_mm.clear();
    for (size_t s = 0; s < scans.size(); ++s) {
      // Where this scan shows the artefact under the rotation so far.
      Points from, onto;
      for (const PlaneFeature& cone : artefact.cones) {
        from.emplace_back(cone.centre_mm.x(), cone.centre_mm.y(), 0);
        onto.push_back(result.sensor.MachineFromSensor(start->sensor_from_artefact[s] * from.back(), scans[s].v0_mm));
      }
      const absl::StatusOr<std::vector<FeatureCentre>> found =
          MeasureCentres(scans[s], artefact, RigidFit(from, onto), result.sensor, options.optics);
      if (!found.ok()) return found.status();
      Points seen(3, Eigen::Vector3d::Zero());
      for (const FeatureCentre& f : *found)
        for (int k = 0; k < 3; ++k)
          if (f.name == names[k]) seen[k] = f.in_sensor_mm;
      centres.seen.push_back(seen);
      centres.v0_mm.push_back(scans[s].v0_mm);
    }
    const SensorPose next = Sequence(centres);
    const double moved = VectorFromRotation(next.rotation * result.sensor.rotation.transpose()).norm();
    result.sensor = next;
    result.iterations = round + 1;
    result.converged = moved < 1e-7;
    if (result.converged) break;
  }
  double squares = 0;
  for (size_t s = 0; s < scans.size(); ++s)
    for (int k = 0; k < 3; ++k)
      squares +=
          (result.sensor.MachineFromSensor(centres.seen[s][k], scans[s].v0_mm) - centres.touched[k]).squaredNorm();
  result.residual_rms_mm = std::sqrt(squares / (9.0 * static_cast<double>(scans.size())));
  result.touch_rms_mm = result.residual_rms_mm;
  result.noise_mm = options.optics.noise_mm;
  // A centre rests on thousands of readings: a twentieth of one reading's noise covers it.
  const double freedom = 9.0 * static_cast<double>(scans.size()) - 6;
  const ProbingNoise noise = TouchNoise(touch, squares, freedom);
  const double sigma_touch = noise.standard_uncertainty_mm;
  result.sensor.degrees_of_freedom = noise.degrees_of_freedom;
  result.touch_uncertainty_mm = sigma_touch;
  result.sensor.covariance = CovarianceOfSequence(centres, result.sensor, sigma_touch, options.optics.noise_mm / 20);
  result.condition_number = ConditionNumber(result.sensor.covariance);
  result.angles = CardanFromRotation(result.sensor.rotation);
  result.angle_uncertainty = CardanUncertainty(result.angles, result.sensor.covariance.topLeftCorner<3, 3>());
  for (const LineScan& scan : scans) result.points_used += scan.points_mm.size();
  if (absl::Status s = ReportCentres(scans, artefact, touch, options, &result); !s.ok()) return s;
  return result;
}

}  // namespace sixpoint::metrology
