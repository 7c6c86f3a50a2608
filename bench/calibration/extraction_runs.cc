// The search for the artefact, and the calibration that rests on it, in clouds as a shop floor gives them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "bench/calibration/runs.h"
#include "bench/calibration/traced_scan.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/parallel/loops.h"
#include "simulator/random.h"

namespace sixpoint::bench {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kTouchNoise_um = 1;

std::shared_ptr<const simulator::Shape> Block(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm) {
  metrology::TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.vertices_mm.emplace_back(k & 1 ? high_mm.x() : low_mm.x(), k & 2 ? high_mm.y() : low_mm.y(),
                                  k & 4 ? high_mm.z() : low_mm.z());
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return std::make_shared<simulator::TriangleShape>(mesh);
}

// Beside the plate, in machine axes: the bed, clamps lower and higher than the plate, bolts standing on them.
void AddFixture(const simulator::MachineDesign& design, simulator::Random* random, simulator::Scene* scene) {
  const Eigen::Vector3d plate = design.artefact_mm;
  const auto add = [&](const std::shared_ptr<const simulator::Shape>& shape) {
    scene->Add(shape, Eigen::Isometry3d(Eigen::Translation3d(plate)));
  };
  add(Block({-200, -200, -20}, {200, 200, -8.5}));
  for (const double side : {-1.0, 1.0}) {
    if (random->Uniform() < 0.3) continue;
    const double gap = random->Uniform(18, 20), reach = random->Uniform(25, 40), height = random->Uniform(-6, 4);
    add(Block({std::min(side * gap, side * reach), -60, -19}, {std::max(side * gap, side * reach), 60, height}));
    for (int bolt = 0; bolt < 3; ++bolt)
      add(std::make_shared<simulator::Pin>(
          Eigen::Vector3d(side * random->Uniform(gap + 2, reach), random->Uniform(-10, 10), height + 2),
          Eigen::Vector3d::UnitZ(), random->Uniform(1, 3), 3));
  }
}

struct Dirt {
  double missing = 0, stray = 0;
};

// Missing returns (single ones, runs of profiles and of columns) and reflections (patches displaced along their rays, half
// of them in cones).
void Soil(const Dirt& dirt, const simulator::MachineTruth& truth, const metrology::Artefact& artefact,
          const TracedScan& traced, std::uint64_t seed, metrology::LineScan* scan) {
  simulator::Random random(seed);
  const int profiles = traced.readings.back().profile + 1, columns = static_cast<int>(traced.fan.size());
  std::vector<bool> profile_gone(static_cast<std::size_t>(profiles)), column_gone(static_cast<std::size_t>(columns));
  for (std::vector<bool>* gone : {&profile_gone, &column_gone})
    for (int run = 0; run < 3; ++run) {
      const auto first = static_cast<std::size_t>(random.Uniform(0, static_cast<double>(gone->size())));
      const auto length = static_cast<std::size_t>(random.Uniform(1, 10));
      for (std::size_t i = first; i < std::min(first + length, gone->size()); ++i) (*gone)[i] = true;
    }
  // Displaced patches until enough readings are strays.
  metrology::SensorPose sensor;
  sensor.rotation = truth.machine_from_sensor;
  sensor.t_sm_mm = truth.t_sm_mm;
  const Eigen::Isometry3d artefact_from_machine = truth.machine_from_artefact.inverse();
  metrology::Points in_artefact;
  for (const Eigen::Vector3d& p : scan->points_mm)
    in_artefact.push_back(artefact_from_machine * sensor.MachineFromSensor(p, scan->v0_mm));
  const auto wanted = static_cast<std::size_t>(dirt.stray * static_cast<double>(scan->points_mm.size()));
  std::vector<bool> displaced(scan->points_mm.size());
  for (const bool in_cones : {true, false}) {
    std::size_t count = 0;
    for (int patch = 0; patch < 60 && count < wanted / 2; ++patch) {
      const Eigen::Vector2d cone = artefact.cones[static_cast<std::size_t>(patch) % artefact.cones.size()].centre_mm;
      const double reach = in_cones ? artefact.cone_top_radius_mm - 0.3 : artefact.side_mm / 2;
      const Eigen::Vector2d middle = (in_cones ? cone : Eigen::Vector2d(0, 0)) +
                                     Eigen::Vector2d(random.Uniform(-reach, reach), random.Uniform(-reach, reach));
      const double radius = random.Uniform(0.15, 0.5);
      const double shift = in_cones ? random.Uniform(-0.8, 1.5) : random.Uniform(0.1, 4);
      for (std::size_t i = 0; i < in_artefact.size() && count < wanted / 2; ++i) {
        if (displaced[i] || (in_artefact[i].head<2>() - middle).norm() > radius) continue;
        if (in_cones && (in_artefact[i].head<2>() - cone).norm() > artefact.cone_top_radius_mm) continue;
        const Eigen::Vector3d& ray = traced.fan[traced.readings[i].column];
        scan->points_mm[i] -= (shift + 0.05 * random.Gaussian()) * ray;
        displaced[i] = true;
        ++count;
      }
    }
  }
  metrology::Points kept;
  for (std::size_t i = 0; i < scan->points_mm.size(); ++i) {
    const Reading& reading = traced.readings[i];
    if (random.Uniform() < dirt.missing || profile_gone[reading.profile] || column_gone[reading.column]) continue;
    kept.push_back(scan->points_mm[i]);
  }
  scan->points_mm = std::move(kept);
}

struct Outcome {
  std::string refusal, moved_refusal;  // of the clean scans, of the soiled ones
  metrology::Vector6d error, moved;
  metrology::Matrix6d bound, reported;
};

}  // namespace

void RunExtraction(const RunOptions& options, Figures* figures) {
  const int seeds = options.seeds / 2;
  const simulator::MachineDesign design;
  const simulator::ArtefactGeometry geometry;
  const metrology::Artefact record = RecordOf(geometry);
  const simulator::ScannerDesign scanner = design.scanner;
  std::vector<Outcome> outcomes(static_cast<std::size_t>(seeds));
  metrology::ForEach(seeds, options.threads, [&](int seed) {
    simulator::Random random(simulator::Random::StreamSeed(77, seed));
    simulator::MachineTruth truth = simulator::MountedByHand(design, 3000 + seed);
    const Eigen::Vector3d tilt(random.Uniform(-4, 4) * kDegree, random.Uniform(-4, 4) * kDegree, 0);
    truth.machine_from_artefact.linear() = metrology::RotationFromVector(tilt) *
                                           metrology::RotationFromVector({0, 0, random.Uniform(-20, 20) * kDegree}) *
                                           truth.machine_from_artefact.linear();
    simulator::Scene scene = simulator::ArtefactScene(geometry, truth);
    AddFixture(design, &random, &scene);
    const Dirt dirt{random.Uniform(0.1, 0.3), random.Uniform(0, 0.03)};
    const double before = random.Uniform(2, 20), after = random.Uniform(2, 20);
    std::vector<metrology::LineScan> clean, soiled;
    Outcome& outcome = outcomes[static_cast<std::size_t>(seed)];
    Matrix12d information = Matrix12d::Zero();
    for (simulator::ScanPlan plan : simulator::PlanArtefact(design)) {
      plan.pitch_mm = 0.1;
      plan.first_x_mm -= before;
      plan.last_x_mm += after;
      const TracedScan traced = Trace(scene, geometry, truth, scanner, plan, 1);
      information += 1e6 / (scanner.noise_um * scanner.noise_um) * traced.information;
      clean.push_back(WithNoise(traced, scanner, random.Next()));
      clean.back().id = clean.size() == 1 ? "high" : "low";
      soiled.push_back(clean.back());
      Soil(dirt, truth, record, traced, random.Next(), &soiled.back());
    }
    metrology::ArtefactTouch touch = TouchOf(simulator::ProbeArtefact(
        geometry, truth.machine_from_artefact, kTouchNoise_um, simulator::Random(random.Next())));
    touch.standard_uncertainty_mm = 1e-3 * kTouchNoise_um;
    information += 1e6 / (kTouchNoise_um * kTouchNoise_um) * TouchInformation(truth, record, touch);
    outcome.bound = SensorBound(information);
    metrology::SensorCalibrationOptions calibration;
    calibration.optics.mid_range_mm = scanner.mid_range_mm;
    calibration.optics.noise_mm = 1e-3 * scanner.noise_um;
    const auto of_clean = metrology::CalibrateSensor(clean, record, touch, calibration);
    const auto of_soiled = metrology::CalibrateSensor(soiled, record, touch, calibration);
    if (!of_clean.ok()) outcome.refusal = std::string(of_clean.status().message());
    if (!of_soiled.ok()) outcome.moved_refusal = std::string(of_soiled.status().message());
    if (!of_clean.ok() || !of_soiled.ok()) return;
    outcome.error = ErrorOf(of_soiled->sensor, truth);
    outcome.moved = outcome.error - ErrorOf(of_clean->sensor, truth);
    outcome.reported = of_soiled->sensor.covariance;
  });

  const std::vector<std::string> names{"alpha", "beta", "gamma", "T_sm x", "T_sm y", "T_sm z"};
  ErrorStatistics soiled("sensor, soiled scans", names), moved("moved by the soiling", names);
  int found_clean = 0, found = 0, within = 0;
  double worst_moved = 0;
  std::map<std::string, int> refusals;
  for (const Outcome& outcome : outcomes) {
    found_clean += outcome.refusal.empty();
    found += outcome.moved_refusal.empty();
    if (!outcome.refusal.empty()) ++refusals["clean: " + outcome.refusal];
    if (!outcome.moved_refusal.empty()) ++refusals["soiled: " + outcome.moved_refusal];
    if (!outcome.refusal.empty() || !outcome.moved_refusal.empty()) continue;
    soiled.Add(outcome.error, outcome.bound, outcome.reported);
    moved.Add(outcome.moved, outcome.bound, outcome.reported);
    const Eigen::Array<double, 6, 1> sigma = outcome.bound.diagonal().array().sqrt();
    within += (outcome.error.array().abs() / sigma).maxCoeff() < 5;
    worst_moved = std::max(worst_moved, (outcome.moved.array().abs() / sigma).maxCoeff());
  }
  std::printf(
      "\n-- search: %d scan pairs with a fixture, turned by up to 20 deg, tilted by up to 4 deg; soiled: 10..30 %% "
      "missing, profiles and columns missing, up to 3 %% reflections\n",
      seeds);
  if (soiled.count() > 0) {
    soiled.Print();
    moved.Print();
  }
  std::printf(
      "calibrated: clean %d, soiled %d of %d; all six parameters within 5 sigma of the truth: %d; worst parameter "
      "moved by the soiling: %.2f sigma\n",
      found_clean, found, seeds, within, worst_moved);
  for (const auto& [refusal, count] : refusals) std::printf("  %3d x %s\n", count, refusal.c_str());
  figures->values["soiled_found_percent"] = 100.0 * found / seeds;
  figures->values["soiled_right_percent"] = 100.0 * within / seeds;
  if (soiled.count() > 0) figures->values["soiled_variance_over_bound"] = soiled.variance_over_bound();
  figures->values["soiled_worst_moved_sigma"] = worst_moved;
}

}  // namespace sixpoint::bench
