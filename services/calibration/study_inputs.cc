#include "services/calibration/study_inputs.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "refusal/message_text.h"
#include "services/calibration/inputs.h"
#include "services/calibration/newest_arm.h"
#include "services/calibration/readings.h"
#include "services/calibration/refusals.h"
#include "services/calibration/study_messages.h"
#include "services/calibration/validate.h"
#include "services/clients/calibrations.h"
#include "services/clients/error_sources.h"
#include "services/clients/references.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

using runtime::NotKnown;
using runtime::Refuse;

constexpr std::size_t kMostScanPoints = 40'000'000;

// A record of the plant's as the journal names it.
template <typename Record>
std::string Revised(const std::string& collection, const Record& record) {
  return runtime::RevisedName(collection, runtime::LastSegment(record.name()), record.revision());
}

metrology::SensorPose PoseOf(const storage::SensorCalibrationRow& row) {
  metrology::SensorPose pose;
  for (int k = 0; k < 9; ++k) pose.rotation(k / 3, k % 3) = row.machine_from_sensor_rotation.at(k);
  for (int k = 0; k < 3; ++k) pose.t_sm_mm(k) = row.t_sm_mm.at(k);
  if (row.field_terms_um.empty()) return pose;
  metrology::MeasuredField& field = pose.measured_field.emplace();
  for (int k = 0; k < metrology::kFieldParameterCount; ++k) {
    field.terms_mm[k] = runtime::kMmPerUm * row.field_terms_um.at(k);
    for (int i = 0; i < metrology::kFieldParameterCount; ++i)
      field.covariance_mm2(k, i) =
          runtime::kMmPerUm * runtime::kMmPerUm * row.field_covariance_um2.at(metrology::kFieldParameterCount * k + i);
  }
  field.stated_mm = runtime::kMmPerUm * row.field_stated_um.value_or(0);
  return pose;
}

// What is studied is a scanner as an artefact showed it.
absl::StatusOr<storage::CalibrationRow> Measured(storage::CalibrationRow calibration) {
  if (calibration.sensor->certificate.empty()) return calibration;
  return Refuse("sensor_calibration", calibration.name() + " of method STATED", "one that was measured here");
}

// One of the calibration's own scans; with the new ones no more points than another study has.
absl::Status AddReference(const clients::StoredBlocks& stored, InterimInputs* inputs) {
  std::int64_t point_count = stored.record.header().point_count();
  for (const auto* scans : {&inputs->scans, &inputs->references})
    for (const metrology::LineScan& one : *scans) point_count += static_cast<std::int64_t>(one.points_mm.size());
  if (point_count > static_cast<std::int64_t>(kMostScanPoints))
    return Refuse("scans", std::to_string(point_count) + " points with those of the calibration's own scans",
                  "at most 40000000 together");
  metrology::LineScan& scan = inputs->references.emplace_back(stored.scan);
  return stored.Decode([&](const metrology::Points& points_mm) {
    scan.points_mm.insert(scan.points_mm.end(), points_mm.begin(), points_mm.end());
  });
}

}  // namespace

StudyInputFetcher::StudyInputFetcher(std::shared_ptr<const storage::CalibrationReader> calibrations,
                                     std::shared_ptr<const storage::StudyStore> studies,
                                     std::shared_ptr<grpc::Channel> plant, std::shared_ptr<grpc::Channel> ingest)
    : calibrations_(std::move(calibrations)),
      studies_(std::move(studies)),
      plant_(std::move(plant)),
      scans_(std::move(ingest)) {}

absl::StatusOr<StudyInputFetcher::Scanned> StudyInputFetcher::FetchScans(
    const google::protobuf::RepeatedPtrField<std::string>& names, bool arm_only, const Caller& caller) const {
  Scanned fetched;
  ingest::v1::Scan first;
  std::size_t point_count = 0;
  for (const std::string& name : names) {
    absl::StatusOr<clients::FetchedScan> scan = scans_.Fetch(name, caller.make_context());
    if (!scan.ok()) return NotKnown("scans", name, scan.status());
    if (fetched.scans.empty()) first = scan->record;
    if (absl::Status s = CheckStudyScan(scan->record, first, arm_only); !s.ok()) return s;
    point_count += scan->scan.points_mm.size();
    if (point_count > kMostScanPoints)
      return Refuse("scans", std::to_string(point_count) + " points", "at most 40000000 together");
    scan->scan.id = runtime::LastSegment(name);
    fetched.scans.push_back(std::move(scan->scan));
    fetched.records.push_back(std::move(scan->record));
    fetched.names.push_back(name);
  }
  auto machine = plant_.GetMachine(first.header().machine(), 0, caller.make_context());
  if (!machine.ok()) return machine.status();
  fetched.machine = *std::move(machine);
  auto artefact = plant_.GetArtefact(first.header().subject(), 0, caller.make_context());
  if (!artefact.ok()) return artefact.status();
  fetched.artefact = *std::move(artefact);
  const std::string machine_name = Revised("machines", fetched.machine),
                    artefact_name = Revised("artefacts", fetched.artefact);
  fetched.names.insert(fetched.names.begin(), {machine_name, artefact_name});
  return fetched;
}

absl::Status StudyInputFetcher::FetchMachine(const std::string& name, const Caller& caller, StudyInputs* inputs) const {
  if (name.empty()) return absl::OkStatus();
  if (absl::Status s = runtime::IdOf("machine", "machines", name).status(); !s.ok()) return s;
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(name, 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", name, machine.status());
  inputs->machine = name;
  inputs->names.push_back(Revised("machines", *machine));
  return absl::OkStatus();
}

absl::StatusOr<GaugeInputs> StudyInputFetcher::Fetch(const v1::RunGaugeStudyRequest& request,
                                                     const Caller& caller) const {
  absl::StatusOr<Scanned> scanned = FetchScans(request.scans(), false, caller);
  if (!scanned.ok()) return scanned.status();
  GaugeInputs inputs;
  inputs.machine = scanned->machine.name();
  inputs.names = std::move(scanned->names);
  inputs.scans = std::move(scanned->scans);
  if (request.has_region())
    inputs.options.region = metrology::StripRegion{request.region().x_minimum_mm(), request.region().x_maximum_mm(),
                                                   request.region().y_minimum_mm(), request.region().y_maximum_mm()};
  if (request.station_pitch_mm() != 0) inputs.options.station_pitch_mm = request.station_pitch_mm();
  inputs.options.limit_um = request.limit_um();
  return inputs;
}

absl::StatusOr<storage::CalibrationRow> StudyInputFetcher::SensorCalibration(const std::string& asked,
                                                                             const std::string& machine,
                                                                             storage::Instant at,
                                                                             const Caller& caller) const {
  const std::string machine_id = runtime::LastSegment(machine);
  if (asked.empty()) {
    auto in_force = calibrations_->InForce({machine_id, "sensor"}, at, caller.deadline);
    if (!in_force.ok()) return in_force.status();
    if (in_force->has_value()) return Measured(**std::move(in_force));
    return runtime::Failure(
        errors::v1::CALIBRATION_MISSING,
        machine + ": no sensor calibration in force, want one; name one that is not (a draft will do)",
        {{"resource", machine}});
  }
  const auto id = runtime::IdOf("sensor_calibration", "calibrations", asked);
  if (!id.ok()) return id.status();
  auto found = calibrations_->Find(*id, caller.deadline);
  if (!found.ok()) return found.status();
  if (!found->has_value() || !(**found).sensor || (**found).machine_id != machine_id)
    return Refuse("sensor_calibration", asked, "a sensor calibration of " + machine);
  return Measured(**std::move(found));
}

absl::StatusOr<ArmInputs> StudyInputFetcher::Fetch(const v1::RunArmStudyRequest& request, const Caller& caller) const {
  absl::StatusOr<Scanned> scanned = FetchScans(request.scans(), true, caller);
  if (!scanned.ok()) return scanned.status();
  absl::StatusOr<metrology::Artefact> artefact = ArtefactOf(scanned->artefact);
  if (!artefact.ok()) return WithReason(artefact.status());
  const absl::StatusOr<storage::Instant> now = calibrations_->Now(caller.deadline);
  if (!now.ok()) return now.status();
  const absl::StatusOr<storage::CalibrationRow> calibration =
      SensorCalibration(request.sensor_calibration(), scanned->machine.name(), *now, caller);
  if (!calibration.ok()) return calibration.status();
  ArmInputs inputs;
  inputs.machine = scanned->machine.name();
  inputs.names = std::move(scanned->names);
  inputs.names.push_back(calibration->name());
  inputs.scans = std::move(scanned->scans);
  inputs.artefact = *std::move(artefact);
  inputs.sensor_calibration = calibration->name();
  inputs.options.optics = OpticsOf(scanned->machine.sensor());
  inputs.options.keep_going = caller.keep_going;
  inputs.options.sensor = PoseOf(*calibration->sensor);
  return inputs;
}

absl::StatusOr<RepeatInputs> StudyInputFetcher::Fetch(const v1::RunRepeatStudyRequest& request,
                                                      const Caller& caller) const {
  RepeatInputs inputs;
  std::vector<storage::CalibrationRow>& rows = inputs.calibrations;
  for (int i = 0; i < request.calibrations_size(); ++i) {
    const std::string& name = request.calibrations(i);
    auto found = calibrations_->Find(runtime::LastSegment(name), caller.deadline);
    if (!found.ok()) return found.status();
    if (!found->has_value()) return Refuse(Indexed("calibrations", i), name, "one that is recorded");
    if (!(**found).sensor)
      return Refuse(Indexed("calibrations", i), name + " of kind " + (**found).kind(), "sensor calibrations");
    if (!(**found).sensor->certificate.empty())
      return Refuse(Indexed("calibrations", i), name + " of method STATED", "calibrations that were measured here");
    if (!rows.empty() && rows.front().machine_id != (**found).machine_id)
      return Refuse(Indexed("calibrations", i), name + " of machines/" + (**found).machine_id,
                    "calibrations of machines/" + rows.front().machine_id);
    if (!rows.empty() && rows.front().method != (**found).method)
      return Refuse(Indexed("calibrations", i), name + " by " + (**found).method,
                    "calibrations by one method, as the first (" + rows.front().method + ")");
    rows.push_back(**std::move(found));
  }
  inputs.machine = runtime::NameOf("machines", rows.front().machine_id);
  inputs.names.assign(request.calibrations().begin(), request.calibrations().end());
  return inputs;
}

absl::Status StudyInputFetcher::FetchReferences(const storage::CalibrationRow& calibration,
                                                const ingest::v1::Scan& first, const Caller& caller,
                                                InterimInputs* inputs) const {
  std::vector<clients::StoredBlocks> own;
  absl::Status none = runtime::Failure(errors::v1::STUDY_UNDETERMINED,
                                       calibration.name() + ": made from no scans, want one of its artefact");
  for (const std::string& name : calibration.inputs) {
    if (name.rfind("scans/", 0) != 0) continue;
    absl::StatusOr<clients::StoredBlocks> scan = scans_.FetchBlocks(name, caller.make_context());
    if (scan.ok()) {
      if (absl::Status s = CheckStudyScan(scan->record, first, false); !s.ok()) return s;
      own.push_back(*std::move(scan));
    } else if (runtime::HasReason(scan.status(), errors::v1::POINTS_DELETED)) {
      none = runtime::Failure(errors::v1::STUDY_UNDETERMINED,
                              calibration.name() + ": the points of its scans were deleted, want one that has them");
    } else {
      return scan.status();
    }
  }
  if (own.empty()) return none;
  std::map<std::string, std::vector<std::size_t>> by_series;
  for (std::size_t k = 0; k < own.size(); ++k) by_series[own[k].record.header().arm_series()].push_back(k);
  std::map<std::size_t, std::size_t> taken;
  for (const metrology::LineScan& scan : inputs->scans) {
    std::vector<std::size_t>& of_scan = inputs->references_of.emplace_back();
    const auto nearer = [&](std::size_t one, std::size_t other) {
      return (own[one].scan.v0_mm - scan.v0_mm).norm() < (own[other].scan.v0_mm - scan.v0_mm).norm();
    };
    for (const auto& [series, members] : by_series) {
      const std::size_t nearest = *std::min_element(members.begin(), members.end(), nearer);
      const auto [at, is_new] = taken.emplace(nearest, inputs->references.size());
      of_scan.push_back(at->second);
      if (!is_new) continue;
      inputs->reference_series.push_back(series);
      inputs->names.push_back(own[nearest].record.name());
      if (absl::Status s = AddReference(own[nearest], inputs); !s.ok()) return s;
    }
  }
  return absl::OkStatus();
}

absl::Status StudyInputFetcher::FetchArm(const Caller& caller, InterimInputs* inputs) const {
  const std::set<std::string> now(inputs->arm_series.begin(), inputs->arm_series.end());
  const std::set<std::string> then(inputs->reference_series.begin(), inputs->reference_series.end());
  if (now == then && now.count("") == 0) return absl::OkStatus();
  const auto arm = NewestArm(*studies_, inputs->machine, caller.deadline);
  if (!arm.ok() || !arm->has_value()) return arm.status();
  inputs->options.arm = (*arm)->spread;
  inputs->said.set_arm_study((*arm)->name);
  inputs->names.push_back((*arm)->name);
  return absl::OkStatus();
}

absl::StatusOr<InterimInputs> StudyInputFetcher::Fetch(const v1::RunInterimCheckRequest& request,
                                                       const Caller& caller) const {
  absl::StatusOr<Scanned> scanned = FetchScans(request.scans(), false, caller);
  if (!scanned.ok()) return scanned.status();
  const ingest::v1::Scan& first = scanned->records.front();
  if (first.header().machine() != request.machine())
    return Refuse("scans", first.name() + " of " + first.header().machine(), "scans of " + request.machine());
  if (absl::Status s = clients::CheckLineScanner(scanned->machine); !s.ok()) return s;
  absl::StatusOr<metrology::Artefact> artefact = ArtefactOf(scanned->artefact);
  if (!artefact.ok()) return WithReason(artefact.status());
  InterimInputs inputs;
  inputs.machine = scanned->machine.name();
  inputs.artefact = *std::move(artefact);
  inputs.keep_going = caller.keep_going;
  const plant::v1::SafetyEnvelope& envelope = scanned->machine.safety_envelope();
  if (envelope.has_interim_check_limit_um() && request.limit_um() > envelope.interim_check_limit_um())
    return Refuse("limit_um", NumberText(request.limit_um()),
                  "at most " + NumberText(envelope.interim_check_limit_um()) + ", as " + inputs.machine + " has it");
  inputs.said.set_limit_um(request.limit_um() > 0 ? request.limit_um() : envelope.interim_check_limit_um());
  inputs.said.set_clamping(first.header().clamping());
  storage::Instant scanned_at = runtime::MomentOf(first.received_at());
  for (const ingest::v1::Scan& record : scanned->records) {
    if (record.header().clamping() != first.header().clamping())
      return Refuse("scans", record.name() + " in clamping '" + record.header().clamping() + "'",
                    "scans of one clamping, as " + first.name() + " in '" + first.header().clamping() + "'");
    scanned_at = std::min(scanned_at, runtime::MomentOf(record.received_at()));
    inputs.arm_series.push_back(record.header().arm_series());
  }
  const absl::StatusOr<storage::CalibrationRow> calibration =
      SensorCalibration(request.sensor_calibration(), inputs.machine, scanned_at, caller);
  if (!calibration.ok()) return calibration.status();
  if (calibration->withdrawal)
    return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                            "sensor_calibration: " + calibration->name() + ", which was withdrawn, want one in use",
                            {{"resource", calibration->name()}});
  for (const ingest::v1::Scan& record : scanned->records)
    if (std::find(calibration->inputs.begin(), calibration->inputs.end(), record.name()) != calibration->inputs.end())
      return Refuse("scans", record.name() + ", which " + calibration->name() + " was made from", "scans made since");
  runtime::ToProto(scanned_at, inputs.said.mutable_scanned_at());
  inputs.said.set_sensor_calibration(calibration->name());
  inputs.names = std::move(scanned->names);
  inputs.names.push_back(calibration->name());
  inputs.scans = std::move(scanned->scans);
  inputs.optics = OpticsOf(scanned->machine.sensor());
  inputs.sensor = PoseOf(*calibration->sensor);
  inputs.sensor.field = clients::FieldOf(scanned->machine.sensor());
  inputs.options.limit_mm = runtime::kMmPerUm * inputs.said.limit_um();
  inputs.options.field_covariance_mm2 = metrology::FieldCovarianceOf(
      runtime::kMmPerUm * scanned->machine.error_sources().scanner_field_um(), inputs.sensor.measured_field);
  absl::Status status = FetchReferences(*calibration, first, caller, &inputs);
  if (status.ok()) status = FetchArm(caller, &inputs);
  if (!status.ok()) return status;
  for (auto* scans : {&inputs.scans, &inputs.references})
    for (metrology::LineScan& scan : *scans)
      for (Eigen::Vector3d& p : scan.points_mm) p = inputs.sensor.WithoutField(p);
  return inputs;
}

v1::RunGaugeRrRequest FilledIn(v1::RunGaugeRrRequest request) {
  if (request.confidence() == 0) request.set_confidence(0.95);
  if (request.part_level() == v1::PART_LEVEL_UNSPECIFIED) request.set_part_level(v1::PART_LEVEL_INNER);
  return request;
}

absl::StatusOr<GaugeRrInputs> StudyInputFetcher::Fetch(const v1::RunGaugeRrRequest& request,
                                                       const Caller& caller) const {
  const v1::RunGaugeRrRequest filled = FilledIn(request);
  GaugeRrInputs inputs;
  for (const v1::Observation& o : request.observations())
    inputs.observations.push_back({o.outer(), o.inner(), o.value()});
  inputs.options = {filled.confidence(), filled.balanced_only(), filled.part_level() == v1::PART_LEVEL_OUTER};
  if (absl::Status s = FetchMachine(request.machine(), caller, &inputs); !s.ok()) return s;
  return inputs;
}

absl::StatusOr<SphereInputs> StudyInputFetcher::Fetch(const v1::RunSphereCheckRequest& request,
                                                      const Caller& caller) const {
  SphereInputs inputs;
  absl::StatusOr<metrology::Points> points = PointsOf("points_mm", request.points_mm());
  if (!points.ok()) return points.status();
  inputs.points_mm = *std::move(points);
  for (const v1::LengthMeasurement& l : request.lengths())
    inputs.lengths.push_back(
        {l.standard(), l.calibrated_mm(), runtime::kMmPerUm * l.calibrated_standard_uncertainty_um(), l.measured_mm()});
  metrology::SphereCheckOptions& options = inputs.options;
  options.diameter_mm = request.diameter_mm();
  options.diameter_standard_uncertainty_mm = runtime::kMmPerUm * request.diameter_standard_uncertainty_um();
  options.sphere_form_mm = runtime::kMmPerUm * request.sphere_form_um();
  options.form_mpe_mm = runtime::kMmPerUm * request.form_mpe_um();
  options.size_mpe_mm = runtime::kMmPerUm * request.size_mpe_um();
  options.length_mpe_mm = runtime::kMmPerUm * request.length_mpe_um();
  options.length_mpe_divisor = request.length_mpe_divisor();
  options.optical = request.optical();
  options.dispersion_mpe_mm = runtime::kMmPerUm * request.dispersion_mpe_um();
  absl::StatusOr<metrology::Points> plane = PointsOf("plane_points_mm", request.plane_points_mm());
  if (!plane.ok()) return plane.status();
  options.plane_points_mm = *std::move(plane);
  options.plane_form_mm = runtime::kMmPerUm * request.plane_form_um();
  options.flat_form_mpe_mm = runtime::kMmPerUm * request.flat_form_mpe_um();
  if (request.least_points() != 0) options.least_points = request.least_points();
  if (absl::Status s = FetchMachine(request.machine(), caller, &inputs); !s.ok()) return s;
  return inputs;
}

}  // namespace sixpoint::calibration
