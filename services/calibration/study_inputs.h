// What a study rests on, fetched from the services that keep it and as the kernels take it.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metrology/studies/arm_study.h"
#include "metrology/studies/gauge_study.h"
#include "metrology/studies/interim_check.h"
#include "metrology/studies/nested_variance.h"
#include "metrology/studies/sphere_check.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "services/runtime/call.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "storage/calibration_store.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

using runtime::Caller;

struct StudyInputs {
  std::string machine;             // its name; empty: none
  std::vector<std::string> names;  // of what it is made from, as the journal has them
};
struct GaugeInputs : StudyInputs {
  std::vector<metrology::LineScan> scans;
  metrology::GaugeStudyOptions options;
};
struct ArmInputs : StudyInputs {
  std::vector<metrology::LineScan> scans;
  metrology::Artefact artefact;
  metrology::ArmStudyOptions options;
  std::string sensor_calibration;
};
struct InterimInputs : StudyInputs {
  std::vector<metrology::LineScan> scans;
  std::vector<metrology::LineScan> references;            // of the calibration's own, those that are compared with
  std::vector<std::vector<std::size_t>> references_of;    // for each scan: of each of their series one
  std::vector<std::string> arm_series, reference_series;  // of each
  metrology::Artefact artefact;
  metrology::SensorPose sensor;  // as calibrated
  metrology::LineSensorOptics optics;
  metrology::InterimCheckOptions options;
  v1::InterimCheck said;  // what it concerns: calibration, clamping, when, arm study, limit
  std::function<bool()> keep_going;
};
struct RepeatInputs : StudyInputs {
  std::vector<storage::CalibrationRow> calibrations;  // of the sensor, with their residuals
};
struct GaugeRrInputs : StudyInputs {
  std::vector<metrology::NestedObservation> observations;
  metrology::NestedOptions options;
};
struct SphereInputs : StudyInputs {
  metrology::Points points_mm;
  std::vector<metrology::MeasuredLength> lengths;
  metrology::SphereCheckOptions options;
};

// Thread-safe.
class StudyInputFetcher {
 public:
  StudyInputFetcher(std::shared_ptr<const storage::CalibrationReader> calibrations,
                    std::shared_ptr<const storage::StudyStore> studies, std::shared_ptr<grpc::Channel> plant,
                    std::shared_ptr<grpc::Channel> ingest);

  // Of requests that CheckRequest let pass. INVALID_ARGUMENT: what they name is not known, or does not go together.
  // FAILED_PRECONDITION: an arm study or interim check of a machine without a sensor calibration in force (CALIBRATION_MISSING), an interim
  // check of one that was withdrawn (CALIBRATION_WITHDRAWN) or whose scans are gone (STUDY_UNDETERMINED).
  absl::StatusOr<GaugeInputs> Fetch(const v1::RunGaugeStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<ArmInputs> Fetch(const v1::RunArmStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<RepeatInputs> Fetch(const v1::RunRepeatStudyRequest& request, const Caller& caller) const;
  absl::StatusOr<GaugeRrInputs> Fetch(const v1::RunGaugeRrRequest& request, const Caller& caller) const;
  absl::StatusOr<SphereInputs> Fetch(const v1::RunSphereCheckRequest& request, const Caller& caller) const;
  absl::StatusOr<InterimInputs> Fetch(const v1::RunInterimCheckRequest& request, const Caller& caller) const;

 private:
  struct Scanned {
    std::vector<metrology::LineScan> scans;
    std::vector<ingest::v1::Scan> records;
    plant::v1::Machine machine;
    plant::v1::Artefact artefact;
    std::vector<std::string> names;  // machine, artefact, scans
  };
  // All of one machine and one artefact, with the same A and B; arm_only: of kind arm.
  absl::StatusOr<Scanned> FetchScans(const google::protobuf::RepeatedPtrField<std::string>& names, bool arm_only,
                                     const Caller& caller) const;
  // The machine that a study names, or none.
  absl::Status FetchMachine(const std::string& name, const Caller& caller, StudyInputs* inputs) const;
  // The sensor calibration asked for, or the one of the machine that was in force then.
  absl::StatusOr<storage::CalibrationRow> SensorCalibration(const std::string& asked, const std::string& machine,
                                                            storage::Instant at, const Caller& caller) const;
  // Of each series of the calibration's own scans the nearest to each scan.
  absl::Status FetchReferences(const storage::CalibrationRow& calibration, const ingest::v1::Scan& first,
                               const Caller& caller, InterimInputs* inputs) const;
  // Of the machine's newest study, where the arm was swung.
  absl::Status FetchArm(const Caller& caller, InterimInputs* inputs) const;

  const std::shared_ptr<const storage::CalibrationReader> calibrations_;
  const std::shared_ptr<const storage::StudyStore> studies_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
};

// With the usual confidence and part level where none is asked for.
v1::RunGaugeRrRequest FilledIn(v1::RunGaugeRrRequest request);

}  // namespace sixpoint::calibration
