#include "services/calibration/filters.h"

#include <optional>
#include <utility>

#include "services/calibration/study_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

absl::StatusOr<storage::CalibrationSubject> Subject(std::string machine_id, v1::CalibrationKind kind,
                                                    const std::string& axis) {
  if (!axis.empty() && kind != v1::CALIBRATION_KIND_AXIS)
    return Refuse("axis", axis, "none but for kind CALIBRATION_KIND_AXIS");
  if (!axis.empty())
    if (absl::Status s = runtime::CheckId("axis", axis); !s.ok()) return s;
  return storage::CalibrationSubject{std::move(machine_id), KindText(kind), axis};
}

std::optional<storage::CalibrationState> StateOf(v1::CalibrationState state) {
  switch (state) {
    case v1::CALIBRATION_STATE_DRAFT:
      return storage::CalibrationState::kDraft;
    case v1::CALIBRATION_STATE_IN_FORCE:
      return storage::CalibrationState::kInForce;
    case v1::CALIBRATION_STATE_EXPIRED:
      return storage::CalibrationState::kExpired;
    case v1::CALIBRATION_STATE_WITHDRAWN:
      return storage::CalibrationState::kWithdrawn;
    case v1::CALIBRATION_STATE_SUPERSEDED:
      return storage::CalibrationState::kSuperseded;
    case v1::CALIBRATION_STATE_NOT_YET_VALID:
      return storage::CalibrationState::kNotYetValid;
    default:
      return std::nullopt;
  }
}

absl::Status UnknownKind(v1::CalibrationKind kind) {
  return Refuse("kind", std::to_string(kind), "CALIBRATION_KIND_SENSOR, _ROTATION, _PROBE or _AXIS");
}

}  // namespace

std::string KindText(v1::CalibrationKind kind) {
  switch (kind) {
    case v1::CALIBRATION_KIND_SENSOR:
      return "sensor";
    case v1::CALIBRATION_KIND_ROTATION:
      return "rotation";
    case v1::CALIBRATION_KIND_PROBE:
      return "probe";
    case v1::CALIBRATION_KIND_AXIS:
      return "axis";
    default:
      return "";
  }
}

absl::StatusOr<storage::CalibrationSubject> SubjectOf(const std::string& machine, v1::CalibrationKind kind,
                                                      const std::string& axis) {
  absl::StatusOr<std::string> machine_id = runtime::IdOf("machine", "machines", machine);
  if (!machine_id.ok()) return machine_id.status();
  if (KindText(kind).empty()) return UnknownKind(kind);
  if (kind == v1::CALIBRATION_KIND_AXIS && axis.empty()) return Refuse("axis", "", "the letter of a rotary axis");
  return Subject(*std::move(machine_id), kind, axis);
}

absl::StatusOr<storage::CalibrationFilter> FilterOf(const v1::ListCalibrationsRequest& request) {
  storage::CalibrationFilter filter;
  absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine_id.ok()) return machine_id.status();
  // An axis says which kind is meant.
  const v1::CalibrationKind kind = request.kind() == v1::CALIBRATION_KIND_UNSPECIFIED && !request.axis().empty()
                                       ? v1::CALIBRATION_KIND_AXIS
                                       : request.kind();
  if (KindText(kind).empty() && kind != v1::CALIBRATION_KIND_UNSPECIFIED) return UnknownKind(kind);
  absl::StatusOr<storage::CalibrationSubject> subject = Subject(*std::move(machine_id), kind, request.axis());
  if (!subject.ok()) return subject.status();
  filter.subject = *std::move(subject);
  filter.state = StateOf(request.state());
  if (!filter.state && request.state() != v1::CALIBRATION_STATE_UNSPECIFIED)
    return Refuse("state", std::to_string(request.state()), "a state or none");
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  filter.with_residuals = request.view() == list::v1::VIEW_FULL;
  return filter;
}

absl::StatusOr<storage::StudyFilter> FilterOf(const v1::ListStudiesRequest& request) {
  storage::StudyFilter filter;
  absl::StatusOr<std::string> machine_id = runtime::FilterIdOf("machine", "machines", request.machine());
  if (!machine_id.ok()) return machine_id.status();
  filter.machine_id = *std::move(machine_id);
  filter.kind = KindText(request.kind());
  if (filter.kind.empty() && request.kind() != v1::STUDY_KIND_UNSPECIFIED)
    return Refuse("kind", std::to_string(request.kind()), "a kind of study");
  if (!v1::StudyVerdict_IsValid(request.verdict()))
    return Refuse("verdict", std::to_string(request.verdict()), "a verdict of a study");
  filter.verdict = VerdictText(request.verdict());
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  absl::StatusOr<std::string> calibration_id =
      runtime::FilterIdOf("sensor_calibration", "calibrations", request.sensor_calibration());
  if (!calibration_id.ok()) return calibration_id.status();
  filter.sensor_calibration_id = *std::move(calibration_id);
  filter.clamping = request.clamping();
  return filter;
}

}  // namespace sixpoint::calibration
