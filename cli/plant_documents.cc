#include "cli/plant_documents.h"

#include <cctype>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "cli/reference_documents.h"
#include "cli/region_document.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kGreatestGroupCount = 1000;
constexpr std::size_t kGreatestStationCount = 64;
constexpr std::size_t kGreatestShapeRegionCount = 64;
constexpr std::size_t kGreatestHoleCount = 10000;

void ReadJoints(const Field& joints, google::protobuf::RepeatedPtrField<plant::v1::Joint>* out) {
  for (const Field& item : joints.Items(0, 6)) {
    item.OnlyKeys({"axis", "kind", "direction", "point_mm", "sign", "limits_mm", "limits_deg",
                   "positioning_standard_uncertainty_deg"});
    plant::v1::Joint* joint = out->Add();
    joint->set_axis(item.At("axis").Choice({"X", "Y", "Z", "A", "B", "C", "W"}));
    const bool rotary = item.At("kind").Choice({"linear", "rotary"}) == "rotary";
    joint->set_kind(rotary ? plant::v1::JOINT_KIND_ROTARY : plant::v1::JOINT_KIND_LINEAR);
    runtime::ToProto(item.At("direction").Direction(), joint->mutable_direction());
    if (rotary) runtime::ToProto(item.At("point_mm").Vector3(), joint->mutable_point_mm());
    const auto sign = item.Find("sign");
    joint->set_sign(sign ? sign->Number(-1, 1) : 1);
    if (sign && std::abs(sign->Number(-1, 1)) != 1) sign->Refuse("1 or -1");
    const Eigen::Vector2d limits = item.At(rotary ? "limits_deg" : "limits_mm").Vector2();
    if (limits.x() > limits.y()) item.At(rotary ? "limits_deg" : "limits_mm").Refuse("the lower limit first");
    joint->set_minimum(limits.x());
    joint->set_maximum(limits.y());
    if (const auto figure = item.Find("positioning_standard_uncertainty_deg"))
      joint->set_positioning_standard_uncertainty_deg(figure->Positive(10));
  }
}

void ReadPlaneFeatures(const Field& features, google::protobuf::RepeatedPtrField<plant::v1::NamedPlanePoint>* out) {
  for (const auto& [feature, at] : features.Members(1, kGreatestFeatureCount)) {
    plant::v1::NamedPlanePoint* point = out->Add();
    point->set_feature(feature);
    const Eigen::Vector2d position = at.Vector2();
    point->set_x_mm(position.x());
    point->set_y_mm(position.y());
  }
}

double SideFromPlaneText(const Field& plane) {
  static const std::regex kSides(R"(.*?([0-9]+(?:\.[0-9]+)?) *x *([0-9]+(?:\.[0-9]+)?) *mm.*)");
  const std::string text = plane.Text();
  std::smatch sides;
  if (!std::regex_match(text, sides, kSides) || std::stod(sides[1]) != std::stod(sides[2]) ||
      std::stod(sides[1]) <= 0) {
    plane.Refuse("text with the sides of a square plate, as in '24 x 24 mm'");
    return 1;
  }
  return std::stod(sides[1]);
}

plant::v1::PositionZone ReadZone(const Field& group, plant::v1::PositionZone unless_said) {
  if (unless_said != plant::v1::POSITION_ZONE_UNSPECIFIED && !group.Find("position_zone")) return unless_said;
  return group.At("position_zone").Choice({"diameter", "radius"}) == "diameter" ? plant::v1::POSITION_ZONE_DIAMETER
                                                                                : plant::v1::POSITION_ZONE_RADIUS;
}

void ReadGaugePin(const Field& pin, plant::v1::GaugePin* out) {
  pin.OnlyKeys(
      {"diameter_mm", "diameter_standard_uncertainty_um", "greatest_play_mm", "least_depth_mm", "certificate"});
  out->set_diameter_mm(pin.At("diameter_mm").Positive(160));
  out->set_diameter_standard_uncertainty_um(pin.At("diameter_standard_uncertainty_um").Positive(5));
  out->set_greatest_play_mm(pin.At("greatest_play_mm").Number(0, 1));
  if (const auto depth = pin.Find("least_depth_mm")) out->set_least_depth_mm(depth->Positive(1000));
  if (const auto certificate = pin.Find("certificate")) ReadCertificate(*certificate, out->mutable_certificate());
}

void ReadHoleGroup(const Field& item, plant::v1::PositionZone unless_said, plant::v1::HoleGroup* group) {
  item.OnlyKeys({"name", "diameter_mm", "depth_mm", "a_nominal_deg", "b_nominal_deg", "axis_in_part", "holes",
                 "position_tolerance_mm", "position_zone", "inclination_tolerance_deg", "gauge_pin", "pin_standing"});
  group->set_group(item.At("name").Id());
  group->set_diameter_mm(item.At("diameter_mm").Positive(100));
  group->set_depth_mm(item.At("depth_mm").Positive(1000));
  group->set_a_nominal_deg(item.At("a_nominal_deg").Number(-360, 360));
  group->set_b_nominal_deg(item.At("b_nominal_deg").Number(-360, 360));
  runtime::ToProto(item.At("axis_in_part").Direction(), group->mutable_axis_in_part());
  group->set_position_tolerance_mm(item.At("position_tolerance_mm").Positive(100));
  group->set_position_zone(ReadZone(item, unless_said));
  group->set_inclination_tolerance_deg(item.At("inclination_tolerance_deg").Positive(180));
  if (const auto pin = item.Find("gauge_pin")) ReadGaugePin(*pin, group->mutable_gauge_pin());
  if (const auto standing = item.Find("pin_standing")) {
    standing->OnlyKeys({"clearance_standard_uncertainty_um", "tilt_standard_uncertainty_deg"});
    plant::v1::PinStanding& out = *group->mutable_pin_standing();
    out.set_clearance_standard_uncertainty_um(standing->At("clearance_standard_uncertainty_um").Number(0, 1000));
    out.set_tilt_standard_uncertainty_deg(standing->At("tilt_standard_uncertainty_deg").Number(0, 10));
  }
  std::set<std::string> names;
  for (const Field& hole : item.At("holes").Items(1, kGreatestHoleCount)) {
    hole.OnlyKeys({"name", "start_in_part_mm", "normal_in_part"});
    plant::v1::Hole* out = group->add_holes();
    out->set_hole(hole.At("name").Id());
    runtime::ToProto(hole.At("start_in_part_mm").Vector3(), out->mutable_start_in_part_mm());
    runtime::ToProto(hole.At("normal_in_part").Direction(), out->mutable_normal_in_part());
    if (!names.insert(out->hole()).second) hole.At("name").Refuse("a name that no other hole of the group has");
  }
}

void ReadNominal(const Field& of, geometry::v1::RigidTransform* out) {
  runtime::ToProto(Eigen::Isometry3d(of.At("zero_from_part_nominal").RigidTransform()), out);
}

void ReadStations(const Field& stations, google::protobuf::RepeatedPtrField<plant::v1::Station>* out) {
  for (const Field& item : stations.Items(1, kGreatestStationCount)) {
    item.OnlyKeys({"station", "zero_from_part_nominal", "capture_mm"});
    plant::v1::Station& station = *out->Add();
    station.set_station(item.At("station").Id());
    ReadNominal(item, station.mutable_zero_from_part_nominal());
    if (const auto capture = item.Find("capture_mm")) station.set_capture_mm(capture->Positive(100));
  }
}

void ReadShapeRegions(const Field& regions, google::protobuf::RepeatedPtrField<plant::v1::ShapeRegion>* out) {
  for (const Field& item : regions.Items(1, kGreatestShapeRegionCount)) {
    item.OnlyKeys(RegionKeys({"rest", "kind", "allowance_mm", "lower_mm", "upper_mm"}));
    plant::v1::ShapeRegion& region = *out->Add();
    ReadRegion(item, &region);
    if (const auto rest = item.Find("rest")) region.set_rest(rest->Flag());
    const std::string kind = item.At("kind").Choice({"machined", "fixed", "datum"});
    region.set_kind(kind == "machined" ? plant::v1::SHAPE_REGION_KIND_MACHINED
                    : kind == "fixed"  ? plant::v1::SHAPE_REGION_KIND_FIXED
                                       : plant::v1::SHAPE_REGION_KIND_DATUM);
    if (const auto allowance = item.Find("allowance_mm")) region.set_allowance_mm(allowance->Number());
    if (const auto lower = item.Find("lower_mm")) region.set_lower_mm(lower->Number());
    if (const auto upper = item.Find("upper_mm")) region.set_upper_mm(upper->Number());
  }
}

}  // namespace

plant::v1::Sensor ReadSensor(const Field& sensor) {
  sensor.OnlyKeys(
      {"model", "noise_um", "columns", "mid_range_mm", "range_mm", "line_angle_deg", "serial_number", "kind"});
  plant::v1::Sensor out;
  out.set_model(sensor.At("model").Text());
  out.set_noise_um(sensor.At("noise_um").Positive(1000));
  out.set_mid_range_mm(sensor.At("mid_range_mm").Positive(10000));
  out.set_range_mm(sensor.At("range_mm").Positive(10000));
  out.set_line_angle_deg(sensor.At("line_angle_deg").Positive(179));
  if (const auto serial = sensor.Find("serial_number")) out.set_serial_number(serial->Text());
  if (const auto kind = sensor.Find("kind"))
    out.set_kind(kind->Choice({"line", "snapshot"}) == "line" ? plant::v1::SENSOR_KIND_LINE
                                                              : plant::v1::SENSOR_KIND_SNAPSHOT);
  const auto columns = sensor.Find("columns");
  if (out.kind() != plant::v1::SENSOR_KIND_SNAPSHOT)
    out.set_column_count(static_cast<std::int32_t>(sensor.At("columns").Whole(1, 100000)));
  else if (columns)
    columns->Refuse("none: a snapshot sensor has no columns");
  return out;
}

plant::v1::SafetyEnvelope ReadSafetyEnvelope(const Field& envelope) {
  envelope.OnlyKeys({"translation_mm", "rotation_deg", "uncertainty_share", "registration_age_h", "keep_out_mm",
                     "interim_check_limit_um"});
  plant::v1::SafetyEnvelope out;
  if (const auto value = envelope.Find("translation_mm")) out.set_translation_mm(value->Number(0, 100000));
  if (const auto value = envelope.Find("rotation_deg")) out.set_rotation_deg(value->Number(0, 180));
  if (const auto value = envelope.Find("uncertainty_share")) out.set_uncertainty_share(value->Number(0, 1));
  if (const auto value = envelope.Find("registration_age_h")) out.set_registration_age_h(value->Number(0, 8760));
  if (const auto value = envelope.Find("keep_out_mm")) out.set_keep_out_mm(value->Number(0, 100));
  if (const auto value = envelope.Find("interim_check_limit_um")) out.set_interim_check_limit_um(value->Positive(1000));
  return out;
}

plant::v1::Machine ReadMachine(const Field& machine) {
  machine.OnlyKeys({"id", "part_side", "tool_side", "nominal_centre_mm", "sensor", "safety_envelope", "error_sources",
                    "touch_probe"});
  plant::v1::Machine out;
  ReadJoints(machine.At("part_side"), out.mutable_kinematics()->mutable_part_side());
  ReadJoints(machine.At("tool_side"), out.mutable_kinematics()->mutable_tool_side());
  *out.mutable_sensor() = ReadSensor(machine.At("sensor"));
  runtime::ToProto(machine.At("nominal_centre_mm").Vector3(), out.mutable_nominal_centre_mm());
  if (const auto envelope = machine.Find("safety_envelope"))
    *out.mutable_safety_envelope() = ReadSafetyEnvelope(*envelope);
  if (const auto sources = machine.Find("error_sources")) ReadErrorSources(*sources, out.mutable_error_sources());
  if (const auto probe = machine.Find("touch_probe")) ReadTouchProbe(*probe, out.mutable_touch_probe());
  return out;
}

plant::v1::Artefact ReadArtefact(const Field& artefact) {
  artefact.OnlyKeys({"id", "side_mm", "plane", "cones_mm", "cone_half_angle_deg", "cone_top_radius_mm",
                     "cone_bottom_radius_mm", "slots_mm", "slot_width_mm", "slot_depth_mm", "serial_number",
                     "certificate", "centre_standard_uncertainty_um", "flatness_standard_uncertainty_um"});
  plant::v1::Artefact out;
  if (const auto serial = artefact.Find("serial_number")) out.set_serial_number(serial->Text());
  if (const auto certificate = artefact.Find("certificate")) ReadCertificate(*certificate, out.mutable_certificate());
  if (const auto centre = artefact.Find("centre_standard_uncertainty_um"))
    out.set_centre_standard_uncertainty_um(centre->Positive(100));
  if (const auto flatness = artefact.Find("flatness_standard_uncertainty_um"))
    out.set_flatness_standard_uncertainty_um(flatness->Positive(100));
  const auto side = artefact.Find("side_mm");
  const auto plane = artefact.Find("plane");
  out.set_side_mm(!side && plane ? SideFromPlaneText(*plane) : artefact.At("side_mm").Positive(10000));
  ReadPlaneFeatures(artefact.At("cones_mm"), out.mutable_cones());
  ReadPlaneFeatures(artefact.At("slots_mm"), out.mutable_slots());
  out.set_cone_half_angle_deg(artefact.At("cone_half_angle_deg").Positive(89));
  out.set_cone_top_radius_mm(artefact.At("cone_top_radius_mm").Positive(1000));
  out.set_cone_bottom_radius_mm(artefact.At("cone_bottom_radius_mm").Number(0, 1000));
  out.set_slot_width_mm(artefact.At("slot_width_mm").Positive(1000));
  out.set_slot_depth_mm(artefact.At("slot_depth_mm").Positive(1000));
  return out;
}

plant::v1::Part ReadPart(const Field& part, const std::string& cad_file, plant::v1::PositionZone unless_said) {
  part.OnlyKeys({"id", "cad", "cad_unit", "solid", "zero_from_part_nominal", "stations", "hole_groups", "six_points",
                 "thermal_expansion", "shape_regions"});
  plant::v1::Part out;
  if (const auto solid = part.Find("solid")) out.set_solid(solid->Text());
  if (const auto expansion = part.Find("thermal_expansion"))
    ReadThermalExpansion(*expansion, out.mutable_thermal_expansion());
  std::string ending = std::filesystem::path(cad_file).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".step" || ending == ".stp") {
    out.set_cad_format(plant::v1::CAD_FORMAT_STEP);
  } else if (ending == ".igs" || ending == ".iges") {
    out.set_cad_format(plant::v1::CAD_FORMAT_IGES);
  } else if (ending == ".stl") {
    out.set_cad_format(plant::v1::CAD_FORMAT_STL);
  } else if (!cad_file.empty()) {
    part.At("cad").Refuse("a name that ends in .step, .stp, .igs, .iges or .stl");
  }
  // STEP and IGES say their own.
  if (out.cad_format() == plant::v1::CAD_FORMAT_STL || part.Find("cad_unit")) {
    const std::string unit = part.At("cad_unit").Choice({"mm", "cm", "m", "inch", "in"});
    out.set_cad_unit_mm(unit == "mm" ? 1 : unit == "cm" ? 10 : unit == "m" ? 1000 : 25.4);
  }
  ReadNominal(part, out.mutable_zero_from_part_nominal());
  if (const auto stations = part.Find("stations")) ReadStations(*stations, out.mutable_stations());
  if (const auto regions = part.Find("shape_regions")) ReadShapeRegions(*regions, out.mutable_shape_regions());
  std::set<std::string> names;
  for (const Field& group : part.At("hole_groups").Items(0, kGreatestGroupCount)) {
    ReadHoleGroup(group, unless_said, out.add_hole_groups());
    const std::string& name = out.hole_groups(out.hole_groups_size() - 1).group();
    if (!name.empty() && !names.insert(name).second) group.At("name").Refuse("a name that no other group has");
  }
  // None: a part that is positioned by best fit alone.
  const auto datums = part.Find("six_points");
  if (!datums) return out;
  for (const Field& item : datums->Items(0, 6)) {
    item.OnlyKeys({"name", "point_in_part_mm", "normal_in_part"});
    plant::v1::DatumPoint* datum = out.add_six_points();
    datum->set_datum(item.At("name").Id());
    runtime::ToProto(item.At("point_in_part_mm").Vector3(), datum->mutable_point_in_part_mm());
    runtime::ToProto(item.At("normal_in_part").Direction(), datum->mutable_normal_in_part());
  }
  if (out.six_points_size() % 6 != 0) datums->Refuse("six datum points, or none");
  return out;
}

absl::StatusOr<plant::v1::CreateMachineRequest> LoadMachine(const std::string& path) {
  absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  plant::v1::CreateMachineRequest request;
  request.set_machine_id(root.At("id").Id());
  *request.mutable_machine() = ReadMachine(root);
  if (!problems.empty()) return problems.ToStatus();
  return request;
}

absl::StatusOr<plant::v1::CreateArtefactRequest> LoadArtefact(const std::string& path) {
  absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  plant::v1::CreateArtefactRequest request;
  request.set_artefact_id(root.At("id").Id());
  *request.mutable_artefact() = ReadArtefact(root);
  if (!problems.empty()) return problems.ToStatus();
  return request;
}

absl::StatusOr<plant::v1::CreatePartRequest> LoadPart(const std::string& path) {
  absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  const std::string cad_file = root.At("cad").Text();
  plant::v1::CreatePartRequest request;
  request.set_part_id(root.At("id").Id());
  *request.mutable_part() = ReadPart(root, cad_file);
  if (!problems.empty()) return problems.ToStatus();
  const std::filesystem::path beside = std::filesystem::path(path).parent_path() / cad_file;
  absl::StatusOr<std::string> cad = ReadFile(beside.string(), kGreatestCadBytes);
  if (!cad.ok()) return cad.status();
  request.set_cad(std::move(*cad));
  return request;
}

}  // namespace sixpoint::cli
