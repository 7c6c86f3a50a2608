#include "metrology/calibration/sensor_calibration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;

constexpr double kLeverMm = 10;  // half the artefact: what an angle means in mm
constexpr double kDegrees = M_PI / 180;
constexpr size_t kFewestConePoints = 200;
constexpr double kLeastAgreeing = 0.5;  // of the points seen where a cone's wall should be
// Two or three readings wide: what a laser spot blurs at an edge. Costs 7 % of the angles' variance, 3.6 % over all six
// parameters (`bench/run calibration`): the estimate's whole distance from the bound of all readings.
constexpr double kMarginMm = 0.05;
// Of the readings that count. Costs one in sixteen thousand good ones; what passes it among reflections is a bias.
constexpr double kGateSigma = 4;
// Below a reading's rounding; keeps the weights finite where a cloud has no noise.
constexpr double kLeastNoiseMm = 1e-5;
constexpr size_t kChunkPoints = 1 << 15;

// Order of the unknowns: rotation vector of R_sm, T_sm, then the artefact's pose (rotation vector about its origin,
// translation), all in machine axes.
struct State {
  SensorPose sensor;
  Eigen::Isometry3d machine_from_artefact;

  State Perturbed(const Vector12d& w) const {
    State next = *this;
    next.sensor.rotation = RotationFromVector(w.head<3>()) * sensor.rotation;
    next.sensor.t_sm_mm += w.segment<3>(3);
    next.machine_from_artefact =
        metrology::Perturbed(machine_from_artefact, w.tail<6>(), machine_from_artefact.translation());
    return next;
  }
};

// Weighted normal equations. Laser rows are divided by n . ray only; sigma enters when they are joined.
struct Equations {
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
  void Join(const Equations& o, double scale) {
    normal += scale * o.normal;
    right += scale * o.right;
  }
};

struct Gate {
  size_t stride = 1;
  double margin_mm = kMarginMm;
  double reach_mm = 0;  // greatest |distance along the ray| that counts
};

// The rows of points [begin, end) of one scan. Upper-face rows are linear in (x, y, z, 1) of the sensor, so their normal
// equations are carried as moments.
Equations LaserEquations(const LineScan& scan, size_t begin, size_t end, const Artefact& artefact, const State& state,
                         const LineSensorOptics& optics, const Gate& gate, std::vector<double>* whitened) {
  Equations eq;
  eq.cone_counts.assign(artefact.cones.size(), 0);
  eq.cone_seen.assign(artefact.cones.size(), 0);
  const ArtefactFromSensor map(state.machine_from_artefact, state.sensor, scan.v0_mm);
  const Eigen::Matrix3d& turn = state.machine_from_artefact.linear();
  const Eigen::Vector3d reference = state.machine_from_artefact.translation();
  const auto row_of = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    const Eigen::Vector3d arm = state.sensor.rotation.col(1) * p.y() + state.sensor.rotation.col(2) * p.z();
    const Eigen::Vector3d at = state.sensor.MachineFromSensor(p, scan.v0_mm);
    Vector12d row;
    row << arm.cross(n), n, -(at - reference).cross(n), -n;
    return row;
  };
  const Eigen::Vector3d upper_ray = (map.linear.row(2)).transpose();  // n . (map of a sensor direction)
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  Eigen::Vector4d moment_residual = Eigen::Vector4d::Zero();
  for (size_t i = begin; i < end; i += gate.stride) {
    const Eigen::Vector3d& p = scan.points_mm[i];
    const Eigen::Vector3d at = map * p;
    const FaceHit hit = HitFace(artefact, at, gate.margin_mm);
    if (hit.face == FaceHit::Face::kNone) continue;
    const Eigen::Vector3d ray = optics.RayAt(p);
    const bool upper = hit.face == FaceHit::Face::kUpper;
    const double along_ray = upper ? upper_ray.dot(ray) : hit.normal.dot(map.linear * ray);
    if (std::abs(along_ray) < 0.2) continue;  // grazing
    const double reading = hit.distance_mm / along_ray;
    if (!upper && std::abs(reading) < 0.4) ++eq.cone_seen[hit.cone];
    if (std::abs(reading) > gate.reach_mm) continue;
    const double weight = 1 / (along_ray * along_ray);
    if (upper) {
      const Eigen::Vector4d q(p.x(), p.y(), p.z(), 1);
      moments.noalias() += (weight * q) * q.transpose();
      moment_residual += (weight * hit.distance_mm) * q;
    } else {
      eq.Add(row_of(p, turn * hit.normal), hit.distance_mm, weight);
      ++eq.cone_counts[hit.cone];
    }
    eq.squares += reading * reading;
    eq.distance_squares += hit.distance_mm * hit.distance_mm;
    ++eq.count;
    if (whitened != nullptr) whitened->push_back(std::abs(reading));
  }
  // row = slope * (x, y, z, 1): four points give the affine map exactly.
  Eigen::Matrix<double, 12, 4> slope;
  slope.col(3) = row_of(Eigen::Vector3d::Zero(), turn.col(2));
  for (int k = 0; k < 3; ++k) slope.col(k) = row_of(Eigen::Vector3d::Unit(k), turn.col(2)) - slope.col(3);
  eq.normal = eq.normal.selfadjointView<Eigen::Lower>();
  eq.normal += slope * moments * slope.transpose();
  eq.right -= slope * moment_residual;
  return eq;
}

// All scans, in fixed chunks joined in order: the same bits on any number of threads.
Equations LaserEquations(const std::vector<LineScan>& scans, const Artefact& artefact, const State& state,
                         const SensorCalibrationOptions& options, const Gate& gate, double* median_reading) {
  struct Chunk {
    size_t scan, begin, end;
    Equations equations;
    std::vector<double> readings;
  };
  std::vector<Chunk> chunks;
  const size_t length = kChunkPoints * gate.stride;
  for (size_t s = 0; s < scans.size(); ++s)
    for (size_t begin = 0; begin < scans[s].points_mm.size(); begin += length)
      chunks.push_back({s, begin, std::min(begin + length, scans[s].points_mm.size()), {}, {}});
  ForEach(chunks.size(), options.threads, [&](size_t k) {
    Chunk& c = chunks[k];
    c.equations = LaserEquations(scans[c.scan], c.begin, c.end, artefact, state, options.optics, gate,
                                 median_reading == nullptr ? nullptr : &c.readings);
  });
  Equations all;
  std::vector<double> readings;
  all.cone_counts.assign(scans.size() * artefact.cones.size(), 0);
  all.cone_seen = all.cone_counts;
  for (const Chunk& c : chunks) {
    all.Join(c.equations, 1);
    all.squares += c.equations.squares;
    all.distance_squares += c.equations.distance_squares;
    all.count += c.equations.count;
    for (size_t k = 0; k < artefact.cones.size(); ++k) {
      all.cone_counts[c.scan * artefact.cones.size() + k] += c.equations.cone_counts[k];
      all.cone_seen[c.scan * artefact.cones.size() + k] += c.equations.cone_seen[k];
    }
    readings.insert(readings.end(), c.readings.begin(), c.readings.end());
  }
  if (median_reading != nullptr && !readings.empty()) *median_reading = UpperMedian(std::move(readings));
  return all;
}

// Touched cone centres, upper and side faces, for a standard uncertainty of 1 mm.
struct TouchEquations {
  Equations equations;
  double worst_mm = 0;
  std::string worst;
};
TouchEquations EquationsOfTouch(const Artefact& artefact, const ArtefactTouch& touch, const State& state) {
  TouchEquations out;
  const Eigen::Isometry3d& pose = state.machine_from_artefact;
  const Eigen::Vector3d reference = pose.translation();
  const auto add = [&](const Vector12d& row, double residual, const std::string& name) {
    out.equations.Add(row, residual, 1);
    out.equations.squares += residual * residual;
    ++out.equations.count;
    if (std::abs(residual) <= out.worst_mm) return;
    out.worst_mm = std::abs(residual);
    out.worst = name;
  };
  for (const PlaneFeature& cone : artefact.cones) {
    const Eigen::Vector3d centre = pose * Eigen::Vector3d(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    const Eigen::Vector3d difference = centre - *TouchedCentre(touch, cone.name);
    const Eigen::Matrix<double, 3, 6> jacobian = PointJacobian(centre, reference);
    for (int k = 0; k < 3; ++k) {
      Vector12d row = Vector12d::Zero();
      row.tail<6>() = jacobian.row(k).transpose();
      add(row, difference(k), "touch.centres[" + cone.name + "]");
    }
  }
  const auto face = [&](const Points& points, int axis, double offset, const std::string& name) {
    for (size_t i = 0; i < points.size(); ++i) {
      // Which of the two opposite faces was probed shows in the points.
      const double at = (pose.inverse() * points[i])(axis);
      const double side = at < 0 ? -offset : offset;
      const Eigen::Vector3d n = pose.linear().col(axis);
      Vector12d row = Vector12d::Zero();
      row.tail<6>() << -(points[i] - reference).cross(n), -n;
      add(row, at - side, name + "[" + std::to_string(i) + "]");
    }
  };
  face(touch.plane_mm, 2, 0, "touch.plane_mm");
  face(touch.side_x_mm, 0, artefact.side_mm / 2, "touch.side_x_mm");
  face(touch.side_y_mm, 1, artefact.side_mm / 2, "touch.side_y_mm");
  out.equations.normal = out.equations.normal.selfadjointView<Eigen::Lower>();
  return out;
}

// Units of one: mm, and an angle that moves the lever's end by 1 mm.
Vector12d Scale() {
  Vector12d scale = Vector12d::Ones();
  scale.head<3>().setConstant(1 / kLeverMm);
  scale.segment<3>(6).setConstant(1 / kLeverMm);
  return scale;
}

const char* const kParameters[6] = {"alpha (turn about machine X)",
                                    "beta (turn about machine Y)",
                                    "gamma (turn about machine Z)",
                                    "T_sm x",
                                    "T_sm y",
                                    "T_sm z"};

// The parameters that the data leave undetermined: their standard uncertainty is useless.
absl::Status CheckDetermined(const Matrix6d& covariance, double condition, double sigma_touch) {
  constexpr double kLimitMm = 0.02;
  std::string names;
  for (int k = 0; k < 6; ++k) {
    const double sigma = std::sqrt(covariance(k, k));
    if (sigma * (k < 3 ? kLeverMm : 1) <= kLimitMm) continue;
    names += (names.empty() ? "" : ", ") + std::string(kParameters[k]) + " to " +
             (k < 3 ? Rounded(sigma / kDegrees) + " deg" : Rounded(sigma) + " mm");
  }
  if (names.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError("not determined by these data: " + names + " (standard uncertainties; want " +
                                       Rounded(kLimitMm / kLeverMm / kDegrees) + " deg and " + Rounded(kLimitMm) +
                                       " mm), condition number " + Rounded(condition) +
                                       "; touched coordinates count with " + Rounded(1e3 * sigma_touch) +
                                       " um: probe the artefact again, with more points on its upper and side faces");
}

// Too few readings agree with a cone's wall: because it was not seen, or because it is another wall.
absl::Status TooFew(const LineScan& scan, const PlaneFeature& cone, size_t used, size_t seen) {
  const std::string where = "scan " + scan.id + ": only " + std::to_string(used) + " of " + std::to_string(seen) +
                            " points on cone " + cone.name + "'s wall agree with the artefact's record, want at least ";
  if (seen < kFewestConePoints)
    return absl::FailedPreconditionError(where + std::to_string(kFewestConePoints) + "; scan it whole");
  return absl::FailedPreconditionError(where + Rounded(100 * kLeastAgreeing) +
                                       " %: check cone_half_angle_deg and cone_top_radius_mm, clean the artefact, "
                                       "see that all scans are by this machine's sensor");
}

}  // namespace

absl::StatusOr<SensorCalibration> CalibrateSensor(const std::vector<LineScan>& scans, const Artefact& artefact,
                                                  const ArtefactTouch& touch, const SensorCalibrationOptions& options) {
  const absl::StatusOr<SensorStart> start = StartSensor(scans, artefact, touch);
  if (!start.ok()) return start.status();
  State state{start->sensor, MachineFromArtefactByCones(artefact, touch)};
  size_t points = 0;
  for (const LineScan& scan : scans) points += scan.points_mm.size();

  // Coarse: an even sample, wide gates that close with the median; then all points at four sigma.
  SensorCalibration result;
  Gate gate{std::max<size_t>(1, points / 40000) | 1, 0.3, 0.4};
  double sigma_laser = options.optics.noise_mm;
  double sigma_touch = TouchUncertainty(touch.standard_uncertainty_mm, 0, 0), touch_freedom = 1;
  Matrix12d information = Matrix12d::Zero();
  std::vector<std::size_t> cone_used, cone_seen;
  bool fine = false;
  constexpr int kMostIterations = 40;
  for (int iteration = 0; iteration < kMostIterations && !result.converged; ++iteration) {
    if (options.keep_going && !options.keep_going()) return absl::CancelledError("sensor calibration stopped");
    double median = 0;
    const Equations laser = LaserEquations(scans, artefact, state, options, gate, fine ? nullptr : &median);
    const TouchEquations touched = EquationsOfTouch(artefact, touch, state);
    for (size_t s = 0; s < scans.size(); ++s)
      for (size_t k = 0; k < artefact.cones.size(); ++k)
        if (laser.cone_counts[s * artefact.cones.size() + k] * gate.stride < kFewestConePoints)
          return TooFew(scans[s], artefact.cones[k], laser.cone_counts[s * artefact.cones.size() + k] * gate.stride,
                        laser.cone_seen[s * artefact.cones.size() + k] * gate.stride);
    cone_used = laser.cone_counts;
    cone_seen = laser.cone_seen;
    sigma_laser = fine ? std::sqrt(laser.squares / static_cast<double>(laser.count)) : median * kSigmaPerMad;
    sigma_laser = std::max(sigma_laser, kLeastNoiseMm);
    result.touch_rms_mm = std::sqrt(touched.equations.squares / touch_freedom);
    if (fine) sigma_touch = TouchUncertainty(touch.standard_uncertainty_mm, touched.equations.squares, touch_freedom);
    Equations all;
    all.Join(laser, 1 / (sigma_laser * sigma_laser));
    all.Join(touched.equations, 1 / (sigma_touch * sigma_touch));
    const Vector12d scale = Scale();
    information = scale.asDiagonal() * all.normal * scale.asDiagonal();
    const Eigen::LDLT<Matrix12d> solver(information);
    const Vector12d step = solver.solve(Vector12d(scale.cwiseProduct(all.right)));
    if (solver.info() != Eigen::Success || !step.allFinite() || step.cwiseAbs().maxCoeff() > 5)
      return absl::FailedPreconditionError("the sensor's pose is not determined by these scans and touch points");
    state = state.Perturbed(scale.cwiseProduct(step));
    // What the touched coordinates alone decided is spent (the trace of their part of the solution): of the artefact's pose
    // mostly its place, for the laser holds its turn.
    const Matrix12d touch_part = scale.asDiagonal() * touched.equations.normal * scale.asDiagonal();
    const double spent = solver.solve(touch_part).trace() / (sigma_touch * sigma_touch);
    touch_freedom = std::max(1.0, static_cast<double>(touched.equations.count) - spent);
    result.iterations = iteration + 1;
    result.points_used = laser.count;
    result.residual_rms_mm = std::sqrt(laser.distance_squares / static_cast<double>(laser.count));
    // In standard deviations of the solution: below a thousandth nothing that is reported changes.
    const double moved = std::sqrt(std::max(0.0, step.dot(information * step)));
    if (fine) {
      gate.reach_mm = kGateSigma * sigma_laser;
      result.converged = moved < 1e-3;
    } else {
      // Step by step: reflections in a cone pull the first steps by more than the upper face's small residuals tell.
      const double enough_mm = std::max(6 * sigma_laser, 0.01);
      const bool closed = gate.reach_mm <= enough_mm;
      gate.reach_mm = std::min(gate.reach_mm, std::max(enough_mm, 0.4 * gate.reach_mm));
      if ((moved > 0.5 || !closed) && iteration < 25) continue;
      fine = true;
      gate = {1, kMarginMm, kGateSigma * sigma_laser};
    }
  }
  for (size_t i = 0; i < cone_seen.size(); ++i)
    if (static_cast<double>(cone_used[i]) < kLeastAgreeing * static_cast<double>(cone_seen[i]))
      return TooFew(scans[i / artefact.cones.size()], artefact.cones[i % artefact.cones.size()], cone_used[i],
                    cone_seen[i]);
  // Residuals four sigma wide hide what does not belong; these limits say when the artefact is not the recorded one.
  const double greatest_noise = std::max(5 * options.optics.noise_mm, 0.01);
  if (sigma_laser > greatest_noise)
    return absl::FailedPreconditionError("laser readings scatter by " + Rounded(1e3 * sigma_laser) +
                                         " um about the artefact's record, want at most " +
                                         Rounded(1e3 * greatest_noise) + " um: is it this artefact, and this sensor?");
  const TouchEquations touched = EquationsOfTouch(artefact, touch, state);
  if (const double limit = std::max(0.02, 8 * sigma_touch); touched.worst_mm > limit)
    return absl::FailedPreconditionError(touched.worst + ": " + Rounded(1e3 * touched.worst_mm) +
                                         " um from the artefact's record, want at most " + Rounded(1e3 * limit) +
                                         " um: probe it again");
  result.sensor = state.sensor;
  result.machine_from_artefact = state.machine_from_artefact;
  result.noise_mm = sigma_laser;
  result.touch_uncertainty_mm = sigma_touch;
  result.angles = CardanFromRotation(state.sensor.rotation);
  const Matrix12d inverse = information.ldlt().solve(Matrix12d::Identity());
  const Vector12d scale = Scale();
  const Matrix12d covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
  result.sensor.covariance = covariance.topLeftCorner<6, 6>();
  result.sensor.covariance = (result.sensor.covariance + result.sensor.covariance.transpose().eval()) / 2;
  result.condition_number = ConditionNumber(result.sensor.covariance);
  if (absl::Status s = CheckDetermined(result.sensor.covariance, result.condition_number, sigma_touch); !s.ok())
    return s;
  result.angle_uncertainty = CardanUncertainty(result.angles, result.sensor.covariance.topLeftCorner<3, 3>());
  if (absl::Status s = ReportCentres(scans, artefact, touch, options, &result); !s.ok()) return s;
  return result;
}

}  // namespace sixpoint::metrology
