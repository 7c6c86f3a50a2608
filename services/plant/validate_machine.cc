#include <set>
#include <utility>

#include "services/plant/checks.h"
#include "services/plant/validate.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

absl::StatusOr<storage::JointRow> ValidatedJoint(const std::string& field, const std::string& side,
                                                 const v1::Joint& joint, std::set<std::string>* axes) {
  storage::JointRow row;
  row.side = side;
  row.axis = joint.axis();
  const std::string known = "XYZABCW";
  if (row.axis.size() != 1 || known.find(row.axis) == std::string::npos)
    return Refuse(field + ".axis", row.axis, "X, Y, Z, A, B, C or W");
  if (!axes->insert(row.axis).second) return Refuse(field + ".axis", row.axis, "an axis that no other joint has");
  if (joint.kind() != v1::JOINT_KIND_LINEAR && joint.kind() != v1::JOINT_KIND_ROTARY)
    return Refuse(field + ".kind", v1::JointKind_Name(joint.kind()), "JOINT_KIND_LINEAR or JOINT_KIND_ROTARY");
  const bool rotary = joint.kind() == v1::JOINT_KIND_ROTARY;
  row.kind = rotary ? "rotary" : "linear";
  if (row.axis == "W" && (rotary || side != "tool"))
    return Refuse(field + ".axis", "W, " + row.kind + ", on the side of the " + side, "W linear, on the tool's side");
  absl::Status status = Read(field + ".direction", joint.has_direction(), joint.direction(), &row.direction);
  if (!status.ok()) return status;
  if (rotary || joint.has_point_mm()) {
    status = Read(field + ".point_mm", joint.has_point_mm(), joint.point_mm(), &row.point_mm.emplace());
    if (!status.ok()) return status;
  }
  row.sign = joint.sign();
  row.minimum = joint.minimum();
  row.maximum = joint.maximum();
  if (row.sign != 1 && row.sign != -1) return Refuse(field + ".sign", row.sign, "1 or -1");
  status = CheckRange(field + ".minimum", row.minimum, -1e6, 1e6, "a finite limit");
  if (!status.ok()) return status;
  if (!(row.maximum > row.minimum && row.maximum <= 1e6))
    return Refuse(field + ".maximum", row.maximum, "finite and > minimum " + NumberText(row.minimum));
  if (!joint.has_positioning_standard_uncertainty_deg()) return row;
  const std::string figure = field + ".positioning_standard_uncertainty_deg";
  row.positioning_standard_uncertainty_deg = joint.positioning_standard_uncertainty_deg();
  if (!rotary) return Refuse(figure, *row.positioning_standard_uncertainty_deg, "none: a linear joint has no angle");
  if (status = CheckPositive(figure, *row.positioning_standard_uncertainty_deg, 10); !status.ok()) return status;
  return row;
}

absl::Status ReadSensor(const v1::Sensor& sensor, storage::MachineRow* row) {
  const std::string field = "machine.sensor";
  row->sensor_model = sensor.model();
  row->sensor_noise_um = sensor.noise_um();
  row->sensor_column_count = sensor.column_count();
  row->sensor_mid_range_mm = sensor.mid_range_mm();
  row->sensor_range_mm = sensor.range_mm();
  row->sensor_line_angle_deg = sensor.line_angle_deg();
  row->sensor_serial_number = sensor.serial_number();
  runtime::Refusals refusals;
  if (!(row->sensor_line_angle_deg > 0 && row->sensor_line_angle_deg < 180))
    refusals.Add(Refuse(field + ".line_angle_deg", row->sensor_line_angle_deg, "> 0 and < 180"));
  if (sensor.kind() == v1::SENSOR_KIND_LINE || sensor.kind() == v1::SENSOR_KIND_SNAPSHOT)
    row->sensor_kind = v1::SensorKind_Name(sensor.kind()).substr(std::string("SENSOR_KIND_").size());
  else if (sensor.kind() != v1::SENSOR_KIND_UNSPECIFIED)
    refusals.Add(Refuse(field + ".kind", std::to_string(sensor.kind()), "LINE, SNAPSHOT or none"));
  if (sensor.kind() != v1::SENSOR_KIND_SNAPSHOT)
    refusals.Add(CheckPositive(field + ".column_count", row->sensor_column_count, 1'000'000));
  else if (row->sensor_column_count != 0)
    refusals.Add(Refuse(field + ".column_count", row->sensor_column_count, "0: a snapshot sensor has no columns"));
  return refusals.Add(CheckPositive(field + ".noise_um", row->sensor_noise_um, 10'000))
      .Add(CheckPositive(field + ".mid_range_mm", row->sensor_mid_range_mm, 10'000))
      .Add(CheckPositive(field + ".range_mm", row->sensor_range_mm, 10'000))
      .status();
}

// What is not stated is as the contract says.
absl::Status ReadEnvelope(const v1::SafetyEnvelope& in, storage::MachineRow* row) {
  row->safety_translation_mm = in.has_translation_mm() ? in.translation_mm() : 2;
  row->safety_rotation_deg = in.has_rotation_deg() ? in.rotation_deg() : 3;
  row->safety_uncertainty_share = in.has_uncertainty_share() ? in.uncertainty_share() : 1.0 / 3;
  row->safety_registration_age_h = in.has_registration_age_h() ? in.registration_age_h() : 8;
  row->safety_keep_out_mm = in.has_keep_out_mm() ? in.keep_out_mm() : 0.5;
  if (in.has_interim_check_limit_um()) row->interim_check_limit_um = in.interim_check_limit_um();
  const std::string field = "machine.safety_envelope.";
  runtime::Refusals refusals;
  if (row->interim_check_limit_um)
    refusals.Add(CheckPositive(field + "interim_check_limit_um", *row->interim_check_limit_um, 1000));
  return refusals.Add(CheckRange(field + "translation_mm", row->safety_translation_mm, 0, 1e5, "0 to 100000"))
      .Add(CheckRange(field + "rotation_deg", row->safety_rotation_deg, 0, 180, "0 to 180"))
      .Add(CheckRange(field + "uncertainty_share", row->safety_uncertainty_share, 0, 1, "0 to 1"))
      .Add(CheckRange(field + "registration_age_h", row->safety_registration_age_h, 0, 8760, "0 to 8760"))
      .Add(CheckRange(field + "keep_out_mm", row->safety_keep_out_mm, 0, 100, "0 to 100"))
      .status();
}

// A figure that is given; what is not given stays none.
absl::Status ReadFigure(const std::string& field, bool given, double value, double greatest,
                        std::optional<double>* row) {
  if (!given) return absl::OkStatus();
  *row = value;
  return CheckPositive("machine.error_sources." + field, value, greatest);
}

absl::Status ReadErrorSources(const v1::ErrorSources& in, storage::MachineRow* row) {
  constexpr double kMostUm = 1000, kMostUmPerM = 10'000;
  runtime::Refusals refusals;
  if (in.approach() == v1::APPROACH_UPWARDS || in.approach() == v1::APPROACH_DOWNWARDS)
    row->approach = v1::Approach_Name(in.approach()).substr(std::string("APPROACH_").size());
  else if (in.approach() != v1::APPROACH_UNSPECIFIED)
    refusals.Add(Refuse("machine.error_sources.approach", std::to_string(in.approach()), "UPWARDS, DOWNWARDS or none"));
  const auto read = [&](const char* field, bool given, double value, double greatest, std::optional<double>* to) {
    refusals.Add(ReadFigure(field, given, value, greatest, to));
  };
  read("touch_offset_um", in.has_touch_offset_um(), in.touch_offset_um(), kMostUm, &row->touch_offset_um);
  read("scanner_field_um", in.has_scanner_field_um(), in.scanner_field_um(), kMostUm, &row->scanner_field_um);
  read("tool_offset_um", in.has_tool_offset_um(), in.tool_offset_um(), kMostUm, &row->tool_offset_um);
  read("linear_scale_um_per_m", in.has_linear_scale_um_per_m(), in.linear_scale_um_per_m(), kMostUmPerM,
       &row->linear_scale_um_per_m);
  read("squareness_um_per_m", in.has_squareness_um_per_m(), in.squareness_um_per_m(), kMostUmPerM,
       &row->squareness_um_per_m);
  read("temperature_k", in.has_temperature_k(), in.temperature_k(), 10, &row->temperature_k);
  read("temperature_half_range_k", in.has_temperature_half_range_k(), in.temperature_half_range_k(), 30,
       &row->temperature_half_range_k);
  read("encoder_latency_um", in.has_encoder_latency_um(), in.encoder_latency_um(), kMostUm, &row->encoder_latency_um);
  return refusals
      .Add(ReadExpansion("machine.error_sources.scale_expansion", in.has_scale_expansion(), in.scale_expansion(),
                         &row->scale_expansion))
      .status();
}

// A program would wait for ever for a check that there is none of.
absl::Status CheckCanBeChecked(const v1::Machine& machine) {
  if (machine.sensor().kind() != v1::SENSOR_KIND_SNAPSHOT || !machine.safety_envelope().has_interim_check_limit_um())
    return absl::OkStatus();
  return Refuse("machine.safety_envelope.interim_check_limit_um", machine.safety_envelope().interim_check_limit_um(),
                "none: interim checks are of line scanners");
}

absl::Status ReadTouchProbe(bool given, const v1::TouchProbe& in, storage::MachineRow* row) {
  if (!given) return absl::OkStatus();
  row->touch_probe_serial_number = in.serial_number();
  runtime::Refusals refusals;
  if (in.serial_number().empty()) refusals.Add(Refuse("machine.touch_probe.serial_number", "", "what is engraved"));
  return refusals
      .Add(ReadCertificate("machine.touch_probe.certificate", in.has_certificate(), in.certificate(),
                           &row->touch_probe_certificate))
      .status();
}

}  // namespace

absl::StatusOr<storage::MachineRow> Validated(const v1::CreateMachineRequest& request) {
  const v1::Machine& machine = request.machine();
  storage::MachineRow row;
  row.machine_id = request.machine_id();
  row.content_sha256 = ContentSha256(machine);
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("machine_id", row.machine_id))
      .Add(ReadSensor(machine.sensor(), &row))
      .Add(Read("machine.nominal_centre_mm", machine.has_nominal_centre_mm(), machine.nominal_centre_mm(),
                &row.nominal_centre_mm))
      .Add(ReadEnvelope(machine.safety_envelope(), &row))
      .Add(CheckCanBeChecked(machine))
      .Add(ReadErrorSources(machine.error_sources(), &row))
      .Add(ReadTouchProbe(machine.has_touch_probe(), machine.touch_probe(), &row));
  std::set<std::string> axes;
  for (const auto& [side, joints] :
       {std::pair{"part", &machine.kinematics().part_side()}, std::pair{"tool", &machine.kinematics().tool_side()}}) {
    const std::string side_field = std::string("machine.kinematics.") + side + "_side";
    for (int i = 0; i < joints->size(); ++i) {
      const std::string field = side_field + "[" + std::to_string(i) + "]";
      absl::StatusOr<storage::JointRow> joint = ValidatedJoint(field, side, (*joints)[i], &axes);
      refusals.Add(joint.status());
      if (joint.ok()) row.joints.push_back(*std::move(joint));
    }
  }
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  return row;
}

}  // namespace sixpoint::plant
