#include "metrology/studies/artefact_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "metrology/calibration/feature_search.h"
#include "metrology/linear_algebra/inverse.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr double kMarginMm = 0.05;  // as the calibration's: what a laser spot blurs at an edge
constexpr double kFirstReachMm = 0.4;
constexpr double kLeastNoiseMm = 1e-5;
constexpr int kMostFitIterations = 40;
constexpr double kSettledMm = 1e-6;     // a thousandth of what counts, at 10 mm
constexpr double kSettledSigma = 0.02;  // of the solution
constexpr double kEnoughSigma =
    0.1;  // and where it will not settle further: a reading that comes and goes moves a weak direction most
constexpr std::size_t kFewestPoints = 1000;
constexpr double kGrazing = 0.2;
constexpr double kLeastDetermined = 1e-7;  // of the information; dbeta from the cones' depth has about 1e-3

// What is fitted: the artefact's pose to the first scan, then the sensor's to each.
struct State {
  SensorPose sensor;
  Eigen::Isometry3d machine_from_artefact = Eigen::Isometry3d::Identity();
};
enum class Unknown { kArtefact, kSensor };

State Moved(const State& state, const Vector6d& w, Unknown unknown) {
  State next = state;
  if (unknown == Unknown::kArtefact) {
    next.machine_from_artefact = Perturbed(state.machine_from_artefact, w, state.machine_from_artefact.translation());
  } else {
    next.sensor.rotation = RotationFromVector(w.head<3>()) * state.sensor.rotation;
    next.sensor.t_sm_mm += w.tail<3>();
  }
  return next;
}

absl::Status Failed(const std::string& scan, const std::string& what) {
  return absl::FailedPreconditionError("scans: " + scan + ": " + what);
}

// The sighting is in the sheared frame of the sensor: carried over point by point.
absl::StatusOr<Eigen::Isometry3d> StartPose(const LineScan& scan, const Artefact& artefact, const SensorPose& sensor) {
  const absl::StatusOr<ArtefactSighting> sighting = FindArtefact(scan, artefact);
  if (!sighting.ok()) return Failed(scan.id, std::string(sighting.status().message()));
  Points in_artefact, in_machine;
  for (const PlaneFeature& cone : artefact.cones)
    for (const double z : {0.0, 5.0}) {
      in_artefact.emplace_back(cone.centre_mm.x(), cone.centre_mm.y(), z);
      in_machine.push_back(sensor.MachineFromSensor(sighting->sensor_from_artefact * in_artefact.back(), scan.v0_mm));
    }
  return RigidFit(in_artefact, in_machine);
}

struct Equations {
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  Eigen::Matrix<double, 6, kFieldParameterCount> field = Eigen::Matrix<double, 6, kFieldParameterCount>::Zero();
  std::vector<double> readings;  // along the rays
};

Equations EquationsAt(const LineScan& scan, const Artefact& artefact, const LineSensorOptics& optics,
                      const State& state, Unknown unknown, double reach_mm) {
  Equations eq;
  const Eigen::Isometry3d& pose = state.machine_from_artefact;
  const ArtefactFromSensor map(pose, state.sensor, scan.v0_mm);
  const bool has_field = state.sensor.field.half_range_mm > 0;
  for (const Eigen::Vector3d& p : scan.points_mm) {
    const FaceHit hit = HitFace(artefact, map * p, kMarginMm);
    if (hit.face == FaceHit::Face::kNone) continue;
    const double along_ray = hit.normal.dot(map.linear * optics.RayAt(p));
    if (std::abs(along_ray) < kGrazing) continue;
    const double reading = hit.distance_mm / along_ray;
    if (std::abs(reading) > reach_mm) continue;
    const Eigen::Vector3d n = pose.linear() * hit.normal;
    Vector6d row;
    if (unknown == Unknown::kArtefact) {
      const Eigen::Vector3d arm = state.sensor.MachineFromSensor(p, scan.v0_mm) - pose.translation();
      row << -arm.cross(n), -n;
    } else {
      row = state.sensor.ParameterJacobian(p).transpose() * n;
    }
    row /= along_ray;
    eq.normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
    if (has_field) eq.field += row * (n.transpose() * state.sensor.FieldJacobian(p)) / along_ray;
    eq.right -= reading * row;
    eq.readings.push_back(std::abs(reading));
  }
  eq.normal = eq.normal.selfadjointView<Eigen::Lower>();
  return eq;
}

absl::StatusOr<ArtefactFit> FitState(const LineScan& scan, const Artefact& artefact, const LineSensorOptics& optics,
                                     State state, Unknown unknown) {
  double reach_mm = kFirstReachMm, last_reach_mm = 0;
  for (int iteration = 0; iteration < kMostFitIterations; ++iteration) {
    const Equations eq = EquationsAt(scan, artefact, optics, state, unknown, reach_mm);
    if (eq.readings.size() < kFewestPoints)
      return Failed(scan.id, std::to_string(eq.readings.size()) + " points on the artefact, want at least 1000");
    // Angles counted as their effect at kArtefactLever_mm.
    Vector6d scale;
    scale << Eigen::Vector3d::Constant(1 / kArtefactLever_mm), Eigen::Vector3d::Ones();
    const EigenSystem6 eigen = EigenSystemOf(Matrix6d(scale.asDiagonal() * eq.normal * scale.asDiagonal()));
    if (eigen.values(0) < kLeastDetermined * eigen.values(5))
      return Failed(scan.id, "its points do not determine the pose, want cones in view");
    const Vector6d step = SolvePositiveDefinite(eq.normal, eq.right);
    state = Moved(state, step, unknown);
    const double sigma_mm = std::max(kLeastNoiseMm, RobustSigmaOfMagnitudes(eq.readings));
    // Points at the gate may come and go for ever: what they move is nothing beside the pose's own uncertainty.
    const bool settled = std::max(kArtefactLever_mm * step.head<3>().norm(), step.tail<3>().norm()) < kSettledMm ||
                         std::sqrt(step.dot(eq.normal * step)) <
                             (iteration < kMostFitIterations / 2 ? kSettledSigma : kEnoughSigma) * sigma_mm;
    if (settled && reach_mm == last_reach_mm) {
      double squares = 0;
      for (const double r : eq.readings) squares += r * r;
      const double freedom = static_cast<double>(eq.readings.size()) - 6;
      const Matrix6d inverse = Inverse(eq.normal);
      return ArtefactFit{state.sensor, state.machine_from_artefact, squares / freedom * inverse, -inverse * eq.field,
                         std::sqrt(squares / freedom)};
    }
    last_reach_mm = reach_mm;
    // Frozen after some.
    if (iteration < kMostFitIterations / 4) reach_mm = std::clamp(5 * sigma_mm, 5e-5, kFirstReachMm);
  }
  return Failed(scan.id, "the pose does not settle, want a scan without so many stray points");
}

}  // namespace

absl::StatusOr<ArtefactFit> FitArtefactPose(const LineScan& scan, const Artefact& artefact,
                                            const LineSensorOptics& optics, const SensorPose& sensor) {
  const absl::StatusOr<Eigen::Isometry3d> start = StartPose(scan, artefact, sensor);
  if (!start.ok()) return start.status();
  return FitState(scan, artefact, optics, {sensor, *start}, Unknown::kArtefact);
}

absl::Status CheckShown(const LineScan& scan, const Artefact& artefact, const SensorPose& sensor) {
  return StartPose(scan, artefact, sensor).status();
}

absl::StatusOr<ArtefactFit> FitSensorPose(const LineScan& scan, const Artefact& artefact,
                                          const LineSensorOptics& optics, const SensorPose& start,
                                          const Eigen::Isometry3d& machine_from_artefact) {
  return FitState(scan, artefact, optics, {start, machine_from_artefact}, Unknown::kSensor);
}

}  // namespace sixpoint::metrology
