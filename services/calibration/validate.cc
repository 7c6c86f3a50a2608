#include "services/calibration/validate.h"

#include <cmath>
#include <optional>

#include "refusal/message_text.h"
#include "services/calibration/axis_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/limits.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/machine_chain.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

constexpr double kRadPerDeg = M_PI / 180;
constexpr int kMostTouchPoints = 1000;
constexpr int kMostPoses = 5000;
constexpr std::chrono::hours kLongestValidity{10 * 366 * 24};
// 2000-01-01 and 2200-01-01.
constexpr std::int64_t kEarliest_s = 946684800, kLatest_s = 7258118400;

absl::Status CheckUncertainty(double value_um) {
  if (std::isfinite(value_um) && value_um >= 0 && value_um <= 100) return absl::OkStatus();
  return Refuse("standard_uncertainty_um", value_um, "0 (not stated) to 100");
}

absl::StatusOr<metrology::Points> PointsOf(const std::string& field,
                                           const google::protobuf::RepeatedPtrField<geometry::v1::Point>& in) {
  metrology::Points points;
  for (int i = 0; i < in.size(); ++i) {
    const absl::StatusOr<Eigen::Vector3d> point = runtime::FromProto(Indexed(field, i), in[i]);
    if (!point.ok()) return point.status();
    points.push_back(*point);
  }
  return points;
}

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

std::string Indexed(const std::string& field, int i) { return field + "[" + std::to_string(i) + "]"; }

absl::Status CheckCount(const std::string& field, int count, int least, int most) {
  if (count >= least && count <= most) return absl::OkStatus();
  return Refuse(field, std::to_string(count) + " of them", std::to_string(least) + " to " + std::to_string(most));
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
  if (KindText(request.kind()).empty() && request.kind() != v1::CALIBRATION_KIND_UNSPECIFIED)
    return UnknownKind(request.kind());
  absl::StatusOr<storage::CalibrationSubject> subject = Subject(*std::move(machine_id), request.kind(), request.axis());
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

absl::StatusOr<storage::Instant> InstantOf(const std::string& field, const google::protobuf::Timestamp& time) {
  if (time.seconds() < kEarliest_s || time.seconds() > kLatest_s || time.nanos() < 0 || time.nanos() > 999'999'999)
    return Refuse(field, std::to_string(time.seconds()) + " s", "a time between the years 2000 and 2200");
  return runtime::MomentOf(time);
}

absl::StatusOr<Validity> ValidityOf(const google::protobuf::Timestamp* from, const google::protobuf::Timestamp* until,
                                    storage::Instant now, std::chrono::hours usual) {
  Validity validity{now, now};
  if (from != nullptr) {
    const absl::StatusOr<storage::Instant> start = InstantOf("valid_from", *from);
    if (!start.ok()) return start.status();
    validity.from = *start;
  }
  validity.until = validity.from + usual;
  if (until != nullptr) {
    const absl::StatusOr<storage::Instant> end = InstantOf("valid_until", *until);
    if (!end.ok()) return end.status();
    validity.until = *end;
  }
  if (validity.until <= validity.from || validity.until - validity.from > kLongestValidity)
    return Refuse("valid_until", std::to_string(until == nullptr ? 0 : until->seconds()) + " s",
                  "later than valid_from, by at most 10 years");
  return validity;
}

absl::Status CheckCaller(const std::string& machine, const std::string& requested_by, const std::string& request_id) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("machine", "machines", machine).status());
  return refusals.Add(runtime::CheckCaller(requested_by, request_id)).status();
}

absl::Status CheckSensorRequest(const v1::CalibrateSensorRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(CheckCaller(request.machine(), request.requested_by(), request.request_id()))
      .Add(runtime::IdOf("artefact", "artefacts", request.artefact()).status())
      .Add(runtime::CheckNames("scans", "scans", request.scans(), 1, runtime::kMostScans));
  if (!request.has_touch()) refusals.Add(Refuse("touch", "", "the artefact as the touch probe measured it"));
  if (!v1::SensorMethod_IsValid(request.method()))
    refusals.Add(Refuse("method", request.method(), "JOINT or SEQUENTIAL"));
  return refusals.status();
}

absl::StatusOr<metrology::ArtefactTouch> TouchOf(const v1::TouchData& in) {
  if (absl::Status s = CheckCount("touch.centres", in.centres_size(), 3, kMostTouchPoints); !s.ok()) return s;
  for (const auto& [field, count] : {std::pair<const char*, int>{"touch.plane_mm", in.plane_mm_size()},
                                     {"touch.side_x_mm", in.side_x_mm_size()},
                                     {"touch.side_y_mm", in.side_y_mm_size()}})
    if (absl::Status s = CheckCount(field, count, 0, kMostTouchPoints); !s.ok()) return s;
  if (absl::Status s = CheckUncertainty(in.standard_uncertainty_um()); !s.ok()) return s;
  metrology::ArtefactTouch touch;
  touch.standard_uncertainty_mm = 1e-3 * in.standard_uncertainty_um();
  for (int i = 0; i < in.centres_size(); ++i) {
    const std::string field = Indexed("touch.centres", i);
    if (absl::Status s = runtime::CheckId(field + ".feature", in.centres(i).feature()); !s.ok()) return s;
    if (!in.centres(i).has_point_mm()) return Refuse(field + ".point_mm", "", "a point");
    const absl::StatusOr<Eigen::Vector3d> point = runtime::FromProto(field + ".point_mm", in.centres(i).point_mm());
    if (!point.ok()) return point.status();
    touch.centres.push_back({in.centres(i).feature(), *point});
  }
  absl::StatusOr<metrology::Points> plane = PointsOf("touch.plane_mm", in.plane_mm());
  if (!plane.ok()) return plane.status();
  absl::StatusOr<metrology::Points> side_x = PointsOf("touch.side_x_mm", in.side_x_mm());
  if (!side_x.ok()) return side_x.status();
  absl::StatusOr<metrology::Points> side_y = PointsOf("touch.side_y_mm", in.side_y_mm());
  if (!side_y.ok()) return side_y.status();
  touch.plane_mm = *std::move(plane);
  touch.side_x_mm = *std::move(side_x);
  touch.side_y_mm = *std::move(side_y);
  return touch;
}

absl::StatusOr<metrology::Artefact> ArtefactOf(const plant::v1::Artefact& in) {
  metrology::Artefact artefact;
  artefact.side_mm = in.side_mm();
  for (const plant::v1::NamedPlanePoint& c : in.cones()) artefact.cones.push_back({c.feature(), {c.x_mm(), c.y_mm()}});
  artefact.cone_half_angle_rad = in.cone_half_angle_deg() * kRadPerDeg;
  artefact.cone_top_radius_mm = in.cone_top_radius_mm();
  artefact.cone_bottom_radius_mm = in.cone_bottom_radius_mm();
  for (const plant::v1::NamedPlanePoint& q : in.slots()) artefact.slots.push_back({q.feature(), {q.x_mm(), q.y_mm()}});
  artefact.slot_width_mm = in.slot_width_mm();
  artefact.slot_depth_mm = in.slot_depth_mm();
  if (absl::Status s = metrology::Validate(artefact); !s.ok()) return s;
  return artefact;
}

metrology::LineSensorOptics OpticsOf(const plant::v1::Sensor& sensor) {
  metrology::LineSensorOptics optics;
  if (std::isfinite(sensor.mid_range_mm()) && sensor.mid_range_mm() > 0) optics.mid_range_mm = sensor.mid_range_mm();
  if (std::isfinite(sensor.noise_um()) && sensor.noise_um() > 0) optics.noise_mm = 1e-3 * sensor.noise_um();
  return optics;
}

absl::Status CheckScan(const v1::CalibrateSensorRequest& request, const ingest::v1::Scan& scan,
                       const ingest::v1::Scan& first) {
  const ingest::v1::ScanHeader& header = scan.header();
  if (header.machine() != request.machine())
    return Refuse("scans", scan.name() + " of " + header.machine(), "scans of " + request.machine());
  if (header.subject() != request.artefact())
    return Refuse("scans", scan.name() + " of " + header.subject(), "scans of " + request.artefact());
  // The touch data are of one place: the artefact stands on axes that must not have turned in between.
  if (header.a_deg() != first.header().a_deg() || header.b_deg() != first.header().b_deg())
    return Refuse("scans", scan.name() + " at A " + NumberText(header.a_deg()) + ", B " + NumberText(header.b_deg()),
                  "A and B as in " + first.name());
  return absl::OkStatus();
}

absl::Status CheckRotationRequest(const v1::CalibrateRotationRequest& request) {
  const bool standard = request.method() == v1::ROTATION_METHOD_STANDARD;
  runtime::Refusals refusals;
  refusals.Add(CheckCaller(request.machine(), request.requested_by(), request.request_id()))
      .Add(CheckCount("poses", request.poses_size(), standard ? 0 : 1, kMostPoses));
  if (!v1::RotationMethod_IsValid(request.method()))
    refusals.Add(Refuse("method", request.method(), "LINES, POINT_C or STANDARD"));
  if (standard != request.has_standard())
    refusals.Add(
        Refuse("standard", standard ? "" : "given", standard ? "bore and face" : "none but for method STANDARD"));
  return refusals.Add(CheckUncertainty(request.standard_uncertainty_um())).status();
}

absl::StatusOr<std::vector<metrology::SpherePose>> PosesOf(const v1::CalibrateRotationRequest& request) {
  std::vector<metrology::SpherePose> poses;
  for (int i = 0; i < request.poses_size(); ++i) {
    const v1::SpherePose& in = request.poses(i);
    const std::string field = Indexed("poses", i);
    for (const auto& [name, value] : {std::pair{".a_deg", in.a_deg()}, {".b_deg", in.b_deg()}})
      if (!std::isfinite(value) || std::abs(value) > 3600) return Refuse(field + name, value, "within +-3600");
    if (!in.has_centre_mm()) return Refuse(field + ".centre_mm", "", "a point");
    const absl::StatusOr<Eigen::Vector3d> centre = runtime::FromProto(field + ".centre_mm", in.centre_mm());
    if (!centre.ok()) return centre.status();
    poses.push_back({in.a_deg() * kRadPerDeg, in.b_deg() * kRadPerDeg, *centre,
                     in.held_out() || request.method() == v1::ROTATION_METHOD_STANDARD, TravelFrom(in.a_travel()),
                     TravelFrom(in.b_travel())});
  }
  return poses;
}

absl::StatusOr<metrology::StandardProbing> ProbingOf(const v1::StandardProbing& in) {
  metrology::StandardProbing probing;
  if (absl::Status s = CheckCount("standard.bore_mm", in.bore_mm_size(), 4, kMostTouchPoints); !s.ok()) return s;
  if (absl::Status s = CheckCount("standard.face_mm", in.face_mm_size(), 3, kMostTouchPoints); !s.ok()) return s;
  absl::StatusOr<metrology::Points> bore = PointsOf("standard.bore_mm", in.bore_mm());
  if (!bore.ok()) return bore.status();
  absl::StatusOr<metrology::Points> face = PointsOf("standard.face_mm", in.face_mm());
  if (!face.ok()) return face.status();
  if (!std::isfinite(in.face_above_centre_mm()))
    return Refuse("standard.face_above_centre_mm", in.face_above_centre_mm(), "a number");
  probing.bore_mm = *std::move(bore);
  probing.face_mm = *std::move(face);
  probing.face_above_centre_mm = in.face_above_centre_mm();
  return probing;
}

absl::StatusOr<metrology::RotationOptions> RotationOptionsOf(const plant::v1::Machine& machine) {
  const absl::StatusOr<metrology::JointChain> chain = runtime::ChainOf(machine);
  if (!chain.ok()) return chain.status();
  absl::StatusOr<metrology::RotationOptions> options = metrology::RotationOptions::Of(*chain);
  if (!options.ok())
    return runtime::Failure(errors::v1::KINEMATICS_UNSUITABLE,
                            machine.name() + "." + std::string(options.status().message()),
                            {{"resource", machine.name()}});
  return options;
}

absl::Status CheckEnvironment(const v1::Environment& in) {
  const auto outside = [](double value, double least, double most) {
    return !std::isfinite(value) || value < least || value > most;
  };
  runtime::Refusals refusals;
  if (in.has_temperature_c() && outside(in.temperature_c(), -50, 100))
    refusals.Add(Refuse("environment.temperature_c", in.temperature_c(), "-50 to 100"));
  if (in.has_temperature_standard_uncertainty_c() && outside(in.temperature_standard_uncertainty_c(), 0, 50))
    refusals.Add(
        Refuse("environment.temperature_standard_uncertainty_c", in.temperature_standard_uncertainty_c(), "0 to 50"));
  if (in.has_temperature_standard_uncertainty_c() && !in.has_temperature_c())
    refusals.Add(Refuse("environment.temperature_c", "", "a temperature, of which the uncertainty is stated"));
  if (in.has_humidity_percent() && outside(in.humidity_percent(), 0, 100))
    refusals.Add(Refuse("environment.humidity_percent", in.humidity_percent(), "0 to 100"));
  return refusals.Add(runtime::CheckText("environment.note", in.note(), runtime::kLongestReason)).status();
}

absl::Status CheckEvent(const std::string& reason, const std::string& requested_by, const std::string& request_id) {
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckText("reason", reason, runtime::kLongestReason));
  return refusals.Add(runtime::CheckCaller(requested_by, request_id)).status();
}

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

}  // namespace sixpoint::calibration
