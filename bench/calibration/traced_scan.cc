#include "bench/calibration/traced_scan.h"

#include <Eigen/LU>
#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/parallel/loops.h"
#include "simulator/random.h"

namespace sixpoint::bench {
namespace {

using metrology::kRadPerDeg;
constexpr double kGrazing = 0.2;  // as the simulator's
constexpr double kSpot_mm = 0.05;
using Vector12d = Eigen::Matrix<double, 12, 1>;

// Whether a point of the artefact (its frame) lies on the upper face or a cone's wall, away from every edge.
bool WithinAFace(const simulator::ArtefactGeometry& artefact, const Eigen::Vector3d& p) {
  const Eigen::Vector2d at = p.head<2>();
  if (at.cwiseAbs().maxCoeff() > artefact.side_mm / 2 - kSpot_mm) return false;
  for (const auto& [name, centre] : artefact.cones_mm) {
    const double radius = (at - centre).norm();
    if (radius >= artefact.cone_top_radius_mm + kSpot_mm) continue;
    return radius > artefact.cone_bottom_radius_mm + kSpot_mm && radius < artefact.cone_top_radius_mm - kSpot_mm;
  }
  for (const auto& [name, centre] : artefact.slots_mm)
    if ((at - centre).cwiseAbs().maxCoeff() < artefact.slot_width_mm / 2 + kSpot_mm) return false;
  return true;
}

}  // namespace

void AddReadingInformation(const simulator::MachineTruth& truth, const Eigen::Vector3d& point_mm, double x_mm,
                           const Eigen::Vector3d& v0_mm, const Eigen::Vector3d& direction,
                           const Eigen::Vector3d& normal, Matrix12d* information) {
  // Source and ray turn about the sensor's origin; the face with the artefact about its own.
  const Eigen::Vector3d arm = point_mm - (Eigen::Vector3d(x_mm, 0, 0) - v0_mm + truth.t_sm_mm);
  const Eigen::Vector3d in_artefact = point_mm - truth.machine_from_artefact.translation();
  Vector12d slope;
  slope << -arm.cross(normal), -normal, in_artefact.cross(normal), normal;
  slope /= normal.dot(direction);
  information->selfadjointView<Eigen::Lower>().rankUpdate(slope);
}

TracedScan Trace(const simulator::Scene& scene, const simulator::ArtefactGeometry& artefact,
                 const simulator::MachineTruth& truth, const simulator::ScannerDesign& scanner,
                 const simulator::ScanPlan& plan, int threads) {
  TracedScan traced;
  traced.v0_mm = plan.v0_mm;
  traced.pitch_mm = plan.pitch_mm;
  const int columns = plan.columns > 0 ? plan.columns : scanner.columns;
  for (int column = 0; column < columns; ++column) {
    const double angle = 0.5 * scanner.line_angle_deg * kRadPerDeg * (2 * (column + 0.5) / columns - 1);
    traced.fan.emplace_back(0, std::sin(angle), -std::cos(angle));
  }
  const auto profiles = static_cast<int>(std::floor((plan.last_x_mm - plan.first_x_mm) / plan.pitch_mm + 1e-9)) + 1;
  const simulator::Scene plate_alone = simulator::ArtefactScene(artefact, truth);
  const Eigen::Isometry3d artefact_from_machine = truth.machine_from_artefact.inverse();
  // Fixed parts joined in order: the same sums on any number of threads.
  constexpr int kParts = 16;
  std::vector<TracedScan> parts(kParts);
  const auto trace_part = [&](int part) {
    TracedScan& out = parts[static_cast<std::size_t>(part)];
    for (int profile = profiles * part / kParts; profile < profiles * (part + 1) / kParts; ++profile) {
      const double x = plan.first_x_mm + profile * plan.pitch_mm;
      const Eigen::Vector3d carriage = Eigen::Vector3d(x, 0, 0) - plan.v0_mm + truth.t_sm_mm;
      const Eigen::Vector3d source = truth.machine_from_sensor * Eigen::Vector3d(0, 0, scanner.mid_range_mm) + carriage;
      for (int column = 0; column < columns; ++column) {
        const Eigen::Vector3d& ray = traced.fan[static_cast<std::size_t>(column)];
        const Eigen::Vector3d direction = truth.machine_from_sensor * ray;
        const double limit_mm = scanner.mid_range_mm + 2 * scanner.range_mm;
        const auto hit = scene.Intersect({source, direction}, limit_mm);
        if (!hit || -direction.dot(hit->normal) < kGrazing) continue;
        if (std::abs(scanner.mid_range_mm + hit->distance_mm * ray.z()) > scanner.range_mm / 2) continue;
        out.readings.push_back(
            {static_cast<std::uint16_t>(profile), static_cast<std::uint16_t>(column), x, hit->distance_mm});
        const auto plate = plate_alone.Intersect({source, direction}, limit_mm);
        if (!plate || plate->distance_mm != hit->distance_mm) continue;
        const Eigen::Vector3d at = source + hit->distance_mm * direction;
        AddReadingInformation(truth, at, x, plan.v0_mm, direction, hit->normal, &out.information);
        if (WithinAFace(artefact, artefact_from_machine * at))
          AddReadingInformation(truth, at, x, plan.v0_mm, direction, hit->normal, &out.inner_information);
      }
    }
  };
  metrology::ForEach(kParts, threads, trace_part);
  for (const TracedScan& part : parts) {
    traced.readings.insert(traced.readings.end(), part.readings.begin(), part.readings.end());
    traced.information += part.information;
    traced.inner_information += part.inner_information;
  }
  for (Matrix12d* sums : {&traced.information, &traced.inner_information})
    *sums = Matrix12d(sums->selfadjointView<Eigen::Lower>());
  return traced;
}

metrology::LineScan WithNoise(const TracedScan& traced, const simulator::ScannerDesign& scanner, std::uint64_t seed) {
  simulator::Random random(seed);
  const double raw_step_mm = 1e-3 * scanner.raw_step_um;
  const auto in_raw_steps = [&](double value_mm) { return raw_step_mm * std::round(value_mm / raw_step_mm); };
  metrology::LineScan scan;
  scan.v0_mm = traced.v0_mm;
  scan.profile_pitch_mm = traced.pitch_mm;
  scan.points_mm.reserve(traced.readings.size());
  for (const Reading& reading : traced.readings) {
    const Eigen::Vector3d& ray = traced.fan[reading.column];
    const double distance = reading.distance_mm + 1e-3 * scanner.noise_um * random.Gaussian();
    scan.points_mm.emplace_back(reading.x_mm, in_raw_steps(distance * ray.y()),
                                in_raw_steps(scanner.mid_range_mm + distance * ray.z()));
  }
  return scan;
}

Matrix12d TouchInformation(const simulator::MachineTruth& truth, const metrology::Artefact& artefact,
                           const metrology::ArtefactTouch& touch) {
  const Eigen::Isometry3d& pose = truth.machine_from_artefact;
  Matrix12d information = Matrix12d::Zero();
  // The artefact's motion (w, t) moves its point p by w x (p - origin) + t: seen along n, n . t + ((p - origin) x n) . w.
  const auto add = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    Vector12d slope = Vector12d::Zero();
    slope.tail<6>() << (p - pose.translation()).cross(n), n;
    information += slope * slope.transpose();
  };
  for (const metrology::PlaneFeature& cone : artefact.cones)
    for (int k = 0; k < 3; ++k)
      add(pose * Eigen::Vector3d(cone.centre_mm.x(), cone.centre_mm.y(), 0), Eigen::Vector3d::Unit(k));
  for (const Eigen::Vector3d& p : touch.plane_mm) add(p, pose.linear().col(2));
  for (const Eigen::Vector3d& p : touch.side_x_mm) add(p, pose.linear().col(0));
  for (const Eigen::Vector3d& p : touch.side_y_mm) add(p, pose.linear().col(1));
  return information;
}

metrology::Matrix6d SensorBound(const Matrix12d& information) {
  const Vector12d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix12d inverse = Matrix12d(scale.asDiagonal() * information * scale.asDiagonal()).inverse();
  return (scale.asDiagonal() * inverse * scale.asDiagonal()).topLeftCorner<6, 6>();
}

metrology::Artefact RecordOf(const simulator::ArtefactGeometry& geometry) {
  metrology::Artefact record;
  record.side_mm = geometry.side_mm;
  for (const auto& [name, at] : geometry.cones_mm) record.cones.push_back({name, at});
  for (const auto& [name, at] : geometry.slots_mm) record.slots.push_back({name, at});
  record.cone_half_angle_rad = geometry.cone_half_angle_deg * kRadPerDeg;
  record.cone_top_radius_mm = geometry.cone_top_radius_mm;
  record.cone_bottom_radius_mm = geometry.cone_bottom_radius_mm;
  record.slot_width_mm = geometry.slot_width_mm;
  record.slot_depth_mm = geometry.slot_depth_mm;
  return record;
}

metrology::ArtefactTouch TouchOf(const simulator::TouchProbing& probing) {
  metrology::ArtefactTouch touch;
  for (const auto& [name, at] : probing.centres_mm) touch.centres.push_back({name, at});
  touch.plane_mm = probing.plane_mm;
  touch.side_x_mm = probing.side_x_mm;
  touch.side_y_mm = probing.side_y_mm;
  return touch;
}

metrology::Vector6d ErrorOf(const metrology::SensorPose& found, const simulator::MachineTruth& truth) {
  metrology::Vector6d error;
  error << metrology::VectorFromRotation(found.rotation * truth.machine_from_sensor.transpose()),
      found.t_sm_mm - truth.t_sm_mm;
  return error;
}

}  // namespace sixpoint::bench
