// Peak memory of a process that does nothing but fit one large scan (memory_program.cc).
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>

#include "bench/registration/runs.h"

namespace sixpoint::bench {

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
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    const std::string program = std::filesystem::read_symlink("/proc/self/exe").string() + "-memory";
    const std::string points = std::to_string(options.memory_points), threads = std::to_string(options.threads);
    execl(program.c_str(), program.c_str(), points.c_str(), threads.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[1]);
  double program_mb = 0, points_mb = 0, surface_mb = 0, peak_mb = 0, seconds = 0, error_um = 0;
  int converged = 0;
  FILE* said = fdopen(ends[0], "r");
  const int read = std::fscanf(said, "%lf %lf %lf %lf %lf %lf %d", &program_mb, &points_mb, &surface_mb, &peak_mb,
                               &seconds, &error_um, &converged);
  std::fclose(said);
  int status = 0;
  waitpid(child, &status, 0);
  if (child < 0 || read != 7 || status != 0 || converged == 0) {
    ++figures->failures;
    std::printf("\nmemory: the process that fits ended with %d, converged %d\n", status, converged);
    return;
  }
  std::printf(
      "\nmemory: %zu points: %.0f MB at the peak (program %.0f, with points and their blade %.0f, with surface %.0f), "
      "fit "
      "in %.2f s, error %.4f um\n",
      options.memory_points, peak_mb, program_mb, points_mb, surface_mb, seconds, error_um);
  figures->values["memory_mb"] = peak_mb;
  figures->values["memory_fit_seconds"] = seconds;
}

}  // namespace sixpoint::bench
