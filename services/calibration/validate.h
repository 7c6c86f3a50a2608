// Requests into what the kernels take: pure functions, each refusal naming field, value and what was wanted.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <string>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/calibration/rotation_calibration.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "storage/calibrations.h"
#include "storage/database.h"

namespace sixpoint::calibration {

struct Validity {
  storage::Instant from, until;
};
inline constexpr std::chrono::hours kUsualValidity{30 * 24};
inline constexpr std::chrono::hours kUsualAxisValidity{365 * 24};  // encoder runs are a matter of years
// Unset: from now, for `usual`.
absl::StatusOr<Validity> ValidityOf(const google::protobuf::Timestamp* from, const google::protobuf::Timestamp* until,
                                    storage::Instant now, std::chrono::hours usual = kUsualValidity);
absl::StatusOr<storage::Instant> InstantOf(const std::string& field, const google::protobuf::Timestamp& time);

// "poses", 3 -> "poses[3]".
std::string Indexed(const std::string& field, int i);
absl::Status CheckCount(const std::string& field, int count, int least, int most);

// What all calls have: the machine's name, who asks, request_id.
absl::Status CheckCaller(const std::string& machine, const std::string& requested_by, const std::string& request_id);

// Names, counts and method.
absl::Status CheckSensorRequest(const v1::CalibrateSensorRequest& request);
absl::StatusOr<metrology::ArtefactTouch> TouchOf(const v1::TouchData& touch);
absl::StatusOr<metrology::Artefact> ArtefactOf(const plant::v1::Artefact& artefact);
metrology::LineSensorOptics OpticsOf(const plant::v1::Sensor& sensor);
// The scan shows the artefact, from this machine, standing as in the first scan.
absl::Status CheckScan(const v1::CalibrateSensorRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first);

absl::Status CheckRotationRequest(const v1::CalibrateRotationRequest& request);
absl::StatusOr<std::vector<metrology::SpherePose>> PosesOf(const v1::CalibrateRotationRequest& request);
absl::StatusOr<metrology::StandardProbing> ProbingOf(const v1::StandardProbing& in);
// The two rotary joints on the part's side, the first carrying the second. FAILED_PRECONDITION for other machines.
absl::StatusOr<metrology::RotationOptions> RotationOptionsOf(const plant::v1::Machine& machine);

absl::Status CheckEnvironment(const v1::Environment& environment);
// What release, withdrawal and studies have: a reason, who asks, request_id.
absl::Status CheckEvent(const std::string& reason, const std::string& requested_by, const std::string& request_id);

// "sensor", "rotation", "probe", "axis"; empty for UNSPECIFIED.
std::string KindText(v1::CalibrationKind kind);
// The subject that a request asks for: machine and kind, and the axis of kind AXIS, which no other has. Where they are
// filters, any of them may be empty.
absl::StatusOr<storage::CalibrationSubject> SubjectOf(const std::string& machine, v1::CalibrationKind kind,
                                                      const std::string& axis);
absl::StatusOr<storage::CalibrationFilter> FilterOf(const v1::ListCalibrationsRequest& request);

}  // namespace sixpoint::calibration
