// What a calibration rests on, fetched from the services that keep it and as the kernels take it.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/frames/pose.h"
#include "metrology/kinematics/joint_chain.h"
#include "metrology/studies/arm_study.h"
#include "services/calibration/readings.h"
#include "services/calibration/validity.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "services/runtime/call.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "storage/calibration_store.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

using runtime::Caller;

struct Inputs {
  Validity validity;
  std::vector<std::string> names;  // of what it is made from, as the journal has them
};
struct SensorInputs : Inputs {
  metrology::ArtefactTouch touch;
  metrology::Artefact artefact;
  std::vector<metrology::LineScan> scans;
  std::vector<std::string> series_of_scans;      // of each; empty: not known
  std::string arm_series, sensor_serial_number;  // of all scans; empty: not known, or several
  // The arm's spread, where it was swung between the scans and each says in which series it was taken.
  std::optional<metrology::ArmSpread> arm;
  ingest::v1::ScanTravel travel = ingest::v1::SCAN_TRAVEL_UNSPECIFIED;
  storage::Instant first_received_at, last_received_at;
  metrology::SensorCalibrationOptions options;
};
struct StatedInputs : Inputs {
  Eigen::Isometry3d machine_from_sensor = metrology::NotYet<Eigen::Isometry3d>();
};
struct RotationInputs : Inputs {
  std::vector<metrology::SpherePose> poses;
  metrology::StandardProbing standard;  // for method STANDARD
  metrology::RotationOptions options;
};
struct ProbeInputs : Inputs {
  ProbeReadings measured;
};
struct AxisInputs : Inputs {
  std::vector<metrology::AxisReading> readings;
  metrology::Joint joint;
};

// Thread-safe.
class InputFetcher {
 public:
  // thread_count: of one sensor calibration.
  InputFetcher(std::shared_ptr<const storage::CalibrationReader> calibrations,
               std::shared_ptr<const storage::StudyStore> studies, std::shared_ptr<grpc::Channel> plant,
               std::shared_ptr<grpc::Channel> ingest, int thread_count);

  // Of requests that CheckRequest let pass. INVALID_ARGUMENT: a reading that is none; what they name is not known, or not of
  // their machine. FAILED_PRECONDITION with a reason: KINEMATICS_UNSUITABLE, AXIS_NOT_CHARACTERISED, CALIBRATION_UNDETERMINED,
  // REFERENCE_EXPIRED, SENSOR_UNSUITABLE.
  absl::StatusOr<SensorInputs> Fetch(const v1::CalibrateSensorRequest& request, const Caller& caller) const;
  absl::StatusOr<StatedInputs> Fetch(const v1::StateSensorPoseRequest& request, const Caller& caller) const;
  absl::StatusOr<RotationInputs> Fetch(const v1::CalibrateRotationRequest& request, const Caller& caller) const;
  absl::StatusOr<ProbeInputs> Fetch(const v1::CalibrateProbeRequest& request, const Caller& caller) const;
  absl::StatusOr<AxisInputs> Fetch(const v1::CharacteriseAxisRequest& request, const Caller& caller) const;

 private:
  // With its name added to the inputs'.
  absl::StatusOr<plant::v1::Machine> FetchMachine(const std::string& name, const Caller& caller, Inputs* inputs) const;
  // FAILED_PRECONDITION (REFERENCE_EXPIRED): what was touched without a scan was touched now.
  absl::Status CheckTouchedNow(const plant::v1::Machine& machine, const Caller& caller) const;
  absl::Status FetchScans(const v1::CalibrateSensorRequest& request, const Caller& caller, SensorInputs* inputs) const;
  // Where the scans are of several series, and the arm was studied.
  absl::Status FetchArm(const std::string& machine, const Caller& caller, SensorInputs* inputs) const;
  // Gives both joints the tables of their characterisations in force. FAILED_PRECONDITION (AXIS_NOT_CHARACTERISED) where
  // neither has one.
  absl::Status FetchAxisTables(const std::string& machine, const Caller& caller, RotationInputs* inputs) const;

  const std::shared_ptr<const storage::CalibrationReader> calibrations_;
  const std::shared_ptr<const storage::StudyStore> studies_;
  clients::PlantClient plant_;
  clients::ScanClient scans_;
  int thread_count_;
};

absl::StatusOr<metrology::Artefact> ArtefactOf(const plant::v1::Artefact& artefact);
metrology::LineSensorOptics OpticsOf(const plant::v1::Sensor& sensor);
// The two rotary joints on the part's side, the first carrying the second. FAILED_PRECONDITION for other machines.
absl::StatusOr<metrology::RotationOptions> RotationOptionsOf(const plant::v1::Machine& machine);

}  // namespace sixpoint::calibration
