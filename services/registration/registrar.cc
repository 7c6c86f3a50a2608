#include "services/registration/registrar.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <future>
#include <optional>
#include <utility>
#include <vector>

#include "metrology/registration/angle_influence.h"
#include "metrology/registration/registration.h"
#include "services/registration/fitting.h"
#include "services/registration/registration_messages.h"
#include "services/registration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/requests.h"

namespace sixpoint::registration {
namespace {

constexpr char kCall[] = "registration.Register";
constexpr std::int64_t kPointBudget = 400'000;          // of all scans together, after thinning
constexpr std::int64_t kRegionPointBudget = 4'000'000;  // where only regions of them count
constexpr std::int64_t kMostPoints = 100'000'000;

std::string Revised(const std::string& name, int revision) { return name + "@" + std::to_string(revision); }

// What was asked for and is not there is the request's fault.
absl::Status NotKnown(const std::string& field, const std::string& name, const absl::Status& status) {
  return absl::IsNotFound(status) ? runtime::Refuse(field, name, "one that the plant knows") : status;
}

void Say(const Caller& caller, v1::RegistrationStep step, int scan_count, int iteration_count) {
  if (!caller.on_progress) return;
  v1::RegistrationProgress progress;
  progress.set_step(step);
  progress.set_scan_count(scan_count);
  progress.set_iteration_count(iteration_count);
  caller.on_progress(progress);
}

absl::StatusOr<std::optional<v1::Registration>> KeptAnswer(storage::Transaction& transaction,
                                                           const v1::RegisterRequest& request) {
  const auto kept = storage::FindAnswer(transaction, kCall, request.request_id(), request.SerializeAsString());
  if (!kept.ok()) return kept.status();
  if (!kept->has_value()) return std::nullopt;
  v1::Registration answer;
  if (!answer.ParseFromString(**kept)) return absl::DataLossError("the kept answer cannot be read");
  return answer;
}

// Registration, journal entry and answer in one transaction. No connection was held while the kernel worked, so the
// answer is looked for again.
absl::StatusOr<v1::Registration> Store(storage::Database* database, const v1::RegisterRequest& request,
                                       storage::RegistrationRow row, storage::Deadline deadline) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  auto kept = KeptAnswer(*transaction, request);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return **std::move(kept);
  row.registration_id = storage::NewUuid();
  row.requested_by = request.requested_by();
  row.software_version = runtime::SoftwareVersion();
  storage::RecordEntry entry;
  entry.kind = "registration";
  entry.name = runtime::NameOf("registrations", row.registration_id);
  entry.inputs = {Revised(runtime::NameOf("machines", row.machine_id), row.machine_revision),
                  Revised(runtime::NameOf("parts", row.part_id), row.part_revision), request.blade(),
                  runtime::NameOf("calibrations", row.sensor_calibration_id),
                  runtime::NameOf("calibrations", row.rotation_calibration_id)};
  for (const storage::RegistrationAngleRow& angle : row.angles)  // each name is kept once
    entry.inputs.push_back(runtime::NameOf("characterisations", angle.characterisation_id));
  entry.inputs.insert(entry.inputs.end(), request.scans().begin(), request.scans().end());
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = row.method;
  entry.software_version = row.software_version;
  entry.requested_by = row.requested_by;
  entry.summary_json = SummaryOf(row);
  const absl::StatusOr<storage::Recorded> recorded = storage::InsertRegistration(*transaction, row, entry);
  if (!recorded.ok()) return recorded.status();
  row.recorded = *recorded;
  const absl::StatusOr<v1::Registration> answer = ToProto(row);
  if (!answer.ok()) return answer.status();
  absl::Status status = storage::KeepAnswer(*transaction, kCall, request.request_id(), request.SerializeAsString(),
                                            answer->SerializeAsString());
  if (!status.ok()) return status;
  if (status = transaction->Commit(); !status.ok()) return status;
  return answer;
}

}  // namespace

struct Registrar::Inputs {
  plant::v1::Part part;
  plant::v1::Machine machine;
  std::shared_ptr<const metrology::Surface> surface;
  Asked asked;
  metrology::MachineCalibration calibration;
  std::string sensor_calibration, rotation_calibration;
  std::array<std::string, 2> letters;            // the machine's, of a and b
  std::array<std::string, 2> characterisations;  // whose tables are applied to a and b; empty: none
  std::string remark;
  std::vector<metrology::ScanPortion> portions;
};

Registrar::Registrar(storage::Database* database, const Peers& peers, const RegistrarLimits& limits)
    : database_(database),
      plant_(peers.plant, limits.surface_bytes),
      scans_(peers.ingest),
      calibrations_(peers.calibration),
      threads_(limits.threads),
      pool_(limits.pool, "registrations", errors::v1::REGISTRATIONS_FULL) {}

absl::StatusOr<Registrar::Inputs> Registrar::FetchInputs(const v1::RegisterRequest& request,
                                                         const Caller& caller) const {
  Inputs inputs;
  const auto blade = plant_.GetBlade(request.blade(), caller.make_context());
  if (!blade.ok()) return NotKnown("blade", request.blade(), blade.status());
  auto part = plant_.GetPart(blade->part(), 0, caller.make_context());
  if (!part.ok()) return NotKnown("blade.part", blade->part(), part.status());
  inputs.part = *std::move(part);
  if (IsSixPoint(request.method())) {
    auto datums = DatumsOf(inputs.part);
    if (!datums.ok()) return datums.status();
    inputs.asked.datums = *std::move(datums);
  }
  auto options = FitOptionsOf(request.options(), inputs.part);
  if (!options.ok()) return options.status();
  inputs.asked.options = *std::move(options);
  inputs.asked.options.thread_count = threads_;
  inputs.asked.options.keep_going = caller.keep_going;
  inputs.asked.options.on_iteration = [&caller, scan_count = request.scans_size()](int count) {
    Say(caller, v1::REGISTRATION_STEP_FITTING, scan_count, count);
  };
  inputs.asked.allowance = AllowanceOptionsOf(request.options());
  inputs.asked.method = request.method();
  const auto nominal = runtime::FromProto("part.zero_from_part_nominal", inputs.part.zero_from_part_nominal());
  if (!nominal.ok()) return nominal.status();
  inputs.asked.zero_from_part_nominal = *nominal;
  auto surface = plant_.GetSurface(inputs.part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  inputs.surface = *std::move(surface);
  if (absl::Status status = FetchScans(request, caller, &inputs); !status.ok()) return status;
  return inputs;
}

// Scan by scan, each decoded block by block and thinned; the next is fetched meanwhile. The calibrations are those of the
// first scan's machine.
absl::Status Registrar::FetchScans(const v1::RegisterRequest& request, const Caller& caller, Inputs* inputs) const {
  const auto fetch = [&](int i) { return scans_.FetchBlocks(request.scans(i), caller.make_context()); };
  metrology::Thinning thinning;
  thinning.target_count =
      (inputs->asked.options.regions_in.empty() ? kPointBudget : kRegionPointBudget) / request.scans_size();
  for (const metrology::DatumPoint& datum : inputs->asked.datums)
    thinning.dense_places_mm.push_back(inputs->asked.zero_from_part_nominal * datum.point_mm);
  ingest::v1::Scan first;
  std::int64_t point_count = 0;
  std::future<absl::StatusOr<clients::StoredBlocks>> next = std::async(std::launch::async, fetch, 0);
  for (int i = 0; i < request.scans_size(); ++i) {
    absl::StatusOr<clients::StoredBlocks> fetched = next.get();
    if (!fetched.ok()) return NotKnown("scans[" + std::to_string(i) + "]", request.scans(i), fetched.status());
    if (caller.keep_going && !caller.keep_going()) return absl::CancelledError("register: stopped by its caller");
    if (i == 0) first = fetched->record;
    if (absl::Status status = CheckScan(request, fetched->record, first); !status.ok()) return status;
    const std::int64_t scan_point_count = fetched->record.header().point_count();
    point_count += scan_point_count;
    if (point_count > kMostPoints)
      return runtime::Refuse("scans", std::to_string(point_count) + " points", "at most 100000000 together");
    if (i + 1 < request.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    if (i == 0) {
      const std::string& machine = first.header().machine();
      auto record = plant_.GetMachine(machine, 0, caller.make_context());
      if (!record.ok()) return NotKnown("scans[0].machine", machine, record.status());
      inputs->machine = *std::move(record);
      auto sensor = calibrations_.SensorInForce(machine, caller.make_context());
      if (!sensor.ok()) return sensor.status();
      auto rotation = calibrations_.RotationInForce(machine, caller.make_context());
      if (!rotation.ok()) return rotation.status();
      inputs->calibration = {sensor->sensor, rotation->axes, rotation->covariance};
      inputs->sensor_calibration = sensor->name;
      inputs->rotation_calibration = rotation->name;
      inputs->letters = rotation->letters;
      if (request.apply_axis_tables())
        if (absl::Status status = FetchAxisTables(machine, *rotation, caller, inputs); !status.ok()) return status;
    }
    fetched->scan.id = *runtime::IdOf("scan", "scans", request.scans(i));
    metrology::Thinner thinner(fetched->scan, scan_point_count, inputs->calibration, thinning);
    if (absl::Status status = fetched->Decode([&](const metrology::Points& points_mm) { thinner.Add(points_mm); });
        !status.ok())
      return status;
    inputs->portions.push_back(thinner.Take());
    if (inputs->portions.back().sensor.size() == 0 || !inputs->portions.back().zero_from_sensor.matrix().allFinite())
      return runtime::Refuse(
          "scans[" + std::to_string(i) + "]",
          request.scans(i) + ", of whose " + std::to_string(scan_point_count) + " points none is at a finite place",
          "points, v0_mm and angles that are finite");
    Say(caller, v1::REGISTRATION_STEP_FETCHING, i + 1, 0);
  }
  return absl::OkStatus();
}

absl::Status Registrar::FetchAxisTables(const std::string& machine, const clients::FetchedRotationCalibration& rotation,
                                        const Caller& caller, Inputs* inputs) const {
  metrology::RotaryPositioning& positioning = inputs->calibration.positioning;
  std::string without;
  for (std::size_t i = 0; i < rotation.letters.size(); ++i) {
    auto axis = calibrations_.AxisInForce(machine, rotation.letters[i], caller.make_context());
    if (!axis.ok()) return axis.status();
    if (!axis->has_value()) continue;
    (i == 0 ? positioning.a : positioning.b) = (*axis)->positioning;
    inputs->characterisations[i] = (*axis)->name;
    if (std::find(rotation.inputs.begin(), rotation.inputs.end(), (*axis)->name) == rotation.inputs.end())
      without += (without.empty() ? "" : ", ") + rotation.letters[i];
  }
  if (!positioning.Applies())
    return runtime::Failure(errors::v1::AXIS_NOT_CHARACTERISED,
                            "apply_axis_tables: " + machine + ", whose axes " + rotation.letters[0] + " and " +
                                rotation.letters[1] +
                                " have no characterisation in force, want one; run `calibrate axis` first",
                            {{"resource", machine}});
  if (!without.empty())
    inputs->remark = "the rotary axes were calibrated without the table of " + without +
                     " that is applied here; calibrate them with it";
  return absl::OkStatus();
}

// A pose that an angle's own uncertainty unseats is none: it is kept with its evidence, not refused.
absl::Status Registrar::AddAngles(const Inputs& inputs, Fitted* fitted, std::vector<metrology::AngleInfluence>* angles,
                                  metrology::Matrix6d* difference) const {
  metrology::PoseFit& fit = fitted->fit;
  *angles = metrology::TabledAngles(inputs.portions, inputs.calibration.positioning);
  *difference = metrology::Matrix6d::Zero();
  if (fit.outcome != metrology::Outcome::kConverged || angles->empty()) return absl::OkStatus();
  Asked alone = inputs.asked;  // without what it is compared with, for its pose
  alone.in_words = false;
  if (alone.method == v1::METHOD_LOCAL) alone.method = v1::METHOD_BEST_FIT;
  const auto refit = [&](const std::vector<metrology::ScanPortion>& portions) -> absl::StatusOr<metrology::PoseFit> {
    auto again = FitAsked(*inputs.surface, portions, inputs.calibration, alone);
    if (!again.ok()) return again.status();
    return again->fit;
  };
  auto influences = metrology::InfluencesOf(inputs.portions, inputs.calibration, fit, refit);
  if (absl::IsFailedPrecondition(influences.status())) {
    fit.outcome = metrology::Outcome::kNotConverged;
    fit.evidence.remark = std::string(influences.status().message());
    fitted->best_fit.reset();
    return absl::OkStatus();
  }
  if (!influences.ok()) return influences.status();
  *angles = *std::move(influences);
  fit.covariance.values += metrology::PoseCovarianceOf(*angles);
  if (!fitted->best_fit.has_value()) return absl::OkStatus();
  auto others = metrology::InfluencesOf(
      inputs.portions, inputs.calibration, *fitted->best_fit, [&](const std::vector<metrology::ScanPortion>& portions) {
        return FitForComparison(*inputs.surface, portions, inputs.calibration, inputs.asked);
      });
  if (absl::IsFailedPrecondition(others.status())) {
    fitted->best_fit.reset();
    return absl::OkStatus();
  }
  if (!others.ok()) return others.status();
  for (std::size_t i = 0; i < others->size(); ++i)
    (*others)[i].pose_per_rad = (*angles)[i].pose_per_rad - (*others)[i].pose_per_rad;
  *difference = metrology::PoseCovarianceOf(*others);
  return absl::OkStatus();
}

absl::StatusOr<v1::Registration> Registrar::Register(const v1::RegisterRequest& request, const Caller& caller) {
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  if (!request.request_id().empty()) {
    absl::StatusOr<storage::Transaction> transaction = database_->Begin(caller.deadline);
    if (!transaction.ok()) return transaction.status();
    auto kept = KeptAnswer(*transaction, request);
    if (!kept.ok()) return kept.status();
    if (kept->has_value()) return **std::move(kept);
  }
  Say(caller, v1::REGISTRATION_STEP_WAITING, 0, 0);
  const absl::StatusOr<runtime::ComputePool::Slot> slot =
      pool_.Enter(caller.deadline, caller.keep_going, caller.patience);
  if (!slot.ok()) return slot.status();
  absl::StatusOr<v1::Registration> registration = Compute(request, caller);
  // A kernel that is told to stop does not know why.
  if (absl::IsCancelled(registration.status()) && std::chrono::system_clock::now() >= caller.deadline)
    return absl::DeadlineExceededError("register: its time was over before its end");
  return registration;
}

absl::StatusOr<v1::Registration> Registrar::Compute(const v1::RegisterRequest& request, const Caller& caller) {
  Say(caller, v1::REGISTRATION_STEP_FETCHING, 0, 0);
  const absl::StatusOr<Inputs> inputs = FetchInputs(request, caller);
  if (!inputs.ok()) return inputs.status();

  const auto started = std::chrono::steady_clock::now();
  absl::StatusOr<Fitted> fitted = FitAsked(*inputs->surface, inputs->portions, inputs->calibration, inputs->asked);
  if (!fitted.ok()) return fitted.status();
  std::vector<metrology::AngleInfluence> angles;
  metrology::Matrix6d difference;
  if (absl::Status status = AddAngles(*inputs, &*fitted, &angles, &difference); !status.ok()) return status;
  std::optional<metrology::Disagreement> disagreement;
  if (fitted->best_fit.has_value()) {
    auto compared = metrology::DisagreementOf(*inputs->surface, fitted->fit, *fitted->best_fit, inputs->calibration,
                                              difference, inputs->asked.options);
    if (!compared.ok()) return compared.status();
    disagreement = *std::move(compared);
    if (disagreement->beyond) Remark(InWords(*disagreement), &fitted->fit);
  }
  Remark(inputs->remark, &fitted->fit);

  absl::StatusOr<storage::RegistrationRow> described =
      RowOf(fitted->fit, FilledIn(request), fitted->allowance, disagreement);
  if (!described.ok()) return described.status();
  storage::RegistrationRow row = *std::move(described);
  row.blade_serial = *runtime::IdOf("blade", "blades", request.blade());
  row.method = MethodText(request.method());
  row.for_inspection = request.for_inspection();
  row.machine_revision = inputs->machine.revision();
  row.part_revision = inputs->part.revision();
  const auto id_of = [](const std::string& name) { return name.substr(name.find('/') + 1); };
  row.machine_id = id_of(inputs->machine.name());
  row.part_id = id_of(inputs->part.name());
  row.sensor_calibration_id = id_of(inputs->sensor_calibration);
  row.rotation_calibration_id = id_of(inputs->rotation_calibration);
  for (const metrology::AngleInfluence& angle : angles) {
    const std::size_t i = angle.axis == metrology::AngleInfluence::Axis::kA ? 0 : 1;
    row.angles.push_back(RowOf(angle, inputs->letters[i], id_of(inputs->characterisations[i]),
                               fitted->fit.outcome == metrology::Outcome::kConverged));
  }
  row.compute_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return Store(database_, request, std::move(row), caller.deadline);
}

}  // namespace sixpoint::registration
