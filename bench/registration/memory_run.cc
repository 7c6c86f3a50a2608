// Peak memory of a process that does nothing but fit one large scan.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <fstream>

#include "bench/registration/runs.h"

namespace sixpoint::bench {
namespace {

double ResidentMb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind(field + ":", 0) == 0) return std::stod(line.substr(field.size() + 1)) / 1024;
  return 0;
}

}  // namespace

int FitAndPrintPeak(std::size_t points, int threads) {
  const PreparedBlade prepared = PrepareBlade(threads);
  const double surface_mb = ResidentMb("VmRSS");
  metrology::ScanPortion portion;
  portion.id = "scan";
  portion.scan_point_count = static_cast<std::int64_t>(points);
  {
    CaseSampler sampler(prepared.blade, CaseKind::kWellHeld, kNoiseMm, std::nullopt, 1);
    portion.sensor.reserve(points);
    for (std::size_t i = 0; i < points; ++i) portion.sensor.Add(sampler.NextScanned());
  }
  const double points_mb = ResidentMb("VmRSS");
  const TimedFit timed = FitPortion(prepared, std::move(portion), threads);
  std::printf("%.3f %.3f %.3f %.3f %.4f %d\n", surface_mb, points_mb, ResidentMb("VmHWM"), timed.seconds,
              VertexDisplacementUm(prepared.blade, timed.fit.zero_from_part, ScanFromPart()), timed.converged ? 1 : 0);
  return 0;
}

void RunMemory(const PreparedBlade&, const RunOptions& options, Figures* figures) {
  std::array<int, 2> ends;
  if (pipe(ends.data()) != 0) {
    ++figures->failures;
    std::perror("memory: pipe");
    return;
  }
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    // A program of its own: nothing that this one has touched counts.
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    const std::string points = std::to_string(options.memory_points), threads = std::to_string(options.threads);
    execl("/proc/self/exe", "sixpoint-bench-registration", "--fit-points", points.c_str(), "--threads", threads.c_str(),
          static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[1]);
  double surface_mb = 0, points_mb = 0, peak_mb = 0, seconds = 0, error_um = 0;
  int converged = 0;
  FILE* said = fdopen(ends[0], "r");
  const int read =
      std::fscanf(said, "%lf %lf %lf %lf %lf %d", &surface_mb, &points_mb, &peak_mb, &seconds, &error_um, &converged);
  std::fclose(said);
  int status = 0;
  waitpid(child, &status, 0);
  if (child < 0 || read != 6 || status != 0 || converged == 0) {
    ++figures->failures;
    std::printf("\nmemory: the process that fits ended with %d, converged %d\n", status, converged);
    return;
  }
  std::printf(
      "\nmemory: %zu points: %.0f MB at the peak (surface %.0f, with points %.0f), fit in %.2f s, error %.4f um\n",
      options.memory_points, peak_mb, surface_mb, points_mb, seconds, error_um);
  figures->values["memory_mb"] = peak_mb;
  figures->values["memory_fit_seconds"] = seconds;
}

}  // namespace sixpoint::bench
