#include "services/plant/validate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "metrology/frames/pose.h"
#include "refusal/message_text.h"
#include "services/plant/checks.h"
#include "services/plant/validate_shape_regions.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

constexpr int kGreatestHoleCount = 20'000;
constexpr int kGreatestFeatureCount = 1'000;  // of an artefact: cones and slots together
constexpr double kBoxMarginMm = 1;
constexpr double kUsualCaptureMm = 5;
constexpr double kGreatestCaptureMm = 100;

absl::Status CheckName(const std::string& field, const std::string& name, std::set<std::string>* seen) {
  if (absl::Status status = runtime::CheckId(field, name); !status.ok()) return status;
  return seen->insert(name).second ? absl::OkStatus() : Refuse(field, name, "a name that no other has");
}

absl::Status ReadFeatures(const std::string& field, const std::string& kind, double half_side_mm,
                          const google::protobuf::RepeatedPtrField<v1::NamedPlanePoint>& features,
                          std::set<std::string>* names, storage::ArtefactRow* row) {
  runtime::Refusals refusals;
  for (int i = 0; i < features.size(); ++i) {
    const v1::NamedPlanePoint& feature = features[i];
    const std::string at = field + "[" + std::to_string(i) + "]";
    refusals.Add(CheckName(at + ".feature", feature.feature(), names))
        .Add(CheckRange(at + ".x_mm", feature.x_mm(), -half_side_mm, half_side_mm, "on the plate"))
        .Add(CheckRange(at + ".y_mm", feature.y_mm(), -half_side_mm, half_side_mm, "on the plate"));
    row->features.push_back({kind, feature.feature(), feature.x_mm(), feature.y_mm()});
  }
  return refusals.status();
}

absl::Status ReadHole(const std::string& field, const v1::Hole& hole, std::set<std::string>* names,
                      storage::HoleRow* row) {
  row->hole = hole.hole();
  return runtime::Refusals()
      .Add(CheckName(field + ".hole", hole.hole(), names))
      .Add(Read(field + ".start_in_part_mm", hole.has_start_in_part_mm(), hole.start_in_part_mm(),
                &row->start_in_part_mm))
      .Add(Read(field + ".normal_in_part", hole.has_normal_in_part(), hole.normal_in_part(), &row->normal_in_part))
      .status();
}

absl::Status ReadZone(const std::string& field, v1::PositionZone zone, std::string* row) {
  if (zone != v1::POSITION_ZONE_DIAMETER && zone != v1::POSITION_ZONE_RADIUS)
    return Refuse(field, v1::PositionZone_Name(zone),
                  "POSITION_ZONE_DIAMETER where the drawing's tolerance is a diameter, else POSITION_ZONE_RADIUS");
  *row = v1::PositionZone_Name(zone).substr(std::string("POSITION_ZONE_").size());
  return absl::OkStatus();
}

absl::Status ReadGaugePin(const std::string& field, const v1::HoleGroup& group, storage::HoleGroupRow* row) {
  const v1::GaugePin& pin = group.gauge_pin();
  const double hole_mm = group.diameter_mm();
  row->gauge_pin = {pin.diameter_mm(), pin.diameter_standard_uncertainty_um(), pin.greatest_play_mm()};
  runtime::Refusals refusals;
  refusals
      .Add(CheckRange(field + ".diameter_mm", pin.diameter_mm(), 0.5 * hole_mm, 1.6 * hole_mm,
                      "0.5 to 1.6 of the hole's diameter"))
      .Add(CheckPositive(field + ".diameter_standard_uncertainty_um", pin.diameter_standard_uncertainty_um(), 5));
  if (!pin.has_greatest_play_mm()) refusals.Add(Refuse(field + ".greatest_play_mm", "unset", "0 to 1"));
  if (pin.has_greatest_play_mm() &&
      !(pin.greatest_play_mm() >= std::max(0.0, hole_mm - pin.diameter_mm()) - 1e-9 && pin.greatest_play_mm() <= 1))
    refusals.Add(Refuse(field + ".greatest_play_mm", pin.greatest_play_mm(),
                        "0 to 1, and what the hole's diameter leaves beside the pin's at least"));
  refusals.Add(
      ReadCertificate(field + ".certificate", pin.has_certificate(), pin.certificate(), &row->gauge_pin->certificate));
  if (!pin.has_least_depth_mm()) return refusals.status();
  row->gauge_pin->least_depth_mm = pin.least_depth_mm();
  if (!(pin.least_depth_mm() > 0 && pin.least_depth_mm() <= group.depth_mm()))
    refusals.Add(Refuse(field + ".least_depth_mm", pin.least_depth_mm(), "more than 0, at most the hole's depth"));
  return refusals.status();
}

absl::Status ReadPinStanding(const std::string& field, const v1::PinStanding& standing, storage::HoleGroupRow* row) {
  const double clearance_um = standing.clearance_standard_uncertainty_um();
  const double tilt_deg = standing.tilt_standard_uncertainty_deg();
  row->pin_standing = {clearance_um, tilt_deg};
  return runtime::Refusals()
      .Add(CheckRange(field + ".clearance_standard_uncertainty_um", clearance_um, 0, 1000, "0 to 1000"))
      .Add(CheckRange(field + ".tilt_standard_uncertainty_deg", tilt_deg, 0, 10, "0 to 10"))
      .status();
}

absl::Status ReadGroup(const std::string& field, const v1::HoleGroup& group, std::set<std::string>* names,
                       storage::HoleGroupRow* row) {
  row->group = group.group();
  row->diameter_mm = group.diameter_mm();
  row->depth_mm = group.depth_mm();
  row->a_nominal_deg = group.a_nominal_deg();
  row->b_nominal_deg = group.b_nominal_deg();
  row->position_tolerance_mm = group.position_tolerance_mm();
  row->inclination_tolerance_deg = group.inclination_tolerance_deg();
  runtime::Refusals refusals;
  refusals.Add(CheckName(field + ".group", row->group, names))
      .Add(CheckPositive(field + ".diameter_mm", row->diameter_mm, 100))
      .Add(CheckPositive(field + ".depth_mm", row->depth_mm, 1000))
      .Add(CheckRange(field + ".a_nominal_deg", row->a_nominal_deg, -360, 360, "-360 to 360"))
      .Add(CheckRange(field + ".b_nominal_deg", row->b_nominal_deg, -360, 360, "-360 to 360"))
      .Add(Read(field + ".axis_in_part", group.has_axis_in_part(), group.axis_in_part(), &row->axis_in_part))
      .Add(CheckPositive(field + ".position_tolerance_mm", row->position_tolerance_mm, 100))
      .Add(CheckPositive(field + ".inclination_tolerance_deg", row->inclination_tolerance_deg, 90));
  refusals.Add(ReadZone(field + ".position_zone", group.position_zone(), &row->position_zone));
  if (group.has_gauge_pin()) refusals.Add(ReadGaugePin(field + ".gauge_pin", group, row));
  if (group.has_pin_standing()) refusals.Add(ReadPinStanding(field + ".pin_standing", group.pin_standing(), row));
  if (group.holes().empty()) refusals.Add(Refuse(field + ".holes", "0 holes", "at least one"));
  std::set<std::string> hole_names;
  for (int i = 0; i < group.holes_size(); ++i) {
    const std::string at = field + ".holes[" + std::to_string(i) + "]";
    refusals.Add(ReadHole(at, group.holes(i), &hole_names, &row->holes.emplace_back()));
  }
  return refusals.status();
}

absl::Status ReadCad(const v1::CreatePartRequest& request, storage::PartRow* row) {
  if (request.cad().empty()) return Refuse("cad", "0 bytes", "a STEP, IGES or STL file");
  row->cad_unit_mm = request.part().cad_unit_mm();
  switch (request.part().cad_format()) {
    case v1::CAD_FORMAT_STEP:
      row->cad_format = "step";
      break;
    case v1::CAD_FORMAT_IGES:
      row->cad_format = "iges";
      break;
    case v1::CAD_FORMAT_STL:
      row->cad_format = "stl";
      return CheckPositive("part.cad_unit_mm", row->cad_unit_mm, 10'000);
    default:
      return Refuse("part.cad_format", v1::CadFormat_Name(request.part().cad_format()), "STEP, IGES or STL");
  }
  return CheckRange("part.cad_unit_mm", row->cad_unit_mm, 0, 10'000, "0: STEP and IGES say their own unit");
}

absl::Status ReadSolid(const v1::Part& part, storage::PartRow* row) {
  row->solid = part.solid();
  if (row->solid.empty()) return absl::OkStatus();
  if (part.cad_format() == v1::CAD_FORMAT_STL) return Refuse("part.solid", row->solid, "none: STL has no solids");
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  if (std::any_of(row->solid.begin(), row->solid.end(), is_control))
    return Refuse("part.solid", "a text with control characters", "a solid's name or number in the CAD file");
  return absl::OkStatus();
}

// Of a part or a station.
template <typename Message, typename Row>
absl::Status ReadNominal(const std::string& of, const Message& message, Row* row) {
  const std::string field = of + ".zero_from_part_nominal";
  if (!message.has_zero_from_part_nominal()) return Refuse(field, "", "a rigid transform");
  const absl::StatusOr<Eigen::Isometry3d> nominal = runtime::FromProto(field, message.zero_from_part_nominal());
  if (!nominal.ok()) return nominal.status();
  for (int i = 0; i < 9; ++i) row->zero_from_part_nominal_rotation.push_back(nominal->linear()(i / 3, i % 3));
  row->zero_from_part_nominal_translation_mm = runtime::RowMajor(nominal->translation());
  return absl::OkStatus();
}

absl::Status ReadStation(const std::string& field, const v1::Station& station, std::set<std::string>* names,
                         storage::StationRow* row) {
  row->station = station.station();
  row->capture_mm = station.has_capture_mm() ? station.capture_mm() : kUsualCaptureMm;
  return runtime::Refusals()
      .Add(CheckName(field + ".station", row->station, names))
      .Add(ReadNominal(field, station, row))
      .Add(CheckPositive(field + ".capture_mm", row->capture_mm, kGreatestCaptureMm))
      .status();
}

Eigen::Isometry3d NominalOf(const storage::StationRow& row) {
  Eigen::Isometry3d nominal = Eigen::Isometry3d::Identity();
  nominal.linear() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row.zero_from_part_nominal_rotation.data());
  nominal.translation() = Eigen::Map<const Eigen::Vector3d>(row.zero_from_part_nominal_translation_mm.data());
  return nominal;
}

std::string TextOf(const std::vector<double>& point) {
  return "(" + Rounded(point[0]) + ", " + Rounded(point[1]) + ", " + Rounded(point[2]) + ")";
}

}  // namespace

absl::StatusOr<storage::ArtefactRow> Validated(const v1::CreateArtefactRequest& request) {
  const v1::Artefact& artefact = request.artefact();
  storage::ArtefactRow row;
  row.artefact_id = request.artefact_id();
  row.content_sha256 = ContentSha256(artefact);
  row.side_mm = artefact.side_mm();
  row.cone_half_angle_deg = artefact.cone_half_angle_deg();
  row.cone_top_radius_mm = artefact.cone_top_radius_mm();
  row.cone_bottom_radius_mm = artefact.cone_bottom_radius_mm();
  row.slot_width_mm = artefact.slot_width_mm();
  row.slot_depth_mm = artefact.slot_depth_mm();
  const double side = row.side_mm;
  runtime::Refusals refusals;
  row.serial_number = artefact.serial_number();
  refusals.Add(runtime::CheckId("artefact_id", row.artefact_id))
      .Add(CheckPositive("artefact.side_mm", side, 5'000))
      .Add(ReadCertificate("artefact.certificate", artefact.has_certificate(), artefact.certificate(),
                           &row.certificate));
  if (artefact.has_centre_standard_uncertainty_um()) {
    row.centre_standard_uncertainty_um = artefact.centre_standard_uncertainty_um();
    refusals.Add(
        CheckPositive("artefact.centre_standard_uncertainty_um", artefact.centre_standard_uncertainty_um(), 100));
  }
  if (artefact.has_flatness_standard_uncertainty_um()) {
    row.flatness_standard_uncertainty_um = artefact.flatness_standard_uncertainty_um();
    refusals.Add(
        CheckPositive("artefact.flatness_standard_uncertainty_um", artefact.flatness_standard_uncertainty_um(), 100));
  }
  if (absl::Status status = refusals.status(); !status.ok()) return status;  // what follows is measured by the side
  if (!artefact.cones().empty()) {
    refusals.Add(CheckPositive("artefact.cone_half_angle_deg", row.cone_half_angle_deg, 89))
        .Add(CheckPositive("artefact.cone_top_radius_mm", row.cone_top_radius_mm, side))
        .Add(CheckRange("artefact.cone_bottom_radius_mm", row.cone_bottom_radius_mm, 0, row.cone_top_radius_mm,
                        "0 to cone_top_radius_mm"));
  }
  if (!artefact.slots().empty()) {
    refusals.Add(CheckPositive("artefact.slot_width_mm", row.slot_width_mm, side))
        .Add(CheckPositive("artefact.slot_depth_mm", row.slot_depth_mm, side));
  }
  const int feature_count = artefact.cones_size() + artefact.slots_size();
  if (feature_count < 3 || feature_count > kGreatestFeatureCount)
    return refusals
        .Add(Refuse("artefact.cones", std::to_string(feature_count) + " features",
                    "3 to " + std::to_string(kGreatestFeatureCount) + " cones and slots together"))
        .status();
  std::set<std::string> names;
  refusals.Add(ReadFeatures("artefact.cones", "cone", side / 2, artefact.cones(), &names, &row))
      .Add(ReadFeatures("artefact.slots", "slot", side / 2, artefact.slots(), &names, &row));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  return row;
}

absl::StatusOr<storage::PartRow> Validated(const v1::CreatePartRequest& request) {
  const v1::Part& part = request.part();
  storage::PartRow row;
  row.part_id = request.part_id();
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("part_id", row.part_id))
      .Add(ReadCad(request, &row))
      .Add(ReadSolid(part, &row))
      .Add(ReadNominal("part", part, &row))
      .Add(ReadExpansion("part.thermal_expansion", part.has_thermal_expansion(), part.thermal_expansion(),
                         &row.thermal_expansion));

  row.customer_id = part.customer();
  if (!row.customer_id.empty()) refusals.Add(runtime::CheckId("part.customer", row.customer_id));

  int hole_count = 0;  // a group without holes, refused below, counts as one
  for (const v1::HoleGroup& group : part.hole_groups()) hole_count += std::max(1, group.holes_size());
  if (hole_count > kGreatestHoleCount)
    return refusals.Add(Refuse("part.hole_groups", std::to_string(hole_count) + " holes", "at most 20000")).status();
  std::set<std::string> names;
  for (int i = 0; i < part.hole_groups_size(); ++i) {
    const std::string field = "part.hole_groups[" + std::to_string(i) + "]";
    refusals.Add(ReadGroup(field, part.hole_groups(i), &names, &row.hole_groups.emplace_back()));
  }
  if (part.six_points_size() != 0 && part.six_points_size() != 6)
    refusals.Add(Refuse("part.six_points", std::to_string(part.six_points_size()) + " points", "6, or none"));
  std::set<std::string> datums;
  for (int i = 0; i < part.six_points_size(); ++i) {
    const v1::DatumPoint& datum = part.six_points(i);
    const std::string field = "part.six_points[" + std::to_string(i) + "]";
    storage::DatumPointRow& out = row.datum_points.emplace_back();
    out.datum = datum.datum();
    refusals.Add(CheckName(field + ".datum", datum.datum(), &datums))
        .Add(Read(field + ".point_in_part_mm", datum.has_point_in_part_mm(), datum.point_in_part_mm(),
                  &out.point_in_part_mm))
        .Add(Read(field + ".normal_in_part", datum.has_normal_in_part(), datum.normal_in_part(), &out.normal_in_part));
  }
  std::set<std::string> stations;
  for (int i = 0; i < part.stations_size(); ++i)
    refusals.Add(ReadStation("part.stations[" + std::to_string(i) + "]", part.stations(i), &stations,
                             &row.stations.emplace_back()));
  refusals.Add(ReadShapeRegions(part, &row.shape_regions));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  v1::Part described = part;
  described.clear_surface();  // ours to say
  // A process of the release before zones were stated kept no zone of what it took, and the digest of all of it: ours is another.
  // As little did one before customers, solids, stations or shape regions.
  row.content_sha256 = ContentSha256(
      std::move(described), storage::Sha256Hex(request.cad()) + "zone" + (row.customer_id.empty() ? "" : "customer") +
                                (row.solid.empty() ? "" : "solid") + (row.stations.empty() ? "" : "stations") +
                                (row.shape_regions.empty() ? "" : "shape"));
  return row;
}

// That datum points and hole starts lie on the surface itself is not checked here: plants draw them from other models of
// the part, tens of micrometres apart.
absl::Status CheckInsideBox(const storage::PartRow& part) {
  const std::vector<double>& low = part.tessellation.minimum_mm;
  const std::vector<double>& high = part.tessellation.maximum_mm;
  runtime::Refusals refusals;
  const auto check = [&](const std::string& field, const std::vector<double>& point) {
    bool inside = true;
    for (int i = 0; i < 3; ++i)
      inside = inside && point[i] >= low[i] - kBoxMarginMm && point[i] <= high[i] + kBoxMarginMm;
    if (!inside)
      refusals.Add(Refuse(field, TextOf(point), "within 1 mm of the CAD's box " + TextOf(low) + " to " + TextOf(high)));
  };
  for (std::size_t i = 0; i < part.datum_points.size(); ++i) {
    const std::string field = "part.six_points[" + std::to_string(i) + "].point_in_part_mm";
    check(field, part.datum_points[i].point_in_part_mm);
  }
  for (std::size_t g = 0; g < part.hole_groups.size(); ++g) {
    for (std::size_t h = 0; h < part.hole_groups[g].holes.size(); ++h) {
      const std::string field = "part.hole_groups[" + std::to_string(g) + "].holes[" + std::to_string(h) + "]";
      check(field + ".start_in_part_mm", part.hole_groups[g].holes[h].start_in_part_mm);
    }
  }
  return refusals.status();
}

absl::Status CheckStationsApart(const storage::PartRow& part) {
  const Eigen::AlignedBox3d box(Eigen::Map<const Eigen::Vector3d>(part.tessellation.minimum_mm.data()),
                                Eigen::Map<const Eigen::Vector3d>(part.tessellation.maximum_mm.data()));
  runtime::Refusals refusals;
  for (std::size_t i = 0; i < part.stations.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double apart_mm =
          metrology::GreatestDisplacement_mm(box, NominalOf(part.stations[i]), NominalOf(part.stations[k]));
      const double wanted_mm = part.stations[i].capture_mm + part.stations[k].capture_mm;
      if (apart_mm > wanted_mm) continue;
      refusals.Add(Refuse("part.stations[" + std::to_string(i) + "].zero_from_part_nominal",
                          "at most " + Rounded(apart_mm) + " mm from the part's place at " + part.stations[k].station,
                          "more than " + Rounded(wanted_mm) + ", their capture_mm together"));
    }
  return refusals.status();
}

}  // namespace sixpoint::plant
