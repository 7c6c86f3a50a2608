// The service's logic: fetch what a registration rests on, compute, store.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/database.h"

namespace sixpoint::registration {

// One call: its deadline, its cancellation and contexts for the calls it makes.
struct Caller {
  storage::Deadline deadline;
  std::function<std::unique_ptr<grpc::ClientContext>()> make_context;
  std::function<bool()> keep_going;
  // Hears how far it is; may be empty. On the thread that called.
  std::function<void(const v1::RegistrationProgress&)> on_progress = nullptr;
  runtime::ComputePool::Patience patience = runtime::ComputePool::Patience::kBounded;
};

struct Peers {
  std::shared_ptr<grpc::Channel> plant, ingest, calibration;
};

struct RegistrarLimits {
  int threads = 2;                                   // of one registration
  runtime::PoolLimits pool;                          // registrations at once, with all that they hold in memory
  std::size_t surface_bytes = std::size_t{1} << 30;  // of prepared surfaces, beyond those in use
};

// Thread-safe.
class Registrar {
 public:
  Registrar(storage::Database* database, const Peers& peers, const RegistrarLimits& limits);

  // Nothing is stored unless all of it is. The same request_id again gives the same answer, without waiting for a turn.
  // RESOURCE_EXHAUSTED (REGISTRATIONS_FULL) where too many wait; DEADLINE_EXCEEDED and CANCELLED by the caller.
  absl::StatusOr<v1::Registration> Register(const v1::RegisterRequest& request, const Caller& caller);

 private:
  struct Inputs;
  absl::StatusOr<v1::Registration> Compute(const v1::RegisterRequest& request, const Caller& caller);
  absl::StatusOr<Inputs> FetchInputs(const v1::RegisterRequest& request, const Caller& caller) const;
  absl::Status FetchScans(const v1::RegisterRequest& request, const Caller& caller, Inputs* inputs) const;
  absl::Status FetchAxisTables(const std::string& machine, const clients::FetchedRotationCalibration& rotation,
                               const Caller& caller, Inputs* inputs) const;

  storage::Database* database_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
  clients::CalibrationClient calibrations_;
  int threads_;
  runtime::ComputePool pool_;
};

}  // namespace sixpoint::registration
