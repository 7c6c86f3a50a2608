// Surfaces of parts: each CAD file is read once for each method of tessellation, and kept.
#pragma once

#include <absl/status/statusor.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "services/plant/cad_worker.h"
#include "services/runtime/compute_pool.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

// Thread-safe.
class Surfaces {
 public:
  // At most worker_count CAD files are read at once; more are refused with RESOURCE_EXHAUSTED.
  Surfaces(CadWorkerOptions options, std::shared_ptr<storage::SurfaceStore> store, int worker_count);

  // The stored tessellation of this CAD, after reading it where there is none. Kept on its own: a surface is true of
  // its CAD whatever becomes of the part.
  absl::StatusOr<storage::TessellationRow> Of(const std::string& format, double unit_mm, const std::string& solid,
                                              const std::string& cad, storage::Deadline deadline,
                                              const std::function<bool()>& keep_going);

  // How many times a worker was started.
  int read_count() const { return read_count_; }

 private:
  absl::StatusOr<std::string> Read(const CadFile& file, const std::string& cad, storage::Deadline deadline,
                                   const std::function<bool()>& keep_going);

  const CadWorkerOptions options_;
  const std::shared_ptr<storage::SurfaceStore> store_;
  runtime::ComputePool files_at_once_;
  std::atomic<int> read_count_ = 0;
};

}  // namespace sixpoint::plant
