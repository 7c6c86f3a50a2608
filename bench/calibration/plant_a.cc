// Calibration of shared/data/plant-a against what only its simulator knows.
#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <tuple>

#include "bench/calibration/plant_files.h"
#include "bench/calibration/runs.h"
#include "bench/calibration/traced_scan.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/frames/angles.h"

namespace sixpoint::bench {
namespace {

using metrology::kRadPerDeg;
using nlohmann::json;

// Root mean square of the touched coordinates that a calibration uses, about the truth.
double TouchNoise(const metrology::Artefact& artefact, const metrology::ArtefactTouch& touch,
                  const Eigen::Isometry3d& machine_from_artefact) {
  const Eigen::Isometry3d back = machine_from_artefact.inverse();
  double squares = 0;
  std::size_t count = 0;
  const auto add = [&](double error) {
    squares += error * error;
    ++count;
  };
  for (const metrology::PlaneFeature& cone : artefact.cones) {
    const Eigen::Vector3d p = back * *metrology::TouchedCentre(touch, cone.name);
    add(p.x() - cone.centre_mm.x());
    add(p.y() - cone.centre_mm.y());
    add(p.z());
  }
  const double half = artefact.side_mm / 2;
  for (const Eigen::Vector3d& p : touch.plane_mm) add((back * p).z());
  for (const Eigen::Vector3d& p : touch.side_x_mm) add(std::abs((back * p).x()) - half);
  for (const Eigen::Vector3d& p : touch.side_y_mm) add(std::abs((back * p).y()) - half);
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace

void RunPlantA(const RunOptions& options, Figures* figures) {
  std::ifstream data_file(options.plant + "/dataset.json"), truth_file(options.plant + "/truth.json");
  if (!data_file || !truth_file) {
    std::printf("\n-- plant-a: SKIPPED, %s is absent\n", options.plant.c_str());
    return;
  }
  const json data = json::parse(data_file), known = json::parse(truth_file);
  const simulator::MachineTruth truth = TruthOf(known);
  const simulator::ArtefactGeometry geometry = GeometryOf(data.at("artefact"));
  const metrology::Artefact artefact = RecordOf(geometry);
  metrology::ArtefactTouch touch;  // its uncertainty is not stated: the kernel assumes the usual one (ADR 9)
  const json& probe = data.at("touch_probe");
  for (const auto& [name, at] : probe.at("centres").items()) touch.centres.push_back({name, VectorOf(at)});
  for (const json& p : probe.at("plane")) touch.plane_mm.push_back(VectorOf(p));
  for (const json& p : probe.at("side_x")) touch.side_x_mm.push_back(VectorOf(p));
  for (const json& p : probe.at("side_y")) touch.side_y_mm.push_back(VectorOf(p));
  metrology::SensorCalibrationOptions calibration;
  calibration.threads = options.threads;
  calibration.optics.mid_range_mm = data.at("sensor").at("mid_range_mm");
  calibration.optics.noise_mm = 1e-3 * data.at("sensor").at("noise_um").get<double>();
  const std::vector<metrology::LineScan> scans{LoadScan(options.plant, data, "artefact_1"),
                                               LoadScan(options.plant, data, "artefact_2")};
  const auto found = metrology::CalibrateSensor(scans, artefact, touch, calibration);
  if (!found.ok()) Stop(found.status());
  metrology::SensorCalibrationOptions alone = calibration;
  alone.threads = 1;
  const auto other = metrology::CalibrateSensor(scans, artefact, touch, alone);
  figures->Compare(other.ok() && other->sensor.rotation == found->sensor.rotation &&
                   other->sensor.t_sm_mm == found->sensor.t_sm_mm &&
                   other->sensor.covariance == found->sensor.covariance);
  const auto sequential = metrology::CalibrateSensorSequentially(scans, artefact, touch, calibration);
  if (!sequential.ok()) Stop(sequential.status());

  // The bound: every reading's true ray on the true face that it hits.
  const simulator::Scene scene = simulator::ArtefactScene(geometry, truth);
  Matrix12d laser = Matrix12d::Zero();
  for (const metrology::LineScan& scan : scans)
    for (const Eigen::Vector3d& p : scan.points_mm) {
      const double stand_off = calibration.optics.mid_range_mm;
      const Eigen::Vector3d source = truth.machine_from_sensor * Eigen::Vector3d(0, 0, stand_off) +
                                     Eigen::Vector3d(p.x(), 0, 0) - scan.v0_mm + truth.t_sm_mm;
      const Eigen::Vector3d direction =
          truth.machine_from_sensor * Eigen::Vector3d(0, p.y(), p.z() - stand_off).normalized();
      const auto hit = scene.Intersect({source, direction}, 2 * stand_off);
      if (hit && -direction.dot(hit->normal) > 0.2)
        AddReadingInformation(truth, source + hit->distance_mm * direction, p.x(), scan.v0_mm, direction, hit->normal,
                              &laser);
    }
  laser = Matrix12d(laser.selfadjointView<Eigen::Lower>());
  const double laser_noise = calibration.optics.noise_mm;
  const double touch_noise = TouchNoise(artefact, touch, truth.machine_from_artefact);
  // What the estimate owes to that assumption: with the probe's own scatter stated, and with the standard uncertainty of
  // +-1 um where any value within is as likely (GUM 4.3.7), which ADR 9 does not take.
  const auto told_of = [&](double uncertainty_mm) {
    metrology::ArtefactTouch stated = touch;
    stated.standard_uncertainty_mm = uncertainty_mm;
    auto told = metrology::CalibrateSensor(scans, artefact, stated, calibration);
    if (!told.ok()) Stop(told.status());
    return *std::move(told);
  };
  const metrology::SensorCalibration told = told_of(touch_noise), even = told_of(1e-3 / std::sqrt(3.0));
  const metrology::Matrix6d bound = SensorBound(laser / (laser_noise * laser_noise) +
                                                TouchInformation(truth, artefact, touch) / (touch_noise * touch_noise));
  const metrology::Vector6d error = ErrorOf(found->sensor, truth), paper = ErrorOf(sequential->sensor, truth);
  std::printf(
      "\n-- plant-a, two scans of %zu points together, touched coordinates off by %.2f um rms, taken as %.2f um\n",
      scans[0].points_mm.size() + scans[1].points_mm.size(), 1e3 * touch_noise, 1e3 * found->touch_uncertainty_mm);
  std::printf("%-24s %12s %12s %12s %16s %20s %18s\n", "parameter", "error", "reported", "bound", "error/reported",
              "reported if stated", "SEQUENTIAL error");
  const char* const names[6] = {"alpha, urad", "beta, urad", "gamma, urad", "T_sm x, um", "T_sm y, um", "T_sm z, um"};
  double worst_sigma = 0;
  for (int k = 0; k < 6; ++k) {
    const double unit = k < 3 ? 1e6 : 1e3;
    const double reported = std::sqrt(found->sensor.covariance(k, k)), least = std::sqrt(bound(k, k));
    std::printf("%-24s %12.3f %12.3f %12.3f %16.2f %20.3f %18.3f\n", names[k], unit * error(k), unit * reported,
                unit * least, error(k) / reported, unit * std::sqrt(told.sensor.covariance(k, k)), unit * paper(k));
    worst_sigma = std::max(worst_sigma, std::abs(error(k)) / reported);
  }
  // T_sm rests on the touch: one draw of three values that every hole of the plant shares.
  std::printf("%-28s %12s %16s %16s %26s\n", "touched coordinate taken as", "um", "reported/bound", "error/reported",
              "T_sm: chi-squared of 3");
  for (const auto& [name, key, result] :
       {std::tuple{"a standard uncertainty", "", &*found}, std::tuple{"any value within +-1 um", "_if_even", &even},
        std::tuple{"its scatter", "_if_stated", &told}}) {
    const metrology::Vector6d of_error = ErrorOf(result->sensor, truth);
    const Eigen::Array<double, 6, 1> variance = result->sensor.covariance.diagonal();
    const double over_bound = std::sqrt((variance / bound.diagonal().array()).maxCoeff());
    const double sigmas = (of_error.array().abs() / variance.sqrt()).maxCoeff();
    const Eigen::Matrix3d of_t_sm = result->sensor.covariance.bottomRightCorner<3, 3>();
    const double chi_squared = of_error.tail<3>().dot(of_t_sm.ldlt().solve(of_error.tail<3>()));
    std::printf("%-28s %12.3f %16.2f %16.2f %26.2f\n", name, 1e3 * result->touch_uncertainty_mm, over_bound, sigmas,
                chi_squared);
    const Eigen::Array<double, 6, 1> over = (variance / bound.diagonal().array()).sqrt();
    figures->values[std::string("plant_a_angles_reported_over_bound") + key] = over.head<3>().maxCoeff();
    figures->values[std::string("plant_a_t_sm_reported_over_bound") + key] = over.tail<3>().maxCoeff();
    figures->values[std::string("plant_a_sensor_worst_sigma") + key] = sigmas;
    figures->values[std::string("plant_a_t_sm_chi_squared") + key] = chi_squared;
  }

  std::vector<metrology::SpherePose> poses;
  for (const json& p : data.at("sphere_poses"))
    poses.push_back({p.at("a_deg").get<double>() * kRadPerDeg, p.at("b_deg").get<double>() * kRadPerDeg,
                     VectorOf(p.at("centre_mm")), p.at("use") != "fit"});
  metrology::RotationOptions rotation;
  rotation.nominal.a.point_mm = rotation.nominal.b.point_mm = VectorOf(data.at("machine").at("nominal_centre_mm"));
  const auto axes = metrology::CalibrateRotation(poses, rotation);
  if (!axes.ok()) Stop(axes.status());
  double worst_axis_sigma = 0;
  int row = 0;
  for (const auto& [line, name] : {std::pair{axes->axes.a, "a_axis"}, std::pair{axes->axes.b, "b_axis"}}) {
    const Eigen::Vector3d direction = VectorOf(known.at(name).at("direction")).normalized();
    Eigen::Vector3d point = VectorOf(known.at(name).at("point"));
    point += direction * direction.dot(line.point_mm - point);
    const Eigen::Matrix<double, 3, 2> across = metrology::TangentBasis(line.direction);
    Eigen::Vector4d off;
    off << across.transpose() * (line.direction - direction), across.transpose() * (line.point_mm - point);
    for (int k = 0; k < 4; ++k, ++row)
      worst_axis_sigma = std::max(worst_axis_sigma, std::abs(off(k)) / std::sqrt(axes->covariance(row, row)));
  }
  std::printf(
      "rotary axes: worst of 8 parameters %.2f reported standard uncertainties off; held-out poses %.2f um rms\n",
      worst_axis_sigma, 1e3 * axes->check_rms_mm);
  figures->values["plant_a_worst_sigma"] = std::max(worst_sigma, worst_axis_sigma);
}

}  // namespace sixpoint::bench
