#include "bench/calibration/shop_scans.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::bench {
namespace {

using metrology::kRadPerDeg;

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

}  // namespace

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
  metrology::SensorPose sensor = metrology::SensorPose::Exact();
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

ShopScans ScanInTheShop(const simulator::MachineDesign& design, const simulator::ArtefactGeometry& geometry, int seed) {
  ShopScans scans;
  simulator::Random& random = scans.random;
  random = simulator::Random(simulator::Random::StreamSeed(77, static_cast<std::uint64_t>(seed)));
  simulator::MachineTruth& truth = scans.truth;
  truth = simulator::MountedByHand(design, static_cast<std::uint64_t>(3000 + seed));
  const double about_x = random.Uniform(-4, 4), about_y = random.Uniform(-4, 4);
  truth.machine_from_artefact.linear() =
      metrology::RotationFromVector({about_x * kRadPerDeg, about_y * kRadPerDeg, 0}) *
      metrology::RotationFromVector({0, 0, random.Uniform(-20, 20) * kRadPerDeg}) *
      truth.machine_from_artefact.linear();
  simulator::Scene scene = simulator::ArtefactScene(geometry, truth);
  AddFixture(design, &random, &scene);
  Dirt dirt;
  dirt.missing = random.Uniform(0.1, 0.3);
  dirt.stray = random.Uniform(0, 0.03);
  const double before = random.Uniform(2, 20), after = random.Uniform(2, 20);
  for (simulator::ScanPlan plan : simulator::PlanArtefact(design)) {
    plan.pitch_mm = 0.1;
    plan.first_x_mm -= before;
    plan.last_x_mm += after;
    scans.traced.push_back(Trace(scene, geometry, truth, design.scanner, plan, 1));
    scans.clean.push_back(WithNoise(scans.traced.back(), design.scanner, random.Next()));
    scans.clean.back().id = scans.clean.size() == 1 ? "high" : "low";
    scans.soiled.push_back(scans.clean.back());
    Soil(dirt, truth, RecordOf(geometry), scans.traced.back(), random.Next(), &scans.soiled.back());
  }
  return scans;
}

}  // namespace sixpoint::bench
