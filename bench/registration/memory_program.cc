// A process that does nothing but fit one large scan, its heap kept as the registration service keeps its own, and nothing
// of the peers linked: what it takes at its peak is the product's. Prints megabytes with the points, with the surface and at the peak, seconds, error, whether it converged.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "bench/registration/our_fit.h"
#include "bench/registration/runs.h"
#include "services/registration/fit_memory.h"

namespace {

double ResidentMb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(field + ":", 0) == 0) return 1024e-6 * std::stod(line.substr(field.size() + 1));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace sixpoint;
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s POINTS THREADS\n", argv[0]);
    return 2;
  }
  registration::ReturnFreedMemory();
  const auto points = static_cast<std::size_t>(std::atoll(argv[1]));
  const int threads = std::atoi(argv[2]);
  const double program_mb = ResidentMb("VmRSS");
  bench::PreparedBlade prepared;
  prepared.blade = bench::TwistedBlade();
  metrology::ScanPortion portion;
  portion.id = "scan";
  portion.scan_point_count = static_cast<std::int64_t>(points);
  {
    bench::CaseSampler sampler(prepared.blade, bench::CaseKind::kWellHeld, bench::kNoiseMm, std::nullopt, 1);
    portion.sensor.reserve(points);
    for (std::size_t i = 0; i < points; ++i) portion.sensor.Add(sampler.NextScanned());
  }
  prepared.blade.normals.clear();
  prepared.blade.normals.shrink_to_fit();
  prepared.blade.areas_mm2.clear();
  prepared.blade.areas_mm2.shrink_to_fit();
  const double points_mb = ResidentMb("VmRSS");
  prepared.surface = bench::SurfaceOf(std::move(prepared.blade.mesh), threads);
  const double surface_mb = ResidentMb("VmRSS");
  const bench::TimedFit timed = bench::FitPortion(prepared, std::move(portion), threads);
  const double peak_mb = ResidentMb("VmHWM");
  prepared.blade.mesh = prepared.surface->mesh();
  const double error_um = bench::VertexDisplacementUm(prepared.blade, timed.stopped_at, bench::ScanFromPart());
  std::printf("%.3f %.3f %.3f %.3f %.3f %.4f %d\n", program_mb, points_mb, surface_mb, peak_mb, timed.seconds, error_um,
              timed.converged ? 1 : 0);
  return 0;
}
