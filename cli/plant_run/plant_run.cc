#include "cli/plant_run/plant_run.h"

#include <chrono>
#include <filesystem>
#include <iostream>
#include <map>
#include <mutex>

#include "cli/cloud_files.h"
#include "cli/document.h"
#include "cli/output.h"
#include "cli/plant_documents.h"
#include "cli/plant_run/calibration_calls.h"
#include "cli/plant_run/jobs.h"
#include "cli/progress.h"
#include "cli/reports.h"
#include "cli/scan_transfer.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"
#include "services/runtime/resource_name.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::CorrectionService;
using inspection::v1::InspectionService;
using plant::v1::PlantService;
using registration::v1::RegistrationService;

// Uploads wait for the disk and for each other's decoding; the calls after them keep the services' cores busy.
constexpr int kUploadsAtOnce = 3;
constexpr int kCallsAtOnce = 2;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

FailedStep FailureOf(const std::string& step, const std::string& subject, const std::string& method,
                     const absl::Status& status) {
  return {step, subject, method, absl::StatusCodeToString(status.code()), std::string(status.message())};
}

// The stages share what the earlier ones found.
class PlantRun {
 public:
  PlantRun(Session* session, const std::string& folder, const Dataset& dataset)
      : session_(session), folder_(folder), dataset_(dataset) {}

  absl::Status RegisterPlant();
  void UploadScans();
  bool Calibrate();
  void RegisterBlades();
  void CorrectBlades();
  void InspectBlades();
  PlantRunResult TakeResult() { return std::move(result_); }

 private:
  absl::Status UploadOne(const DatasetScan& scan, Progress* progress);
  // Names under which the plant keeps a subject's scans of a kind; FAILED_PRECONDITION when one of them is not stored.
  absl::StatusOr<std::vector<std::string>> StoredScans(const std::string& subject, ingest::v1::ScanKind kind) const;
  bool HasScans(const std::string& blade, ingest::v1::ScanKind kind) const;
  // The sensor's, and what its arm repeats; that of the axes, after their tables where they are applied.
  absl::Status CalibrateSensor(bool over_all_swings, calibration::v1::Calibration* out);
  absl::Status StudyArm(const calibration::v1::Calibration& sensor);
  absl::Status CalibrateAxes(calibration::v1::Calibration* out);
  absl::Status RegisterBlade(RegisteredBlade* entry, ingest::v1::ScanKind kind, registration::v1::Method method);
  void Say(const std::string& line) const {
    if (!session_->json) std::cerr << line << std::endl;
  }

  Session* const session_;
  const std::filesystem::path folder_;
  const Dataset& dataset_;
  std::mutex mutex_;
  std::map<std::string, std::string> stored_;  // the data set's scan id -> scans/{id}
  PlantRunResult result_;
};

absl::Status PlantRun::RegisterPlant() {
  const auto start = std::chrono::steady_clock::now();
  plant::v1::CreateMachineRequest machine;
  machine.set_machine_id(dataset_.machine_id);
  *machine.mutable_machine() = dataset_.machine;
  machine.set_request_id(NewRequestId());
  plant::v1::Machine created_machine;
  absl::Status status =
      session_->Call<PlantService>("plant", &PlantService::Stub::CreateMachine, machine, &created_machine);
  if (!status.ok()) return status;

  plant::v1::CreateArtefactRequest artefact;
  artefact.set_artefact_id(dataset_.artefact_id);
  *artefact.mutable_artefact() = dataset_.artefact;
  artefact.set_request_id(NewRequestId());
  plant::v1::Artefact created_artefact;
  status = session_->Call<PlantService>("plant", &PlantService::Stub::CreateArtefact, artefact, &created_artefact);
  if (!status.ok()) return status;

  absl::StatusOr<std::string> cad = ReadFile((folder_ / dataset_.cad_file).string(), kGreatestCadBytes);
  if (!cad.ok()) return cad.status();
  plant::v1::CreatePartRequest part;
  part.set_part_id(dataset_.part_id);
  *part.mutable_part() = dataset_.part;
  part.set_cad(std::move(*cad));
  part.set_request_id(NewRequestId());
  plant::v1::Part created_part;
  status = session_->Call<PlantService>("plant", &PlantService::Stub::CreatePart, part, &created_part);
  if (!status.ok()) return status;

  for (const std::string& serial : dataset_.blades) {
    plant::v1::CreateBladeRequest blade;
    blade.set_serial(serial);
    blade.set_part(created_part.name());
    blade.set_request_id(NewRequestId());
    plant::v1::Blade created_blade;
    status = session_->Call<PlantService>("plant", &PlantService::Stub::CreateBlade, blade, &created_blade);
    if (!status.ok()) return status;
  }
  result_.setup_s = SecondsSince(start);
  Say(created_machine.name() + " revision " + std::to_string(created_machine.revision()) + ", " +
      created_artefact.name() + " revision " + std::to_string(created_artefact.revision()) + ", " +
      created_part.name() + " revision " + std::to_string(created_part.revision()) + ", " +
      std::to_string(dataset_.blades.size()) + " blades");
  return status;
}

absl::Status PlantRun::UploadOne(const DatasetScan& scan, Progress* progress) {
  absl::StatusOr<metrology::Points> points = ReadCloud((folder_ / scan.file).string());
  if (!points.ok()) return points.status();
  if (static_cast<std::int64_t>(points->size()) != scan.point_count) {
    return Refuse(scan.file, std::to_string(points->size()) + " points",
                  std::to_string(scan.point_count) + " as dataset.json says");
  }
  ingest::v1::ScanHeader header = scan.header;
  header.set_encoding(ingest::v1::ENCODING_XYZ_F64);
  absl::StatusOr<clients::OutgoingScan> outgoing = clients::PrepareScan(std::move(header), *points);
  if (!outgoing.ok()) return outgoing.status();
  const std::int64_t payload_bytes = outgoing->payload_bytes;
  const absl::StatusOr<ingest::v1::StoredScan> stored =
      UploadScanUnderFreeId(session_, *std::move(outgoing), [&](std::int64_t count) { progress->Add(count); });
  if (!stored.ok()) return stored.status();
  const ingest::v1::Scan& record = stored->scan();
  std::lock_guard<std::mutex> lock(mutex_);
  stored_[scan.header.scan_id()] = record.name();
  ++result_.scan_count;
  if (stored->already_stored()) ++result_.already_stored_count;
  result_.point_count += scan.point_count;
  result_.payload_bytes += payload_bytes;
  result_.stored_bytes += record.stored_bytes();
  result_.proven_error_um = std::max(result_.proven_error_um, record.proven_error_um());
  return absl::OkStatus();
}

void PlantRun::UploadScans() {
  const auto start = std::chrono::steady_clock::now();
  std::int64_t total = 0;
  for (const DatasetScan& scan : dataset_.scans) total += scan.point_count;
  const int count = static_cast<int>(dataset_.scans.size());
  std::vector<absl::Status> statuses(dataset_.scans.size());
  {
    Progress progress("upload", "points", total, session_->json);
    // The artefact's first: what is received later is mapped by its calibration.
    for (const bool of_artefact : {true, false}) {
      std::vector<int> which;
      for (int i = 0; i < count; ++i)
        if ((dataset_.scans[i].header.kind() == ingest::v1::SCAN_KIND_ARTEFACT) == of_artefact) which.push_back(i);
      RunJobs(static_cast<int>(which.size()), kUploadsAtOnce,
              [&](int k) { statuses[which[k]] = UploadOne(dataset_.scans[which[k]], &progress); });
    }
  }
  for (int i = 0; i < count; ++i) {
    if (statuses[i].ok()) continue;
    result_.failures.push_back(FailureOf("ingest", "scan:" + dataset_.scans[i].header.scan_id(), "", statuses[i]));
  }
  result_.ingest_s = SecondsSince(start);
}

bool PlantRun::HasScans(const std::string& blade, ingest::v1::ScanKind kind) const {
  for (const DatasetScan& scan : dataset_.scans) {
    if (scan.header.subject() == runtime::NameOf("blades", blade) && scan.header.kind() == kind) return true;
  }
  return false;
}

absl::StatusOr<std::vector<std::string>> PlantRun::StoredScans(const std::string& subject,
                                                               ingest::v1::ScanKind kind) const {
  std::vector<std::string> names;
  for (const DatasetScan& scan : dataset_.scans) {
    if (scan.header.subject() != subject || scan.header.kind() != kind) continue;
    const auto stored = stored_.find(scan.header.scan_id());
    if (stored == stored_.end())
      return absl::FailedPreconditionError("scan " + scan.header.scan_id() + " is not stored");
    names.push_back(stored->second);
  }
  return names;
}

absl::Status PlantRun::CalibrateSensor(bool over_all_swings, calibration::v1::Calibration* out) {
  const std::string artefact = runtime::NameOf("artefacts", dataset_.artefact_id);
  absl::StatusOr<std::vector<std::string>> scans = StoredScans(artefact, ingest::v1::SCAN_KIND_ARTEFACT);
  if (!scans.ok()) return scans.status();
  if (over_all_swings) {
    const absl::StatusOr<std::vector<std::string>> swung = StoredScans(artefact, ingest::v1::SCAN_KIND_ARM);
    if (!swung.ok()) return swung.status();
    scans->insert(scans->end(), swung->begin(), swung->end());
  }
  return cli::CalibrateSensor(session_, dataset_, *scans, out);
}

absl::Status PlantRun::StudyArm(const calibration::v1::Calibration& sensor) {
  if (!dataset_.study_arm) return absl::OkStatus();
  absl::StatusOr<std::vector<std::string>> scans =
      StoredScans(runtime::NameOf("artefacts", dataset_.artefact_id), ingest::v1::SCAN_KIND_ARM);
  if (!scans.ok()) return scans.status();
  return cli::StudyArm(session_, *scans, sensor.name());
}

absl::Status PlantRun::CalibrateAxes(calibration::v1::Calibration* out) {
  absl::Status status = CharacteriseAxes(session_, dataset_);
  return status.ok() ? CalibrateRotation(session_, dataset_, out) : status;
}

bool PlantRun::Calibrate() {
  Say("calibrating " + dataset_.machine_id);
  const auto start = std::chrono::steady_clock::now();
  calibration::v1::Calibration sensor, rotation;
  absl::Status sensor_status, rotation_status, arm_status;
  RunJobs(2, kCallsAtOnce, [&](int i) {
    if (i == 0) {
      sensor_status = CalibrateSensor(false, &sensor);
      if (sensor_status.ok()) arm_status = StudyArm(sensor);
      // The arm is known by then: once more over all of its swings.
      if (sensor_status.ok() && arm_status.ok() && dataset_.has_series) sensor_status = CalibrateSensor(true, &sensor);
    } else {
      rotation_status = CalibrateAxes(&rotation);
    }
  });
  result_.calibration_s = SecondsSince(start);
  if (sensor_status.ok()) {
    result_.sensor = sensor;
  } else {
    result_.failures.push_back(FailureOf("calibration", "machine:" + dataset_.machine_id, "sensor", sensor_status));
  }
  if (rotation_status.ok()) {
    result_.rotation = rotation;
  } else {
    result_.failures.push_back(FailureOf("calibration", "machine:" + dataset_.machine_id, "rotation", rotation_status));
  }
  if (!arm_status.ok())
    result_.failures.push_back(FailureOf("calibration", "machine:" + dataset_.machine_id, "arm", arm_status));
  // Without its own calibrations the rest would quietly rest on older ones.
  return sensor_status.ok() && rotation_status.ok() && arm_status.ok();
}

absl::Status PlantRun::RegisterBlade(RegisteredBlade* entry, ingest::v1::ScanKind kind,
                                     registration::v1::Method method) {
  registration::v1::RegisterRequest request;
  request.set_blade(runtime::NameOf("blades", entry->blade));
  absl::StatusOr<std::vector<std::string>> scans = StoredScans(request.blade(), kind);
  if (!scans.ok()) return scans.status();
  for (const std::string& scan : *scans) request.add_scans(scan);
  request.set_method(method);
  request.set_apply_axis_tables(dataset_.applies_axis_tables());
  // Scans of an earlier run may be kept: this run's calibration maps them all the same.
  if (result_.sensor) request.set_sensor_calibration(result_.sensor->name());
  request.set_request_id(NewRequestId());
  const auto start = std::chrono::steady_clock::now();
  absl::Status status = session_->Call<RegistrationService>("registration", &RegistrationService::Stub::Register,
                                                            request, &entry->registration);
  entry->seconds = SecondsSince(start);
  return status;
}

void PlantRun::RegisterBlades() {
  struct Job {
    RegisteredBlade entry;
    ingest::v1::ScanKind kind;
    registration::v1::Method method;
    absl::Status status;
  };
  std::vector<Job> jobs;
  for (const std::string& blade : dataset_.blades) {
    if (HasScans(blade, ingest::v1::SCAN_KIND_AIRFOIL)) {
      jobs.push_back(
          {{blade, "six-point", {}, 0}, ingest::v1::SCAN_KIND_AIRFOIL, registration::v1::METHOD_SIX_POINT, {}});
      jobs.push_back({{blade, "airfoil", {}, 0}, ingest::v1::SCAN_KIND_AIRFOIL, registration::v1::METHOD_BEST_FIT, {}});
    }
    if (HasScans(blade, ingest::v1::SCAN_KIND_LOCAL)) {
      jobs.push_back({{blade, "local", {}, 0}, ingest::v1::SCAN_KIND_LOCAL, registration::v1::METHOD_LOCAL, {}});
    }
  }
  Say("registering: " + std::to_string(jobs.size()) + " fits");
  const auto start = std::chrono::steady_clock::now();
  RunJobs(static_cast<int>(jobs.size()), kCallsAtOnce, [&](int i) {
    Job& job = jobs[i];
    job.status = RegisterBlade(&job.entry, job.kind, job.method);
  });
  result_.registration_s = SecondsSince(start);
  for (Job& job : jobs) {
    const auto& evidence = job.entry.registration.evidence();
    if (!job.status.ok()) {
      result_.failures.push_back(FailureOf("registration", "blade:" + job.entry.blade, job.entry.method, job.status));
    } else if (evidence.outcome() != registration::v1::OUTCOME_CONVERGED) {
      result_.failures.push_back(
          {"registration", "blade:" + job.entry.blade, job.entry.method, OutcomeName(evidence.outcome()),
           "overlap " + Rounded(evidence.overlap()) + ", residual rms " + Rounded(evidence.residual_rms_um()) +
               " um, condition number " + Rounded(evidence.condition_number())});
    } else {
      result_.registrations.push_back(std::move(job.entry));
    }
  }
}

void PlantRun::CorrectBlades() {
  if (dataset_.part.hole_groups_size() == 0) return;
  const int count = static_cast<int>(result_.registrations.size());
  Say("correcting: " + std::to_string(count) + " programs");
  std::vector<CorrectedBlade> corrected(result_.registrations.size());
  std::vector<absl::Status> statuses(result_.registrations.size());
  const auto start = std::chrono::steady_clock::now();
  RunJobs(count, kCallsAtOnce, [&](int i) {
    const RegisteredBlade& registered = result_.registrations[i];
    corrected[i].blade = registered.blade;
    corrected[i].method = registered.method;
    correction::v1::CorrectRequest request;
    request.set_registration(registered.registration.name());
    request.set_request_id(NewRequestId());
    const auto call_start = std::chrono::steady_clock::now();
    statuses[i] = session_->Call<CorrectionService>("correction", &CorrectionService::Stub::Correct, request,
                                                    &corrected[i].correction);
    corrected[i].seconds = SecondsSince(call_start);
  });
  result_.correction_s = SecondsSince(start);
  for (int i = 0; i < count; ++i) {
    if (statuses[i].ok()) {
      result_.corrections.push_back(std::move(corrected[i]));
    } else {
      result_.failures.push_back(
          FailureOf("correction", "blade:" + corrected[i].blade, corrected[i].method, statuses[i]));
    }
  }
}

void PlantRun::InspectBlades() {
  std::vector<InspectedBlade> inspected;
  for (const std::string& blade : dataset_.blades) {
    if (HasScans(blade, ingest::v1::SCAN_KIND_PINS)) inspected.push_back({blade, {}, 0});
  }
  Say("inspecting: " + std::to_string(inspected.size()) + " machined blades");
  std::vector<absl::Status> statuses(inspected.size());
  const auto start = std::chrono::steady_clock::now();
  RunJobs(static_cast<int>(inspected.size()), kCallsAtOnce, [&](int i) {
    inspection::v1::InspectRequest request;
    request.set_blade(runtime::NameOf("blades", inspected[i].blade));
    absl::StatusOr<std::vector<std::string>> scans = StoredScans(request.blade(), ingest::v1::SCAN_KIND_PINS);
    if (!scans.ok()) {
      statuses[i] = scans.status();
      return;
    }
    for (const std::string& scan : *scans) request.add_scans(scan);
    request.set_apply_axis_tables(dataset_.applies_axis_tables());
    if (result_.sensor) request.set_sensor_calibration(result_.sensor->name());
    request.set_request_id(NewRequestId());
    const auto call_start = std::chrono::steady_clock::now();
    statuses[i] = session_->Call<InspectionService>("inspection", &InspectionService::Stub::Inspect, request,
                                                    &inspected[i].inspection);
    inspected[i].seconds = SecondsSince(call_start);
  });
  result_.inspection_s = SecondsSince(start);
  for (std::size_t i = 0; i < inspected.size(); ++i) {
    if (statuses[i].ok()) {
      result_.inspections.push_back(std::move(inspected[i]));
    } else {
      result_.failures.push_back(FailureOf("inspection", "blade:" + inspected[i].blade, "", statuses[i]));
    }
  }
}

}  // namespace

absl::StatusOr<PlantRunResult> RunPlant(Session* session, const std::string& folder, const Dataset& dataset) {
  PlantRun run(session, folder, dataset);
  absl::Status status = run.RegisterPlant();
  if (!status.ok()) return status;
  run.UploadScans();
  if (run.Calibrate()) {
    run.RegisterBlades();
    run.CorrectBlades();
    run.InspectBlades();
  }
  return run.TakeResult();
}

}  // namespace sixpoint::cli
