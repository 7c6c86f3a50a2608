#include "services/calibration/calibrator.h"

#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "services/calibration/axis_messages.h"
#include "services/calibration/axis_tables.h"
#include "services/calibration/calibration_messages.h"
#include "services/calibration/probe_messages.h"
#include "services/calibration/refusals.h"
#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/machine_chain.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::calibration {
namespace {

using runtime::NotKnown;

constexpr char kSensorCall[] = "calibration.CalibrateSensor";
constexpr char kRotationCall[] = "calibration.CalibrateRotation";
constexpr char kProbeCall[] = "calibration.CalibrateProbe";
constexpr char kAxisCall[] = "calibration.CharacteriseAxis";
constexpr std::size_t kMostPoints = 20'000'000;

std::string Revised(const std::string& name, int revision) { return name + "@" + std::to_string(revision); }

// What every calibration has of its request.
template <typename Request>
storage::CalibrationRow Described(const Request& request, const Validity& validity) {
  storage::CalibrationRow row;
  row.calibration_id = storage::NewUuid();
  row.machine_id = runtime::LastSegment(request.machine());
  row.valid_from = validity.from;
  row.valid_until = validity.until;
  row.requested_by = request.requested_by();
  row.software_version = runtime::SoftwareVersion();
  row.is_draft = request.draft();
  row.environment = RowOf(request.environment());
  return row;
}

absl::Status NotConverged(const std::string& what) {
  return runtime::Failure(errors::v1::CALIBRATION_NOT_CONVERGED, what);
}

template <typename Request>
absl::StatusOr<Validity> ValidityIn(const Request& request, std::chrono::hours usual = kUsualValidity) {
  return ValidityOf(request.has_valid_from() ? &request.valid_from() : nullptr,
                    request.has_valid_until() ? &request.valid_until() : nullptr, std::chrono::system_clock::now(),
                    usual);
}

absl::StatusOr<metrology::RotationCalibration> FindAxes(const v1::CalibrateRotationRequest& request,
                                                        const std::vector<metrology::SpherePose>& poses,
                                                        const metrology::RotationOptions& options,
                                                        std::string* method) {
  if (request.method() == v1::ROTATION_METHOD_STANDARD) {
    *method = "STANDARD";
    const absl::StatusOr<metrology::StandardProbing> probing = ProbingOf(request.standard());
    if (!probing.ok()) return probing.status();
    return metrology::CalibrateStandardCentre(*probing, poses, options);
  }
  const bool point_c = request.method() == v1::ROTATION_METHOD_POINT_C;
  *method = point_c ? "POINT_C" : "LINES";
  return point_c ? metrology::CalibratePointC(poses, options) : metrology::CalibrateRotation(poses, options);
}

}  // namespace

Calibrator::Calibrator(std::shared_ptr<storage::CalibrationStore> store, std::shared_ptr<grpc::Channel> plant,
                       std::shared_ptr<grpc::Channel> ingest, int threads)
    : store_(std::move(store)), plant_(std::move(plant)), scans_(std::move(ingest)), threads_(threads) {}

// The calibration as it reads once it is recorded is the answer.
template <typename Request, typename Make>
absl::StatusOr<v1::Calibration> Calibrator::Recorded(const char* call, const Request& request, const Caller& caller,
                                                     const Make& make) const {
  const auto answer_of = [](const storage::CalibrationRow& row) -> absl::StatusOr<std::string> {
    return ToProto(row).SerializeAsString();
  };
  return runtime::RecordedCall<v1::Calibration>(
      *store_, call, request, caller.deadline, make,
      [&](const storage::RecordedRequest& recorded, storage::CalibrationRow row) {
        const std::string summary = SummaryOf(row);
        return store_->Record(recorded, std::move(row), summary, answer_of, caller.deadline);
      });
}

absl::StatusOr<v1::Calibration> Calibrator::CalibrateSensor(const v1::CalibrateSensorRequest& request,
                                                            const Caller& caller) {
  if (absl::Status s = CheckSensorRequest(request); !s.ok()) return s;
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  const absl::StatusOr<metrology::ArtefactTouch> touch = TouchOf(request.touch());
  if (!touch.ok()) return touch.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request);
  if (!validity.ok()) return validity.status();
  return Recorded(kSensorCall, request, caller, [&] { return MakeSensor(request, *touch, *validity, caller); });
}

absl::StatusOr<storage::CalibrationRow> Calibrator::MakeSensor(const v1::CalibrateSensorRequest& request,
                                                               const metrology::ArtefactTouch& touch,
                                                               const Validity& validity, const Caller& caller) const {
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", request.machine(), machine.status());
  const absl::StatusOr<plant::v1::Artefact> record = plant_.GetArtefact(request.artefact(), 0, caller.make_context());
  if (!record.ok()) return NotKnown("artefact", request.artefact(), record.status());
  const absl::StatusOr<metrology::Artefact> artefact = ArtefactOf(*record);
  if (!artefact.ok()) return WithReason(artefact.status());
  if (absl::Status s = metrology::CheckTouch(*artefact, touch); !s.ok()) return WithReason(s);

  storage::CalibrationRow row = Described(request, validity);
  row.inputs = {Revised(request.machine(), machine->revision()), Revised(request.artefact(), record->revision())};
  std::vector<metrology::LineScan> scans;
  ingest::v1::Scan first;
  std::size_t point_count = 0;
  for (const std::string& name : request.scans()) {
    absl::StatusOr<clients::FetchedScan> fetched = scans_.Fetch(name, caller.make_context());
    if (!fetched.ok()) return NotKnown("scans", name, fetched.status());
    if (scans.empty()) first = fetched->record;
    if (absl::Status s = CheckScan(request, fetched->record, first); !s.ok()) return s;
    point_count += fetched->scan.points_mm.size();
    if (point_count > kMostPoints)
      return runtime::Refuse("scans", std::to_string(point_count) + " points", "at most 20000000 together");
    fetched->scan.id = runtime::LastSegment(name);
    scans.push_back(std::move(fetched->scan));
    row.inputs.push_back(name);
  }
  metrology::SensorCalibrationOptions options;
  options.optics = OpticsOf(machine->sensor());
  options.threads = threads_;
  options.keep_going = caller.keep_going;
  const bool sequential = request.method() == v1::SENSOR_METHOD_SEQUENTIAL;
  const absl::StatusOr<metrology::SensorCalibration> result =
      sequential ? metrology::CalibrateSensorSequentially(scans, *artefact, touch, options)
                 : metrology::CalibrateSensor(scans, *artefact, touch, options);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged)
    return NotConverged("the fit did not settle in " + std::to_string(result->iterations) +
                        " iterations; scan the artefact again");
  row.method = sequential ? "SEQUENTIAL" : "JOINT";
  row.sensor = RowOf(*result);
  return row;
}

absl::StatusOr<v1::Calibration> Calibrator::CalibrateRotation(const v1::CalibrateRotationRequest& request,
                                                              const Caller& caller) {
  if (absl::Status s = CheckRotationRequest(request); !s.ok()) return s;
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  const absl::StatusOr<std::vector<metrology::SpherePose>> poses = PosesOf(request);
  if (!poses.ok()) return poses.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request);
  if (!validity.ok()) return validity.status();
  return Recorded(kRotationCall, request, caller, [&] { return MakeRotation(request, *poses, *validity, caller); });
}

absl::StatusOr<storage::CalibrationRow> Calibrator::MakeRotation(const v1::CalibrateRotationRequest& request,
                                                                 const std::vector<metrology::SpherePose>& poses,
                                                                 const Validity& validity, const Caller& caller) const {
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", request.machine(), machine.status());
  absl::StatusOr<metrology::RotationOptions> options = RotationOptionsOf(*machine);
  if (!options.ok()) return options.status();
  options->standard_uncertainty_mm = 1e-3 * request.standard_uncertainty_um();
  storage::CalibrationRow row = Described(request, validity);
  row.inputs = {Revised(request.machine(), machine->revision())};
  if (request.apply_axis_tables()) {
    const auto used = AddAxisTables(*store_, row.machine_id, caller.deadline, &*options);
    if (!used.ok()) return used.status();
    row.inputs.insert(row.inputs.end(), used->begin(), used->end());
  }
  const absl::StatusOr<metrology::RotationCalibration> result = FindAxes(request, poses, *options, &row.method);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged) return NotConverged("the fit did not settle; probe the sphere at more poses");
  row.rotation = RowOf(*result, poses, *options);
  return row;
}

absl::StatusOr<v1::Calibration> Calibrator::CalibrateProbe(const v1::CalibrateProbeRequest& request,
                                                           const Caller& caller) {
  if (absl::Status s = CheckProbeRequest(request); !s.ok()) return s;
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  const absl::StatusOr<ProbeInputs> inputs = ProbeInputsOf(request);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request);
  if (!validity.ok()) return validity.status();
  return Recorded(kProbeCall, request, caller, [&] { return MakeProbe(request, *inputs, *validity, caller); });
}

absl::StatusOr<storage::CalibrationRow> Calibrator::MakeProbe(const v1::CalibrateProbeRequest& request,
                                                              const ProbeInputs& inputs, const Validity& validity,
                                                              const Caller& caller) const {
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", request.machine(), machine.status());
  const bool linear = request.method() == v1::PROBE_METHOD_LINEAR;
  const absl::StatusOr<metrology::ProbeCalibration> result =
      linear ? metrology::CalibrateProbeLinearly(inputs.faces, inputs.readings, inputs.options)
             : metrology::CalibrateProbe(inputs.faces, inputs.readings, inputs.options);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged) return NotConverged("the fit did not settle; measure each face at more displacements");
  const absl::StatusOr<std::vector<metrology::ProbeFaceCheck>> checks =
      metrology::CheckProbe(*result, inputs.moved_faces, inputs.moved_readings, inputs.options);
  if (!checks.ok()) return WithReason(checks.status());
  storage::CalibrationRow row = Described(request, validity);
  row.inputs = {Revised(request.machine(), machine->revision())};
  row.method = linear ? "LINEAR" : "WEIGHTED";
  row.probe = RowOf(*result, *checks, request);
  return row;
}

absl::StatusOr<v1::Calibration> Calibrator::CharacteriseAxis(const v1::CharacteriseAxisRequest& request,
                                                             const Caller& caller) {
  if (absl::Status s = CheckAxisRequest(request); !s.ok()) return s;
  if (absl::Status s = CheckEnvironment(request.environment()); !s.ok()) return s;
  const absl::StatusOr<std::vector<metrology::AxisReading>> readings = ReadingsOf(request.run());
  if (!readings.ok()) return readings.status();
  const absl::StatusOr<Validity> validity = ValidityIn(request, kUsualAxisValidity);
  if (!validity.ok()) return validity.status();
  return Recorded(kAxisCall, request, caller, [&] { return MakeAxis(request, *readings, *validity, caller); });
}

absl::StatusOr<storage::CalibrationRow> Calibrator::MakeAxis(const v1::CharacteriseAxisRequest& request,
                                                             const std::vector<metrology::AxisReading>& readings,
                                                             const Validity& validity, const Caller& caller) const {
  const absl::StatusOr<plant::v1::Machine> machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", request.machine(), machine.status());
  const absl::StatusOr<metrology::JointChain> chain = runtime::ChainOf(*machine);
  if (!chain.ok()) return chain.status();
  const absl::StatusOr<metrology::Joint> joint = JointOf(request.machine(), *chain, request.axis());
  if (!joint.ok()) return joint.status();
  const absl::StatusOr<metrology::AxisCharacterisation> result = metrology::CharacteriseAxis(readings);
  if (!result.ok()) return WithReason(result.status());
  storage::CalibrationRow row = Described(request, validity);
  row.inputs = {Revised(request.machine(), machine->revision())};
  row.method = "ENCODER_RUN";
  row.axis = RowOf(*result, request.axis());
  row.axis->beyond_limits_count = BeyondLimits(request.run(), *joint);
  return row;
}

}  // namespace sixpoint::calibration
