#include "services/calibration/study_runner.h"

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "services/calibration/calibration_messages.h"
#include "services/calibration/refusals.h"
#include "services/calibration/study_messages.h"
#include "services/calibration/validate.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/limits.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::calibration {
namespace {

using runtime::NotKnown;
using runtime::Refuse;

constexpr runtime::ErrorReason kUndetermined = errors::v1::STUDY_UNDETERMINED;
constexpr int kMostCalibrations = 500, kMostObservations = 100000, kMostPoints = 100000, kMostLengths = 1000,
              kMostName = 64;
constexpr std::size_t kMostScanPoints = 40'000'000;
constexpr int kFewestCalibrations = 3;
constexpr double kMmPerUm = 1e-3;

absl::Status CheckLimit(const std::string& field, double value) {
  if (std::isfinite(value) && value >= 0) return absl::OkStatus();
  return Refuse(field, value, "> 0, or 0 for none");
}

template <typename Request>
absl::Status CheckCommon(const Request& request) {
  if (absl::Status s = CheckEvent("", request.requested_by(), request.request_id()); !s.ok()) return s;
  return CheckEnvironment(request.environment());
}

// The machine that a study names, or none.
absl::StatusOr<std::string> MachineIn(const std::string& name, const clients::PlantClient& plant, const Caller& caller,
                                      std::vector<std::string>* inputs) {
  if (name.empty()) return std::string();
  const absl::StatusOr<std::string> id = runtime::IdOf("machine", "machines", name);
  if (!id.ok()) return id.status();
  const absl::StatusOr<plant::v1::Machine> machine = plant.GetMachine(name, 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", name, machine.status());
  inputs->push_back(name + "@" + std::to_string(machine->revision()));
  return *id;
}

absl::StatusOr<runtime::Made<storage::StudyRow>> RecordOf(v1::Study study, const std::string& request_bytes) {
  storage::StudyRow row;
  row.study_id = storage::NewUuid();
  if (!study.machine().empty()) row.machine_id = runtime::LastSegment(study.machine());
  row.kind = KindText(study.kind());
  row.inputs.assign(study.inputs().begin(), study.inputs().end());
  row.request_bytes = request_bytes;
  row.verdict = VerdictText(study.verdict());
  row.requested_by = study.requested_by();
  row.software_version = study.software_version();
  if (study.environment().has_temperature_c()) row.temperature_c = study.environment().temperature_c();
  absl::StatusOr<std::string> json = JsonOf(study);
  if (!json.ok()) return json.status();
  row.result_json = *std::move(json);
  storage::RecordEntry entry;
  entry.kind = "study";
  entry.name = runtime::NameOf("studies", row.study_id);
  entry.inputs = row.inputs;
  if (!row.machine_id.empty()) entry.machine = row.machine_id;
  entry.method = row.kind;
  entry.software_version = row.software_version;
  entry.requested_by = row.requested_by;
  entry.summary_json = nlohmann::json{{"kind", row.kind}, {"verdict", row.verdict}}.dump();
  return runtime::Made<storage::StudyRow>{std::move(row), std::move(entry)};
}

absl::Status CheckSubject(const ingest::v1::Scan& scan, const ingest::v1::Scan& first, bool arm_only) {
  const ingest::v1::ScanHeader &header = scan.header(), &wanted = first.header();
  const bool artefact = header.kind() == ingest::v1::SCAN_KIND_ARM || header.kind() == ingest::v1::SCAN_KIND_ARTEFACT;
  if (arm_only ? header.kind() != ingest::v1::SCAN_KIND_ARM : !artefact)
    return Refuse("scans", scan.name() + " of kind " + ingest::v1::ScanKind_Name(header.kind()),
                  arm_only ? "scans of kind SCAN_KIND_ARM" : "scans of kind SCAN_KIND_ARM or SCAN_KIND_ARTEFACT");
  if (header.machine() != wanted.machine())
    return Refuse("scans", scan.name() + " of " + header.machine(), "scans of " + wanted.machine());
  if (header.subject() != wanted.subject())
    return Refuse("scans", scan.name() + " of " + header.subject(), "scans of " + wanted.subject());
  if (header.a_deg() != wanted.a_deg() || header.b_deg() != wanted.b_deg())
    return Refuse("scans",
                  scan.name() + " at A " + std::to_string(header.a_deg()) + ", B " + std::to_string(header.b_deg()),
                  "A and B as in " + first.name());
  return absl::OkStatus();
}

}  // namespace

struct StudyRunner::FetchedScans {
  std::vector<metrology::LineScan> scans;
  plant::v1::Machine machine;
  plant::v1::Artefact artefact;
  std::vector<std::string> inputs;  // machine, artefact, scans
};

StudyRunner::StudyRunner(std::shared_ptr<storage::StudyStore> store,
                         std::shared_ptr<const storage::CalibrationReader> calibrations,
                         std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest)
    : store_(std::move(store)),
      calibrations_(std::move(calibrations)),
      plant_(std::move(plant)),
      scans_(std::move(ingest)) {}

absl::StatusOr<StudyRunner::FetchedScans> StudyRunner::Fetch(
    const google::protobuf::RepeatedPtrField<std::string>& names, bool arm_only, const Caller& caller) const {
  FetchedScans fetched;
  ingest::v1::Scan first;
  std::size_t point_count = 0;
  for (const std::string& name : names) {
    absl::StatusOr<clients::FetchedScan> scan = scans_.Fetch(name, caller.make_context());
    if (!scan.ok()) return NotKnown("scans", name, scan.status());
    if (fetched.scans.empty()) first = scan->record;
    if (absl::Status s = CheckSubject(scan->record, first, arm_only); !s.ok()) return s;
    point_count += scan->scan.points_mm.size();
    if (point_count > kMostScanPoints)
      return Refuse("scans", std::to_string(point_count) + " points", "at most 40000000 together");
    scan->scan.id = runtime::LastSegment(name);
    fetched.scans.push_back(std::move(scan->scan));
    fetched.inputs.push_back(name);
  }
  auto machine = plant_.GetMachine(first.header().machine(), 0, caller.make_context());
  if (!machine.ok()) return machine.status();
  fetched.machine = *std::move(machine);
  auto artefact = plant_.GetArtefact(first.header().subject(), 0, caller.make_context());
  if (!artefact.ok()) return artefact.status();
  fetched.artefact = *std::move(artefact);
  const auto revised = [](const auto& thing) { return thing.name() + "@" + std::to_string(thing.revision()); };
  fetched.inputs.insert(fetched.inputs.begin(), {revised(fetched.machine), revised(fetched.artefact)});
  return fetched;
}

template <typename Request>
absl::StatusOr<v1::Study> StudyRunner::Recorded(const char* call, const Request& request, const Caller& caller,
                                                absl::StatusOr<v1::Study> (StudyRunner::*run)(const Request&,
                                                                                              const Caller&)
                                                    const) const {
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::StudyRow>> {
    absl::StatusOr<v1::Study> study = (this->*run)(request, caller);
    if (!study.ok()) return study.status();
    study->set_requested_by(request.requested_by());
    study->set_software_version(runtime::SoftwareVersion());
    if (request.has_environment()) *study->mutable_environment() = request.environment();
    return RecordOf(*std::move(study), request.SerializeAsString());
  };
  const auto to_proto = [](const storage::StudyRow& row) { return ToProto(row); };
  return runtime::RecordedResult<v1::Study>(store_.get(), call, request, caller.deadline, make, to_proto);
}

absl::StatusOr<v1::Study> StudyRunner::RunGauge(const v1::RunGaugeStudyRequest& request, const Caller& caller) {
  constexpr char kCall[] = "calibration.RunGaugeStudy";
  if (absl::Status s = CheckCommon(request); !s.ok()) return s;
  if (absl::Status s = runtime::CheckNames("scans", "scans", request.scans(), metrology::kFewestGaugeScans,
                                           runtime::kMostStudyScans);
      !s.ok())
    return s;
  return Recorded(kCall, request, caller, &StudyRunner::Gauge);
}

absl::StatusOr<v1::Study> StudyRunner::Gauge(const v1::RunGaugeStudyRequest& request, const Caller& caller) const {
  absl::StatusOr<FetchedScans> fetched = Fetch(request.scans(), false, caller);
  if (!fetched.ok()) return fetched.status();
  metrology::GaugeStudyOptions options;
  if (request.has_region())
    options.region = metrology::StripRegion{request.region().x_minimum_mm(), request.region().x_maximum_mm(),
                                            request.region().y_minimum_mm(), request.region().y_maximum_mm()};
  if (request.station_pitch_mm() != 0) options.station_pitch_mm = request.station_pitch_mm();
  options.limit_um = request.limit_um();
  const absl::StatusOr<metrology::GaugeStudy> result = metrology::StudyGauge(fetched->scans, options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study;
  study.set_kind(v1::STUDY_KIND_GAUGE);
  study.set_machine(fetched->machine.name());
  study.mutable_inputs()->Add(fetched->inputs.begin(), fetched->inputs.end());
  study.set_verdict(ToProto(result->verdict));
  *study.mutable_gauge() = ToProto(*result, request.limit_um());
  return study;
}

absl::StatusOr<storage::CalibrationRow> StudyRunner::SensorCalibration(const v1::RunArmStudyRequest& request,
                                                                       const std::string& machine,
                                                                       const Caller& caller) const {
  const std::string machine_id = runtime::LastSegment(machine);
  if (request.sensor_calibration().empty()) {
    auto in_force = calibrations_->InForce({machine_id, "sensor"}, std::chrono::system_clock::now(), caller.deadline);
    if (!in_force.ok()) return in_force.status();
    if (in_force->has_value()) return **std::move(in_force);
    return runtime::Failure(
        errors::v1::CALIBRATION_MISSING,
        machine + ": no sensor calibration in force, want one; name one that is not (a draft will do)",
        {{"resource", machine}});
  }
  const auto id = runtime::IdOf("sensor_calibration", "calibrations", request.sensor_calibration());
  if (!id.ok()) return id.status();
  auto found = calibrations_->Find(*id, caller.deadline);
  if (!found.ok()) return found.status();
  if (!found->has_value() || !(**found).sensor || (**found).machine_id != machine_id)
    return Refuse("sensor_calibration", request.sensor_calibration(), "a sensor calibration of " + machine);
  return **std::move(found);
}

absl::StatusOr<v1::Study> StudyRunner::RunArm(const v1::RunArmStudyRequest& request, const Caller& caller) {
  constexpr char kCall[] = "calibration.RunArmStudy";
  if (absl::Status s = CheckCommon(request); !s.ok()) return s;
  if (absl::Status s = CheckLimit("limit_um", request.limit_um()); !s.ok()) return s;
  if (absl::Status s =
          runtime::CheckNames("scans", "scans", request.scans(), metrology::kFewestArmScans, runtime::kMostStudyScans);
      !s.ok())
    return s;
  return Recorded(kCall, request, caller, &StudyRunner::Arm);
}

absl::StatusOr<v1::Study> StudyRunner::Arm(const v1::RunArmStudyRequest& request, const Caller& caller) const {
  absl::StatusOr<FetchedScans> fetched = Fetch(request.scans(), true, caller);
  if (!fetched.ok()) return fetched.status();
  const absl::StatusOr<metrology::Artefact> artefact = ArtefactOf(fetched->artefact);
  if (!artefact.ok()) return WithReason(artefact.status());

  const absl::StatusOr<storage::CalibrationRow> calibration =
      SensorCalibration(request, fetched->machine.name(), caller);
  if (!calibration.ok()) return calibration.status();
  metrology::ArmStudyOptions options;
  options.optics = OpticsOf(fetched->machine.sensor());
  options.keep_going = caller.keep_going;
  for (int k = 0; k < 9; ++k)
    options.sensor.rotation(k / 3, k % 3) = calibration->sensor->machine_from_sensor_rotation.at(k);
  for (int k = 0; k < 3; ++k) options.sensor.t_sm_mm(k) = calibration->sensor->t_sm_mm.at(k);
  const auto result = metrology::StudyArm(fetched->scans, *artefact, options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study;
  study.set_kind(v1::STUDY_KIND_ARM);
  study.set_machine(fetched->machine.name());
  study.mutable_inputs()->Add(fetched->inputs.begin(), fetched->inputs.end());
  *study.mutable_arm() = ToProto(*result, request.limit_um());
  study.mutable_arm()->set_sensor_calibration(runtime::NameOf("calibrations", calibration->calibration_id));
  study.add_inputs(study.arm().sensor_calibration());
  study.set_verdict(VerdictOf(study.arm()));
  return study;
}

absl::StatusOr<v1::Study> StudyRunner::RunRepeat(const v1::RunRepeatStudyRequest& request, const Caller& caller) {
  constexpr char kCall[] = "calibration.RunRepeatStudy";
  if (absl::Status s = CheckCommon(request); !s.ok()) return s;
  if (absl::Status s = runtime::CheckNames("calibrations", "calibrations", request.calibrations(), kFewestCalibrations,
                                           kMostCalibrations);
      !s.ok())
    return s;
  return Recorded(kCall, request, caller, &StudyRunner::Repeat);
}

absl::StatusOr<v1::Study> StudyRunner::Repeat(const v1::RunRepeatStudyRequest& request, const Caller& caller) const {
  std::vector<storage::CalibrationRow> rows;
  for (int i = 0; i < request.calibrations_size(); ++i) {
    const std::string& name = request.calibrations(i);
    auto found = calibrations_->Find(runtime::LastSegment(name), caller.deadline);
    if (!found.ok()) return found.status();
    if (!found->has_value()) return Refuse(Indexed("calibrations", i), name, "one that is recorded");
    if (!(**found).sensor)
      return Refuse(Indexed("calibrations", i), name + " of kind " + (**found).kind(), "sensor calibrations");
    if (!rows.empty() && rows.front().machine_id != (**found).machine_id)
      return Refuse(Indexed("calibrations", i), name + " of machines/" + (**found).machine_id,
                    "calibrations of machines/" + rows.front().machine_id);
    if (!rows.empty() && rows.front().method != (**found).method)
      return Refuse(Indexed("calibrations", i), name + " by " + (**found).method,
                    "calibrations by one method, as the first (" + rows.front().method + ")");
    rows.push_back(**std::move(found));
  }
  v1::Study study;
  study.set_kind(v1::STUDY_KIND_REPEAT);
  study.set_machine(runtime::NameOf("machines", rows.front().machine_id));
  *study.mutable_inputs() = request.calibrations();
  study.set_verdict(v1::STUDY_VERDICT_REPORTED);
  *study.mutable_repeat() = RepeatOf(rows);
  return study;
}

absl::StatusOr<v1::Study> StudyRunner::RunGaugeRr(const v1::RunGaugeRrRequest& request, const Caller& caller) {
  constexpr char kCall[] = "calibration.RunGaugeRr";
  if (absl::Status s = CheckCommon(request); !s.ok()) return s;
  if (absl::Status s = CheckLimit("limit_percent", request.limit_percent()); !s.ok()) return s;
  for (const auto& [field, text] : {std::pair<const char*, const std::string&>{"outer_name", request.outer_name()},
                                    {"inner_name", request.inner_name()},
                                    {"unit", request.unit()}})
    if (text.empty() || text.size() > kMostName) return Refuse(field, text, "1 to 64 characters");
  if (request.observations_size() > kMostObservations)
    return Refuse("observations", std::to_string(request.observations_size()) + " of them", "at most 100000");
  if (!v1::PartLevel_IsValid(request.part_level()))
    return Refuse("part_level", std::to_string(request.part_level()), "INNER or OUTER");
  return Recorded(kCall, request, caller, &StudyRunner::GaugeRr);
}

absl::StatusOr<v1::Study> StudyRunner::GaugeRr(const v1::RunGaugeRrRequest& request, const Caller& caller) const {
  v1::RunGaugeRrRequest filled = request;
  if (filled.confidence() == 0) filled.set_confidence(0.95);
  if (filled.part_level() == v1::PART_LEVEL_UNSPECIFIED) filled.set_part_level(v1::PART_LEVEL_INNER);
  std::vector<metrology::NestedObservation> observations;
  for (const v1::Observation& o : request.observations()) observations.push_back({o.outer(), o.inner(), o.value()});
  const metrology::NestedOptions options{filled.confidence(), filled.balanced_only(),
                                         filled.part_level() == v1::PART_LEVEL_OUTER};
  const absl::StatusOr<metrology::NestedVariance> result = metrology::AnalyseNested(observations, options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study;
  study.set_kind(v1::STUDY_KIND_GAUGE_RR);
  std::vector<std::string> inputs;
  const absl::StatusOr<std::string> machine = MachineIn(request.machine(), plant_, caller, &inputs);
  if (!machine.ok()) return machine.status();
  study.set_machine(request.machine());
  study.mutable_inputs()->Add(inputs.begin(), inputs.end());
  *study.mutable_gauge_rr() = ToProto(*result, filled);
  // Its own interval says whether the limit is kept: the upper bound below it, or the lower one above.
  const double total = study.gauge_rr().lines(3).standard_deviation(), limit = request.limit_percent() / 100 * total;
  study.set_verdict(request.limit_percent() == 0                 ? v1::STUDY_VERDICT_REPORTED
                    : study.gauge_rr().gauge_rr_upper() <= limit ? v1::STUDY_VERDICT_ACCEPTED
                    : study.gauge_rr().gauge_rr_lower() > limit  ? v1::STUDY_VERDICT_REJECTED
                                                                 : v1::STUDY_VERDICT_UNDECIDABLE);
  return study;
}

absl::StatusOr<v1::Study> StudyRunner::RunSphereCheck(const v1::RunSphereCheckRequest& request, const Caller& caller) {
  constexpr char kCall[] = "calibration.RunSphereCheck";
  if (absl::Status s = CheckCommon(request); !s.ok()) return s;
  if (request.points_mm_size() > kMostPoints || request.lengths_size() > kMostLengths)
    return Refuse(request.points_mm_size() > kMostPoints ? "points_mm" : "lengths", "too many",
                  "at most 100000 points and 1000 lengths");
  return Recorded(kCall, request, caller, &StudyRunner::SphereCheck);
}

absl::StatusOr<v1::Study> StudyRunner::SphereCheck(const v1::RunSphereCheckRequest& request,
                                                   const Caller& caller) const {
  metrology::Points points;
  for (int i = 0; i < request.points_mm_size(); ++i) {
    const absl::StatusOr<Eigen::Vector3d> p = runtime::FromProto(Indexed("points_mm", i), request.points_mm(i));
    if (!p.ok()) return p.status();
    points.push_back(*p);
  }
  std::vector<metrology::MeasuredLength> lengths;
  for (int i = 0; i < request.lengths_size(); ++i) {
    const v1::LengthMeasurement& l = request.lengths(i);
    if (l.standard().empty() || l.standard().size() > kMostName)
      return Refuse(Indexed("lengths", i) + ".standard", l.standard(), "1 to 64 characters");
    lengths.push_back(
        {l.standard(), l.calibrated_mm(), kMmPerUm * l.calibrated_standard_uncertainty_um(), l.measured_mm()});
  }
  metrology::SphereCheckOptions options;
  options.diameter_mm = request.diameter_mm();
  options.diameter_standard_uncertainty_mm = kMmPerUm * request.diameter_standard_uncertainty_um();
  options.sphere_form_mm = kMmPerUm * request.sphere_form_um();
  options.form_mpe_mm = kMmPerUm * request.form_mpe_um();
  options.size_mpe_mm = kMmPerUm * request.size_mpe_um();
  options.length_mpe_mm = kMmPerUm * request.length_mpe_um();
  options.length_mpe_divisor = request.length_mpe_divisor();
  if (request.least_points() != 0) options.least_points = request.least_points();
  const absl::StatusOr<metrology::SphereCheck> result = metrology::CheckSphere(points, lengths, options);
  if (!result.ok()) return WithReason(result.status(), kUndetermined);
  v1::Study study;
  study.set_kind(v1::STUDY_KIND_SPHERE_CHECK);
  std::vector<std::string> inputs;
  const absl::StatusOr<std::string> machine = MachineIn(request.machine(), plant_, caller, &inputs);
  if (!machine.ok()) return machine.status();
  study.set_machine(request.machine());
  study.mutable_inputs()->Add(inputs.begin(), inputs.end());
  *study.mutable_sphere_check() = ToProto(*result);
  study.mutable_sphere_check()->set_point_count(request.points_mm_size());
  study.set_verdict(ToProto(result->verdict));
  return study;
}

}  // namespace sixpoint::calibration
