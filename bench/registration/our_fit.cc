#include "bench/registration/our_fit.h"

#include <time.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace sixpoint::bench {

double Seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::shared_ptr<const metrology::Surface> SurfaceOf(metrology::TriangleMesh mesh, int threads) {
  auto surface = metrology::Surface::Prepare(std::move(mesh));
  if (!surface.ok()) {
    std::fprintf(stderr, "%s\n", surface.status().ToString().c_str());
    std::exit(1);
  }
  (*surface)->PrepareNear(threads);
  return *surface;
}

PreparedBlade PrepareBlade(int threads) {
  PreparedBlade prepared;
  prepared.blade = TwistedBlade();
  const double begin = Seconds();
  prepared.surface = SurfaceOf(prepared.blade.mesh, threads);
  prepared.prepare_s = Seconds() - begin;
  return prepared;
}

metrology::ScanPortion PortionOf(const metrology::Points& scan_mm) {
  metrology::ScanPortion portion;
  portion.id = "scan";
  portion.scan_point_count = static_cast<std::int64_t>(scan_mm.size());
  portion.sensor.reserve(scan_mm.size());
  for (const Eigen::Vector3d& p : scan_mm)
    if (!portion.sensor.Add(p)) ++portion.out_of_reach_count;
  return portion;
}

metrology::Points PointsOf(const metrology::ScanPortion& portion) {
  metrology::Points points;
  points.reserve(portion.sensor.size());
  for (std::size_t i = 0; i < portion.sensor.size(); ++i) points.push_back(portion.zero_mm(i));
  return points;
}

TimedFit FitPortion(const PreparedBlade& prepared, metrology::ScanPortion portion, int threads) {
  std::vector<metrology::ScanPortion> portions;
  portions.push_back(std::move(portion));
  metrology::FitOptions options;
  options.thread_count = threads;
  TimedFit timed;
  const double begin = Seconds(), processor_begin = ProcessorSeconds();
  auto fit = metrology::FitToSurface(*prepared.surface, portions, Eigen::Isometry3d::Identity(),
                                     metrology::MachineCalibration::Exact(), options);
  timed.seconds = Seconds() - begin;
  timed.processor_s = ProcessorSeconds() - processor_begin;
  if (!fit.ok()) {
    timed.remark = fit.status().ToString();
    return timed;
  }
  timed.fit = *std::move(fit);
  if (timed.fit.evidence.stopped_at) timed.stopped_at = *timed.fit.evidence.stopped_at;
  timed.converged = timed.fit.outcome == metrology::Outcome::kConverged;
  timed.remark = timed.fit.evidence.remark;
  return timed;
}

}  // namespace sixpoint::bench
