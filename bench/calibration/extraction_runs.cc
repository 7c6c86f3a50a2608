// The search for the artefact, and the calibration that rests on it, in clouds as a shop floor gives them.
#include <algorithm>
#include <cstdio>
#include <map>

#include "bench/calibration/runs.h"
#include "bench/calibration/shop_scans.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::bench {
namespace {

struct ExtractionOutcome {
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
  std::vector<ExtractionOutcome> outcomes(static_cast<std::size_t>(seeds));
  metrology::ForEach(seeds, options.threads, [&](std::size_t seed) {
    ShopScans shop = ScanInTheShop(design, geometry, static_cast<int>(seed));
    const simulator::MachineTruth& truth = shop.truth;
    ExtractionOutcome& outcome = outcomes[seed];
    Matrix12d information = Matrix12d::Zero();
    for (const TracedScan& traced : shop.traced)
      information += 1e6 / (scanner.noise_um * scanner.noise_um) * traced.information;
    metrology::ArtefactTouch touch = TouchOf(simulator::ProbeArtefact(
        geometry, truth.machine_from_artefact, kTouchNoise_um, simulator::Random(shop.random.Next())));
    touch.standard_uncertainty_mm = 1e-3 * kTouchNoise_um;
    information += 1e6 / (kTouchNoise_um * kTouchNoise_um) * TouchInformation(truth, record, touch);
    outcome.bound = SensorBound(information);
    metrology::SensorCalibrationOptions calibration;
    calibration.optics.mid_range_mm = scanner.mid_range_mm;
    calibration.optics.noise_mm = 1e-3 * scanner.noise_um;
    const auto of_clean = metrology::CalibrateSensor(shop.clean, record, touch, calibration);
    const auto of_soiled = metrology::CalibrateSensor(shop.soiled, record, touch, calibration);
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
  for (const ExtractionOutcome& outcome : outcomes) {
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
