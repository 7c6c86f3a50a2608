// Calibrations as kernels want them, fetched from the calibration service.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metrology/kinematics/axis_positioning.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/studies/arm_mean.h"
#include "metrology/studies/arm_study.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"

namespace sixpoint::clients {

struct FetchedSensorCalibration {
  std::string name;  // calibrations/{uuid}
  std::chrono::system_clock::time_point valid_until;
  metrology::SensorPose sensor;
  std::string arm_series, sensor_serial_number;  // of its scans; empty: not known
  ingest::v1::ScanTravel travel = ingest::v1::SCAN_TRAVEL_UNSPECIFIED;
  std::string machine;  // machines/{id}
  bool withdrawn = false;
  bool draft = false;
  std::vector<metrology::ArmShare>
      arm_shares;  // of each series that it was made from; empty: it counts as of one swing
  std::optional<calibration::v1::InterimState> interim;  // none: no interim check has judged it
};
struct FetchedRotationCalibration {
  std::string name;
  std::chrono::system_clock::time_point valid_until;
  metrology::RotaryAxes axes;
  metrology::AxesCovariance covariance;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();  // of the covariance
  metrology::LinearResponse linear_response = metrology::LinearResponse::Zero();
  std::array<std::string, 2> letters;  // the machine's, of axes.a and axes.b
  std::vector<std::string> inputs;     // resource names
};
// How one axis positions.
struct FetchedAxis {
  std::string name;  // calibrations/{uuid}
  std::string axis;  // the machine's letter
  std::chrono::system_clock::time_point valid_until;
  metrology::AxisPositioning positioning;     // by its table
  double whole_standard_uncertainty_rad = 0;  // of all that it is off, where the table is not applied
};

// What a machine's arm repeats.
struct FetchedArmStudy {
  std::string name;  // studies/{uuid}
  metrology::ArmSpread spread;
};

// Of a study of kind ARM. DATA_LOSS where it says nothing that can be.
absl::StatusOr<FetchedArmStudy> ArmOf(const calibration::v1::Study& study);

// Thread-safe. FAILED_PRECONDITION (reason CALIBRATION_MISSING or CALIBRATION_EXPIRED) where none is in force.
class CalibrationClient {
 public:
  explicit CalibrationClient(const std::shared_ptr<grpc::Channel>& calibration);
  ~CalibrationClient();
  absl::StatusOr<FetchedSensorCalibration> SensorInForce(const std::string& machine,
                                                         std::unique_ptr<grpc::ClientContext> context) const;
  // The one that was in force then, as far as is known now.
  absl::StatusOr<FetchedSensorCalibration> SensorInForceAt(const std::string& machine,
                                                           const google::protobuf::Timestamp& at,
                                                           std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<FetchedRotationCalibration> RotationInForce(const std::string& machine,
                                                             std::unique_ptr<grpc::ClientContext> context) const;
  // Nothing for an axis that nobody has characterised.
  absl::StatusOr<std::optional<FetchedAxis>> AxisInForce(const std::string& machine, const std::string& axis,
                                                         std::unique_ptr<grpc::ClientContext> context) const;
  // The newest of the machine; nothing where nobody studied its arm.
  absl::StatusOr<std::optional<FetchedArmStudy>> ArmStudy(const std::string& machine,
                                                          std::unique_ptr<grpc::ClientContext> context) const;
  // One by name, newest or not.
  absl::StatusOr<FetchedArmStudy> ArmStudyOf(const std::string& name,
                                             std::unique_ptr<grpc::ClientContext> context) const;
  // FAILED_PRECONDITION (SENSOR_MOVED): the newest interim check of it did not find the scanner where it was calibrated, and no accepted one
  // is of after the scans, the last of which was received then. field: where it was named.
  static absl::Status CheckNotMoved(const std::string& field, const FetchedSensorCalibration& sensor,
                                    const google::protobuf::Timestamp& scans_received_at);
  // FAILED_PRECONDITION (SENSOR_UNSUITABLE): the scan is a snapshot and the calibration a line scanner's, or the other way. field: of the scan.
  static absl::Status CheckMaps(const std::string& field, const FetchedSensorCalibration& sensor,
                                const ingest::v1::ScanHeader& scan);
  // Whether an interim check of it, in that clamping, was accepted by a limit not greater than this.
  absl::StatusOr<bool> CheckedInClamping(const std::string& sensor_calibration, const std::string& clamping,
                                         double limit_um, std::unique_ptr<grpc::ClientContext> context) const;
  // As the calibration service has it, of whatever kind, in force or not.
  absl::StatusOr<calibration::v1::Calibration> Get(const std::string& name,
                                                   std::unique_ptr<grpc::ClientContext> context) const;
  // A calibration by name, whether in force or not.
  absl::StatusOr<FetchedSensorCalibration> Sensor(const std::string& name,
                                                  std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<FetchedRotationCalibration> Rotation(const std::string& name,
                                                      std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<FetchedAxis> Axis(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // FAILED_PRECONDITION that says why `used` is not what is in force now, with its reason: CALIBRATION_WITHDRAWN, or
  // CALIBRATION_EXPIRED (superseded by another one, over, or never released). field: where `used` was named.
  absl::Status NotInForce(const std::string& field, const std::string& used, const std::string& in_force,
                          std::unique_ptr<grpc::ClientContext> context) const;

 private:
  struct Stubs;  // generated code that costs each reader of this header seconds
  std::unique_ptr<const Stubs> stubs_;
};

}  // namespace sixpoint::clients
