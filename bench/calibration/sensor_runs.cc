#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>

#include "bench/calibration/pcl_peer.h"
#include "bench/calibration/runs.h"
#include "bench/calibration/traced_scan.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/parallel/loops.h"
#include "simulator/random.h"

namespace sixpoint::bench {
namespace {

constexpr int kSeedsPerMachine = 20;
constexpr int kPeerSeeds = 40;  // the peers are far from the bound: a few runs show how far

struct SensorOutcome {
  metrology::Vector6d error;
  metrology::Matrix6d bound, inner_bound, reported;
  std::optional<metrology::SensorPose> sequential;
  std::optional<metrology::Vector6d> sequential_error, pcl_error;
};

double SecondsOf(const std::chrono::steady_clock::duration& d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

void RunSensor(const RunOptions& options, Figures* figures) {
  const simulator::MachineDesign design;
  simulator::ScannerDesign scanner = design.scanner;
  scanner.columns = options.dense ? 1280 : 640;
  const simulator::ArtefactGeometry geometry;
  const metrology::Artefact record = RecordOf(geometry);
  metrology::SensorCalibrationOptions calibration;
  calibration.optics.mid_range_mm = scanner.mid_range_mm;
  calibration.optics.noise_mm = 1e-3 * scanner.noise_um;

  std::vector<SensorOutcome> outcomes(static_cast<std::size_t>(options.seeds));
  std::vector<double> seconds, pcl_seconds;
  std::size_t points = 0;
  for (int first = 0; first < options.seeds; first += kSeedsPerMachine) {
    const simulator::MachineTruth truth = simulator::MountedByHand(design, 1000 + first);
    const simulator::Scene scene = simulator::ArtefactScene(geometry, truth);
    std::vector<TracedScan> traced;
    for (simulator::ScanPlan plan : simulator::PlanArtefact(design)) {
      if (!options.dense) plan.pitch_mm = 0.2;
      traced.push_back(Trace(scene, geometry, truth, scanner, plan, options.threads));
    }
    const double laser_weight = 1 / (calibration.optics.noise_mm * calibration.optics.noise_mm);
    const Matrix12d laser = laser_weight * (traced[0].information + traced[1].information);
    const Matrix12d inner_laser = laser_weight * (traced[0].inner_information + traced[1].inner_information);
    // took_s: null for a run that counts; else one that is timed alone.
    const auto run = [&](int seed, int threads, double* took_s) {
      std::vector<metrology::LineScan> scans;
      for (std::size_t s = 0; s < traced.size(); ++s) {
        scans.push_back(WithNoise(traced[s], scanner, simulator::Random::StreamSeed(seed, s)));
        scans.back().id = s == 0 ? "high" : "low";
      }
      metrology::ArtefactTouch touch =
          TouchOf(simulator::ProbeArtefact(geometry, truth.machine_from_artefact, kTouchNoise_um,
                                           simulator::Random(simulator::Random::StreamSeed(seed, 7))));
      touch.standard_uncertainty_mm = 1e-3 * kTouchNoise_um;
      metrology::SensorCalibrationOptions with = calibration;
      with.threads = threads;
      const auto begin = std::chrono::steady_clock::now();
      const auto found = metrology::CalibrateSensor(scans, record, touch, with);
      if (took_s != nullptr) *took_s = SecondsOf(std::chrono::steady_clock::now() - begin);
      if (!found.ok()) Stop(found.status());
      SensorOutcome& outcome = outcomes[static_cast<std::size_t>(seed)];
      if (took_s != nullptr) {
        const auto pcl_begin = std::chrono::steady_clock::now();
        PclPlaneAndCircles(scans, record, touch, found->sensor, found->machine_from_artefact);
        pcl_seconds.push_back(SecondsOf(std::chrono::steady_clock::now() - pcl_begin));
        figures->Compare(outcome.error == ErrorOf(found->sensor, truth) &&
                         outcome.reported == found->sensor.covariance);
        return;
      }
      outcome.error = ErrorOf(found->sensor, truth);
      outcome.reported = found->sensor.covariance;
      const Matrix12d touched = 1e6 / (kTouchNoise_um * kTouchNoise_um) * TouchInformation(truth, record, touch);
      outcome.bound = SensorBound(laser + touched);
      outcome.inner_bound = SensorBound(inner_laser + touched);
      if (seed >= kPeerSeeds) return;
      const auto sequential = metrology::CalibrateSensorSequentially(scans, record, touch, with);
      if (!sequential.ok()) Stop(sequential.status());
      outcome.sequential = sequential->sensor;
      outcome.sequential_error = ErrorOf(sequential->sensor, truth);
      if (const auto pcl = PclPlaneAndCircles(scans, record, touch, found->sensor, found->machine_from_artefact))
        outcome.pcl_error = ErrorOf(*pcl, truth);
    };
    metrology::ForEach(std::min(kSeedsPerMachine, options.seeds - first), options.threads,
                       [&](int i) { run(first + i, 1, nullptr); });
    if (first == 0) {
      points = traced[0].readings.size() + traced[1].readings.size();
      // And their bits compared with what one thread gave.
      for (int seed = 0; seed < std::min(7, options.seeds); ++seed) run(seed, options.threads, &seconds.emplace_back());
    }
  }

  const std::vector<std::string> names{"alpha", "beta", "gamma", "T_sm x", "T_sm y", "T_sm z"};
  ErrorStatistics joint("sensor, JOINT", names), sequential("sensor, SEQUENTIAL", names);
  ErrorStatistics pcl("sensor, PCL plane+circle", names), inner("JOINT, edges left out", names);
  double worst_edges = 0, pooled_edges = 0;
  for (const SensorOutcome& outcome : outcomes) {
    joint.Add(outcome.error, outcome.bound, outcome.reported);
    inner.Add(outcome.error, outcome.inner_bound, outcome.reported);
    const double share = 1.0 / options.seeds;
    worst_edges += share * (outcome.inner_bound.diagonal().array() / outcome.bound.diagonal().array()).maxCoeff();
    pooled_edges += share * (outcome.bound.ldlt().solve(outcome.inner_bound)).trace() / 6;
    if (outcome.sequential) sequential.Add(*outcome.sequential_error, outcome.bound, outcome.sequential->covariance);
    if (outcome.pcl_error) pcl.Add(*outcome.pcl_error, outcome.bound, outcome.bound);  // PCL reports none
  }
  std::sort(seconds.begin(), seconds.end());
  std::sort(pcl_seconds.begin(), pcl_seconds.end());
  const double median_s = seconds[seconds.size() / 2], pcl_s = pcl_seconds[pcl_seconds.size() / 2];
  std::printf("\n-- sensor: %d runs, two scans of %zu points together, %.0f um along the ray, touch %.0f um (stated)\n",
              options.seeds, points, scanner.noise_um, kTouchNoise_um);
  joint.Print();
  // The estimate takes no readings within 0.05 mm of an edge, where a laser's spot lies on two faces; the bound has them.
  std::printf(
      "the bound without readings at edges over the bound with them: pooled %.3f, worst parameter %.3f; against it:\n",
      pooled_edges, worst_edges);
  inner.Print();
  sequential.Print();
  if (pcl.count() > 0) pcl.Print();
  std::printf(
      "one calibration, search included, on %d threads: median %.3f s, worst of %zu %.3f s; PCL, told where the cones "
      "are, "
      "on one: %.3f s\n",
      options.threads, median_s, seconds.size(), seconds.back(), pcl_s);
  figures->kinds.push_back(joint);
  figures->values["sensor_variance_over_bound"] = joint.variance_over_bound();
  figures->values["sensor_reported_over_bound"] = joint.reported_over_bound();
  figures->values["sensor_worst_bias_sigma"] = joint.worst_bias_sigma();
  figures->values["sensor_edges_share_of_variance_over_bound"] = pooled_edges;
  figures->values["sensor_variance_over_bound_edges_left_out"] = inner.variance_over_bound();
  figures->values["sequential_variance_over_bound"] = sequential.variance_over_bound();
  if (pcl.count() > 0) figures->values["pcl_variance_over_bound"] = pcl.variance_over_bound();
  figures->values["sensor_seconds"] = median_s;
  figures->values["sensor_time_over_pcl"] = median_s / pcl_s;
}

}  // namespace sixpoint::bench
