#include "services/calibration/readings.h"

#include <cmath>
#include <utility>

#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/units.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

metrology::Travel TravelFrom(v1::Travel travel) {
  switch (travel) {
    case v1::TRAVEL_FORWARD:
      return metrology::Travel::kForward;
    case v1::TRAVEL_BACKWARD:
      return metrology::Travel::kBackward;
    default:
      return metrology::Travel::kUnknown;
  }
}

absl::StatusOr<std::vector<metrology::ProbedFace>> FacesOf(
    const std::string& list, const google::protobuf::RepeatedPtrField<v1::ProbedFace>& in) {
  std::vector<metrology::ProbedFace> faces;
  for (int j = 0; j < in.size(); ++j) {
    const std::string field = Indexed(list, j);
    if (absl::Status s = runtime::CheckId(field + ".face", in[j].face()); !s.ok()) return s;
    if (absl::Status s = CheckCount(field + ".touched_mm", in[j].touched_mm_size(), 3); !s.ok()) return s;
    metrology::ProbedFace& face = faces.emplace_back();
    face.face = in[j].face();
    const auto normal = runtime::FromProto(field + ".nominal_normal", in[j].nominal_normal());
    if (!normal.ok()) return normal.status();
    face.nominal_normal = *normal;
    for (int k = 0; k < in[j].touched_mm_size(); ++k) {
      const auto point = runtime::FromProto(Indexed(field + ".touched_mm", k), in[j].touched_mm(k));
      if (!point.ok()) return point.status();
      face.touched_mm.push_back(*point);
    }
  }
  return faces;
}

absl::StatusOr<std::vector<metrology::ProbeReading>> BeamReadingsOf(
    const std::string& list, const google::protobuf::RepeatedPtrField<v1::ProbeReading>& in) {
  std::vector<metrology::ProbeReading> readings;
  for (int i = 0; i < in.size(); ++i) {
    const std::string field = Indexed(list, i);
    if (absl::Status s = runtime::CheckId(field + ".face", in[i].face()); !s.ok()) return s;
    if (!in[i].has_position_mm()) return Refuse(field + ".position_mm", "", "a point");
    const auto position = runtime::FromProto(field + ".position_mm", in[i].position_mm());
    if (!position.ok()) return position.status();
    readings.push_back({in[i].face(), *position, in[i].displacement_mm()});
  }
  return readings;
}

}  // namespace

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

absl::StatusOr<metrology::ArtefactTouch> TouchOf(const v1::TouchData& in) {
  if (absl::Status s = CheckCount("touch.centres", in.centres_size(), 3); !s.ok()) return s;
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
    poses.push_back({in.a_deg() * runtime::kRadPerDeg, in.b_deg() * runtime::kRadPerDeg, *centre,
                     in.held_out() || request.method() == v1::ROTATION_METHOD_STANDARD, TravelFrom(in.a_travel()),
                     TravelFrom(in.b_travel())});
  }
  return poses;
}

absl::StatusOr<metrology::StandardProbing> ProbingOf(const v1::StandardProbing& in) {
  metrology::StandardProbing probing;
  if (absl::Status s = CheckCount("standard.bore_mm", in.bore_mm_size(), 4); !s.ok()) return s;
  if (absl::Status s = CheckCount("standard.face_mm", in.face_mm_size(), 3); !s.ok()) return s;
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

absl::StatusOr<ProbeReadings> ProbeReadingsOf(const v1::CalibrateProbeRequest& request) {
  ProbeReadings measured;
  auto faces = FacesOf("faces", request.faces());
  if (!faces.ok()) return faces.status();
  auto readings = BeamReadingsOf("readings", request.readings());
  if (!readings.ok()) return readings.status();
  auto moved_faces = FacesOf("moved_faces", request.moved_faces());
  if (!moved_faces.ok()) return moved_faces.status();
  auto moved_readings = BeamReadingsOf("moved_readings", request.moved_readings());
  if (!moved_readings.ok()) return moved_readings.status();
  measured.faces = *std::move(faces);
  measured.readings = *std::move(readings);
  measured.moved_faces = *std::move(moved_faces);
  measured.moved_readings = *std::move(moved_readings);
  measured.options.noise_mm = request.noise_um() / runtime::kUmPerMm;
  if (request.touch_standard_uncertainty_um() != 0)
    measured.options.touch_uncertainty_mm = request.touch_standard_uncertainty_um() / runtime::kUmPerMm;
  measured.options.position_uncertainty_mm = request.position_standard_uncertainty_um() / runtime::kUmPerMm;
  measured.options.least_displacement_mm = request.least_displacement_mm();
  measured.options.greatest_displacement_mm = request.greatest_displacement_mm();
  if (request.greatest_approach_angle_deg() != 0)
    measured.options.greatest_approach_angle_rad = request.greatest_approach_angle_deg() / runtime::kDegPerRad;
  return measured;
}

absl::StatusOr<std::vector<metrology::AxisReading>> ReadingsOf(const v1::AxisRun& run) {
  const int count = run.commanded_deg_size();
  if (count < 1) return Refuse("run.commanded_deg", "0 values", "at least one");
  if (run.measured_deg_size() != count)
    return Refuse("run.measured_deg", std::to_string(run.measured_deg_size()) + " values",
                  std::to_string(count) + ", one for each command");
  if (run.travel_size() != 0 && run.travel_size() != count)
    return Refuse("run.travel", std::to_string(run.travel_size()) + " values",
                  "none or " + std::to_string(count) + ", one for each command");
  std::vector<double> commanded_rad;
  for (int i = 0; i < count; ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    if (!std::isfinite(run.commanded_deg(i))) return Refuse("run.commanded_deg" + at, run.commanded_deg(i), "a number");
    if (!std::isfinite(run.measured_deg(i))) return Refuse("run.measured_deg" + at, run.measured_deg(i), "a number");
    if (run.travel_size() != 0 && run.travel(i) != v1::TRAVEL_FORWARD && run.travel(i) != v1::TRAVEL_BACKWARD)
      return Refuse("run.travel" + at, std::to_string(run.travel(i)), "TRAVEL_FORWARD or TRAVEL_BACKWARD");
    commanded_rad.push_back(run.commanded_deg(i) * runtime::kRadPerDeg);
  }
  std::vector<metrology::Travel> travel;
  if (run.travel_size() == 0) {
    const auto derived = metrology::TravelOf(commanded_rad);
    if (!derived.ok()) return Refuse("run.commanded_deg", "all the same", "a turn and back");
    travel = *derived;
  }
  std::vector<metrology::AxisReading> readings;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<size_t>(i);
    readings.push_back({commanded_rad[k], run.measured_deg(i) * runtime::kRadPerDeg,
                        travel.empty() ? TravelFrom(run.travel(i)) : travel[k]});
  }
  return readings;
}

}  // namespace sixpoint::calibration
