// Starts sixpoint-cad-worker for one CAD file. Whatever the file does to the parser, it does to that process.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <string>

namespace sixpoint::plant {

struct CadWorkerOptions {
  std::string program;  // path of sixpoint-cad-worker
  int memory_mb = 4096;
  int cpu_s = 120;
  std::chrono::milliseconds patience{150'000};  // wall clock
};

struct CadFile {
  std::string format;  // step, iges, stl
  double unit_mm = 1;  // stl only
  double chordal_error_um = 0.5;
  std::string solid = {};  // by name or number; empty: the only one
};

// Mesh bytes (MeshFromBytes), not yet checked. INVALID_ARGUMENT: the worker refused the file, crashed, or passed its
// limits of memory, CPU or time. UNAVAILABLE: it cannot be started. CANCELLED: keep_going said false.
absl::StatusOr<std::string> TessellateInWorker(const CadWorkerOptions& options, const CadFile& file,
                                               const std::string& cad, const std::function<bool()>& keep_going);

}  // namespace sixpoint::plant
