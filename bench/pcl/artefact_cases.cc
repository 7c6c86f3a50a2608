#include "bench/pcl/artefact_cases.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::bench {
namespace {

using metrology::LineScan;
using metrology::Points;
using simulator::Random;

// A coarser scanner, and single readings anywhere up to 2 mm off.
void Speckle(const TracedScan& traced, Random* random, LineScan* scan) {
  for (std::size_t i = 0; i < scan->points_mm.size(); ++i) {
    const double off = random->Uniform() < 0.05 ? random->Uniform(-2, 2) : 0.02 * random->Gaussian();
    scan->points_mm[i] += off * traced.fan[traced.readings[i].column];
  }
}

// Specks on the plate, holes too, and a tenth of the readings in the air anywhere about it.
void Dust(const Eigen::Affine3d& artefact_from_sensor, const metrology::Artefact& artefact, const TracedScan& traced,
          Random* random, LineScan* scan) {
  struct Speck {
    Eigen::Vector2d at;
    double radius, height;
  };
  std::vector<Speck> specks;
  for (int i = 0; i < 150; ++i) {
    const double x = random->Uniform(-0.5, 0.5), y = random->Uniform(-0.5, 0.5);
    specks.push_back({artefact.side_mm * Eigen::Vector2d(x, y), random->Uniform(0.1, 0.5), random->Uniform(0.03, 0.3)});
  }
  for (std::size_t i = 0; i < scan->points_mm.size(); ++i) {
    Eigen::Vector3d& p = scan->points_mm[i];
    const Eigen::Vector2d at = (artefact_from_sensor * p).head<2>();
    double off = random->Uniform() < 0.1 ? random->Uniform(-4, 8) : 0;
    for (const Speck& speck : specks)
      if ((at - speck.at).squaredNorm() < speck.radius * speck.radius) off = std::max(off, speck.height);
    p -= off * traced.fan[traced.readings[i].column];
  }
}

// One side of the plate out of view, up to its slots and cones, and what is beside it.
void Hide(const Eigen::Affine3d& artefact_from_sensor, Random* random, LineScan* scan) {
  constexpr double kSeenMm = 5.6;
  const double angle = M_PI / 2 * std::floor(random->Uniform(0, 4));
  const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
  Points kept;
  for (const Eigen::Vector3d& p : scan->points_mm)
    if (out.dot((artefact_from_sensor * p).head<2>()) < kSeenMm) kept.push_back(p);
  scan->points_mm = std::move(kept);
}

}  // namespace

Eigen::Affine3d SensorFromArtefact(const simulator::MachineTruth& truth, const Eigen::Vector3d& v0_mm) {
  Eigen::Affine3d machine_from_sensor = Eigen::Affine3d::Identity();
  machine_from_sensor.linear() << Eigen::Vector3d::UnitX(), truth.machine_from_sensor.col(1),
      truth.machine_from_sensor.col(2);
  machine_from_sensor.translation() = truth.t_sm_mm - v0_mm;
  return machine_from_sensor.inverse() * truth.machine_from_artefact;
}

const std::vector<std::string>& ArtefactCaseKinds() {
  static const std::vector<std::string> kinds{"clean",   "soiled", "half missing, a tenth strays",
                                              "speckle", "dust",   "one side hidden, soiled"};
  return kinds;
}

std::vector<ArtefactCase> ArtefactCases(int seed) {
  const simulator::ArtefactGeometry geometry;
  ShopScans shop = ScanInTheShop(simulator::MachineDesign(), geometry, seed);
  const std::size_t height = static_cast<std::size_t>(seed) % 2;
  const LineScan& clean = shop.clean[height];
  const TracedScan& traced = shop.traced[height];
  const metrology::Artefact artefact = RecordOf(geometry);
  const Eigen::Affine3d sensor_from_artefact = SensorFromArtefact(shop.truth, clean.v0_mm);
  const Eigen::Affine3d artefact_from_sensor = sensor_from_artefact.inverse();
  std::vector<ArtefactCase> cases(ArtefactCaseKinds().size(), {clean, artefact, sensor_from_artefact});
  cases[1].scan = shop.soiled[height];
  Dirt dirt;
  dirt.missing = 0.5;
  dirt.stray = 0.1;
  Soil(dirt, shop.truth, artefact, traced, shop.random.Next(), &cases[2].scan);
  Speckle(traced, &shop.random, &cases[3].scan);
  Dust(artefact_from_sensor, artefact, traced, &shop.random, &cases[4].scan);
  cases[5].scan = shop.soiled[height];
  Hide(artefact_from_sensor, &shop.random, &cases[5].scan);
  return cases;
}

}  // namespace sixpoint::bench
