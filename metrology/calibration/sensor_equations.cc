#include "metrology/calibration/sensor_equations.h"

#include <algorithm>
#include <cmath>

#include "metrology/calibration/feature_centres.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr size_t kChunkPoints = 1 << 15;

// Of a reading on a face with this normal, machine frame.
Vector12d RowOf(const SensorState& state, const LineScan& scan, const Eigen::Vector3d& reference,
                const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
  const Eigen::Vector3d arm = state.sensor.rotation.col(1) * p.y() + state.sensor.rotation.col(2) * p.z();
  const Eigen::Vector3d at = state.sensor.MachineFromSensor(p, scan.v0_mm);
  Vector12d row;
  row << arm.cross(n), n, -(at - reference).cross(n), -n;
  return row;
}

// The rows of points [begin, end) of one scan. Upper-face rows are linear in (x, y, z, 1) of the sensor, so their normal
// equations are carried as moments.
SensorEquations ScanEquations(const LineScan& scan, size_t begin, size_t end, const Artefact& artefact,
                              const SensorState& state, const LineSensorOptics& optics, const Gate& gate,
                              std::vector<double>* whitened) {
  SensorEquations eq;
  eq.cone_counts.assign(artefact.cones.size(), 0);
  eq.cone_seen.assign(artefact.cones.size(), 0);
  const ArtefactFromSensor map(state.machine_from_artefact, state.sensor, scan.v0_mm);
  const Eigen::Matrix3d& turn = state.machine_from_artefact.linear();
  const Eigen::Vector3d reference = state.machine_from_artefact.translation();
  const auto row_of = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    return RowOf(state, scan, reference, p, n);
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

// A reading that counts. in_artefact_mm and the normal: artefact frame.
struct Reading {
  Eigen::Vector3d sensor_mm, in_artefact_mm, normal;
  double distance_mm = 0, along_ray = 0;
  bool upper = false;
};

// Every gate.stride-th.
template <typename Take>
void ForEachReading(const LineScan& scan, const Artefact& artefact, const SensorState& state,
                    const LineSensorOptics& optics, const Gate& gate, const Take& take) {
  const ArtefactFromSensor map(state.machine_from_artefact, state.sensor, scan.v0_mm);
  for (size_t i = 0; i < scan.points_mm.size(); i += gate.stride) {
    Reading reading;
    reading.sensor_mm = scan.points_mm[i];
    reading.in_artefact_mm = map * reading.sensor_mm;
    const FaceHit hit = HitFace(artefact, reading.in_artefact_mm, gate.margin_mm);
    if (hit.face == FaceHit::Face::kNone) continue;
    reading.upper = hit.face == FaceHit::Face::kUpper;
    reading.normal = reading.upper ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(hit.normal);
    reading.along_ray = reading.normal.dot(map.linear * optics.RayAt(reading.sensor_mm));
    reading.distance_mm = hit.distance_mm;
    if (std::abs(reading.along_ray) < 0.2 || std::abs(hit.distance_mm / reading.along_ray) > gate.reach_mm) continue;
    take(reading);
  }
}

}  // namespace

SensorEquations LaserEquations(const std::vector<LineScan>& scans, const Artefact& artefact, const SensorState& state,
                               const SensorCalibrationOptions& options, const Gate& gate, double* median_reading) {
  struct Chunk {
    size_t scan, begin, end;
    SensorEquations equations;
    std::vector<double> readings;
  };
  std::vector<Chunk> chunks;
  const size_t length = kChunkPoints * gate.stride;
  for (size_t s = 0; s < scans.size(); ++s)
    for (size_t begin = 0; begin < scans[s].points_mm.size(); begin += length)
      chunks.push_back({s, begin, std::min(begin + length, scans[s].points_mm.size()), {}, {}});
  ForEach(chunks.size(), options.threads, [&](size_t k) {
    Chunk& c = chunks[k];
    c.equations = ScanEquations(scans[c.scan], c.begin, c.end, artefact, state, options.optics, gate,
                                median_reading == nullptr ? nullptr : &c.readings);
  });
  SensorEquations all;
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

FieldPulls FieldPull(const std::vector<LineScan>& scans, const Artefact& artefact, const SensorState& state,
                     const SensorCalibrationOptions& options, const Gate& gate) {
  FieldPulls pull = FieldPulls::Zero();
  const Eigen::Vector3d reference = state.machine_from_artefact.translation();
  for (const LineScan& scan : scans)
    ForEachReading(scan, artefact, state, options.optics, gate, [&](const Reading& reading) {
      const Eigen::Vector3d& p = reading.sensor_mm;
      const Eigen::Vector3d n = state.machine_from_artefact.linear() * reading.normal;
      const double weight = static_cast<double>(gate.stride) / (reading.along_ray * reading.along_ray);
      pull -= weight * n.dot(state.sensor.rotation.col(2)) * RowOf(state, scan, reference, p, n) *
              state.sensor.field.SeriesAt(p.y(), p.z());
    });
  return pull;
}

std::vector<FieldResidual> FieldResidualsOf(const std::vector<LineScan>& scans, const Artefact& artefact,
                                            const SensorState& state, const SensorCalibrationOptions& options,
                                            const Gate& gate, double noise_mm, const FieldPulls& response) {
  constexpr int kAcross = 16;     // places along y, and along z: a field of the sixth order bends little within one
  constexpr double kFewest = 30;  // readings
  const ScannerField& field = state.sensor.field;
  const auto along = [](double t, double half) {
    return std::clamp(static_cast<int>(std::floor((t / half + 1) / 2 * kAcross)), 0, kAcross - 1);
  };
  const Eigen::Vector3d reference = state.machine_from_artefact.translation();
  std::vector<FieldResidual> residuals;
  for (const LineScan& scan : scans) {
    std::vector<std::pair<double, FieldResidual>> places(static_cast<std::size_t>(kAcross * kAcross));
    ForEachReading(scan, artefact, state, options.optics, gate, [&](const Reading& reading) {
      if (!reading.upper) return;
      const Eigen::Vector3d& p = reading.sensor_mm;
      const Eigen::Vector3d n = state.machine_from_artefact.linear() * reading.normal;
      auto& [count, mean] = places[static_cast<std::size_t>(kAcross * along(p.y(), field.half_width_mm) +
                                                            along(p.z(), field.half_range_mm))];
      ++count;
      mean.off_mm += reading.distance_mm / reading.along_ray;
      mean.by_field += (n.dot(state.sensor.rotation.col(2)) * field.SeriesAt(p.y(), p.z()) +
                        RowOf(state, scan, reference, p, n).transpose() * response) /
                       reading.along_ray;
      mean.by_flatness +=
          FlatnessTermsAt(reading.in_artefact_mm.head<2>() / (artefact.side_mm / 2)) / reading.along_ray;
    });
    for (auto& [count, mean] : places) {
      if (count < kFewest) continue;
      residuals.push_back(
          {mean.off_mm / count, mean.by_field / count, mean.by_flatness / count, noise_mm * noise_mm / count, true});
    }
  }
  return residuals;
}

TouchEquations EquationsOfTouch(const Artefact& artefact, const ArtefactTouch& touch, const SensorState& state) {
  TouchEquations out;
  const Eigen::Isometry3d& pose = state.machine_from_artefact;
  const Eigen::Vector3d reference = pose.translation();
  const auto add = [&](const Vector12d& row, double residual, const std::string& name) {
    out.equations.Add(row, residual, 1);
    out.rows.emplace_back(row, residual);
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

std::vector<Eigen::Matrix<double, 12, 3>> TouchedCentrePulls(const Artefact& artefact, const SensorState& state) {
  std::vector<Eigen::Matrix<double, 12, 3>> pulls;
  const Eigen::Isometry3d& pose = state.machine_from_artefact;
  for (const PlaneFeature& cone : artefact.cones) {
    const Eigen::Vector3d centre = pose * Eigen::Vector3d(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    pulls.emplace_back(Eigen::Matrix<double, 12, 3>::Zero()).bottomRows<6>() =
        PointJacobian(centre, pose.translation()).transpose();
  }
  return pulls;
}

}  // namespace sixpoint::metrology
