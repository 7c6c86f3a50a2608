// What a registration rests on, fetched from the services that keep it and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metrology/registration/allowance.h"
#include "metrology/registration/register.h"
#include "services/clients/calibrations.h"
#include "services/clients/error_sources.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "services/registration/basis.h"
#include "services/registration/thinned_scans.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/measuring_plan.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

// One call.
struct Caller : runtime::Caller {
  // Hears how far it is; may be empty. On the thread that called.
  std::function<void(const v1::RegistrationProgress&)> on_progress = nullptr;
  runtime::ComputePool::Patience patience = runtime::ComputePool::Patience::kBounded;
};
void Say(const Caller& caller, v1::RegistrationStep step, int scan_count, int iteration_count);

struct Peers {
  std::shared_ptr<grpc::Channel> plant, ingest, calibration;
};

struct Inputs {
  plant::v1::Part part;
  plant::v1::Machine machine;
  std::shared_ptr<const metrology::Surface> surface;
  metrology::RegistrationTask task;
  metrology::MachineCalibration calibration;
  std::string sensor_calibration, rotation_calibration;
  std::array<std::string, 2> letters;            // the machine's, of a and b
  std::array<std::string, 2> characterisations;  // whose tables are applied to a and b; empty: none
  std::vector<std::string> further_names;        // of the calibrations and studies that it rests on beside the two
  ChosenSensor sensor;                           // of sensor_calibration
  std::chrono::system_clock::time_point scans_received_at;  // the last of them
  std::string clamping;                                     // stated, or the scans'; empty: neither
  std::string station;                                      // the scans'; empty: the part has none
  std::optional<std::int64_t> left_out_count;               // points that are not the station's; none: it has none
  std::optional<double> thermal_stretch;                    // of the scans together; none: no temperature is stated
  std::string remark;
  std::vector<metrology::ScanPortion> portions;
};

// What is kept between calls, beyond what is in use.
struct FetcherMemory {
  std::size_t surface_bytes = std::size_t{1} << 30;  // of prepared surfaces
  std::size_t scan_bytes = std::size_t{128} << 20;   // of thinned scans (kept_portions.h)
};

struct PlanInputs;  // measuring_plan.h

// Thread-safe.
class InputFetcher {
 public:
  // thread_count: of one fit.
  InputFetcher(const Peers& peers, const FetcherMemory& memory, int thread_count);

  // Of a request that CheckRequest let pass. INVALID_ARGUMENT: what it names is not known, or not of its blade or machine.
  // FAILED_PRECONDITION with a reason: calibrations, axis tables or datum points that it needs are not there.
  absl::StatusOr<Inputs> Fetch(const v1::RegisterRequest& request, const Caller& caller) const;
  // What a recorded one was computed from, whatever is in force now. DATA_LOSS, or FAILED_PRECONDITION (POINTS_DELETED): it is not there any more.
  absl::StatusOr<Inputs> FetchAsRecorded(const v1::Registration& recorded, const Caller& caller) const;
  // Machine and part as they are now, and the calibrations in force. INVALID_ARGUMENT and FAILED_PRECONDITION as Fetch; SENSOR_MOVED where the
  // scanner's newest interim check was not accepted.
  absl::StatusOr<PlanInputs> FetchForPlan(const v1::PlanMeasurementRequest& request,
                                          const runtime::Caller& caller) const;

 private:
  absl::StatusOr<Inputs> FetchBy(const Basis& basis, const v1::RegisterRequest& request, const Caller& caller) const;
  absl::Status FetchScans(const Basis& basis, const v1::RegisterRequest& request, const Caller& caller,
                          Inputs* inputs) const;
  static absl::Status FetchMachine(const Basis& basis, const v1::RegisterRequest& request, const ingest::v1::Scan& scan,
                                   Inputs* inputs);
  // How both axes position: by their tables where they are asked for, else as uncertain as they are characterised or stated.
  static absl::Status FetchPositioning(const Basis& basis, bool apply_axis_tables,
                                       const clients::FetchedRotationCalibration& rotation, Inputs* inputs);

  clients::PlantClient plant_;
  ThinnedScans scans_;
  clients::CalibrationClient calibrations_;
  int thread_count_;
};

// FAILED_PRECONDITION (SIX_POINTS_MISSING) unless the part has six.
absl::StatusOr<std::vector<metrology::DatumPoint>> DatumsOf(const plant::v1::Part& part);
// The options of a good request. Hole groups become balls round the part's hole starts; INVALID_ARGUMENT: the part has no such
// group.
absl::StatusOr<metrology::FitOptions> FitOptionsOf(const v1::FitOptions& options, const plant::v1::Part& part);

}  // namespace sixpoint::registration
