#include "services/correction/correct_blade.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "metrology/correction/correct.h"
#include "metrology/correction/nc_program.h"
#include "services/correction/machine_axes.h"
#include "services/correction/registered_pose.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::correction {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

struct Inputs {
  registration::v1::Registration registration;
  clients::FetchedSensorCalibration sensor;
  clients::FetchedRotationCalibration rotation;
  std::vector<clients::FetchedAxis> tables;  // that the registration applied
  plant::v1::Machine machine;
  plant::v1::Part part;
};

// The tables that the registration applied, each still in force: the same that the angles are commanded by.
absl::StatusOr<std::vector<clients::FetchedAxis>> TablesInForce(const Peers& peers,
                                                                const registration::v1::Registration& registration,
                                                                const ContextFactory& context) {
  auto tables = clients::TablesOf(registration, peers.calibrations, context);
  if (!tables.ok()) return tables.status();
  for (const clients::FetchedAxis& table : *tables) {
    const auto in_force = peers.calibrations.AxisInForce(registration.machine(), table.axis, context());
    if (!in_force.ok()) return in_force.status();
    const std::string name = in_force->has_value() ? (*in_force)->name : "none in force";
    if (name != table.name)
      return peers.calibrations.NotInForce("registration.angles." + table.axis, table.name, name, context());
  }
  return tables;
}

absl::StatusOr<Inputs> FetchInputs(const Peers& peers, const std::string& name, const ContextFactory& context) {
  Inputs inputs;
  registration::v1::GetRegistrationRequest get;
  get.set_name(name);
  const grpc::Status got = peers.registration->GetRegistration(context().get(), get, &inputs.registration);
  if (!got.ok()) return runtime::FromGrpc(got);
  const registration::v1::Registration& registration = inputs.registration;
  if (absl::Status status = clients::CheckConverged(registration); !status.ok()) return status;

  auto sensor = peers.calibrations.SensorInForce(registration.machine(), context());
  if (!sensor.ok()) return sensor.status();
  if (sensor->name != registration.sensor_calibration())
    return peers.calibrations.NotInForce("registration.sensor_calibration", registration.sensor_calibration(),
                                         sensor->name, context());
  auto rotation = peers.calibrations.RotationInForce(registration.machine(), context());
  if (!rotation.ok()) return rotation.status();
  if (rotation->name != registration.rotation_calibration())
    return peers.calibrations.NotInForce("registration.rotation_calibration", registration.rotation_calibration(),
                                         rotation->name, context());
  auto tables = TablesInForce(peers, registration, context);
  if (!tables.ok()) return tables.status();
  inputs.tables = *std::move(tables);
  inputs.sensor = *std::move(sensor);
  inputs.rotation = *std::move(rotation);

  auto machine = peers.plant.GetMachine(registration.machine(), registration.machine_revision(), context());
  if (!machine.ok()) return machine.status();
  auto part = peers.plant.GetPart(registration.part(), registration.part_revision(), context());
  if (!part.ok()) return part.status();
  inputs.machine = *std::move(machine);
  inputs.part = *std::move(part);
  return inputs;
}

absl::StatusOr<metrology::NominalHoleGroup> NominalGroup(const plant::v1::HoleGroup& group) {
  metrology::NominalHoleGroup nominal;
  nominal.name = group.group();
  const auto axis = runtime::FromProto("part.hole_groups." + group.group() + ".axis_in_part", group.axis_in_part());
  if (!axis.ok()) return axis.status();
  nominal.axis_in_part = *axis;
  nominal.nominal = {group.a_nominal_deg() * kRad, group.b_nominal_deg() * kRad};
  for (const plant::v1::Hole& hole : group.holes()) {
    const auto start = runtime::FromProto("part.hole_groups." + group.group() + "." + hole.hole() + ".start_in_part_mm",
                                          hole.start_in_part_mm());
    if (!start.ok()) return start.status();
    nominal.holes.push_back({hole.hole(), *start});
  }
  return nominal;
}

// The groups asked for, in the part's order; all where none are named.
absl::StatusOr<std::vector<metrology::NominalHoleGroup>> WantedGroups(const v1::CorrectRequest& request,
                                                                      const plant::v1::Part& part) {
  std::string known;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) known += (known.empty() ? "" : ", ") + group.group();
  for (int i = 0; i < request.groups_size(); ++i) {
    const auto& groups = part.hole_groups();
    const bool found = std::any_of(groups.begin(), groups.end(), [&](const plant::v1::HoleGroup& group) {
      return group.group() == request.groups(i);
    });
    if (!found) {
      return runtime::Refuse("groups[" + std::to_string(i) + "]", request.groups(i),
                             "a hole group of " + part.name() + " (" + known + ")");
    }
  }
  std::vector<metrology::NominalHoleGroup> wanted;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    const bool asked =
        std::find(request.groups().begin(), request.groups().end(), group.group()) != request.groups().end();
    if (request.groups_size() > 0 && !asked) continue;
    absl::StatusOr<metrology::NominalHoleGroup> nominal = NominalGroup(group);
    if (!nominal.ok()) return nominal.status();
    wanted.push_back(*std::move(nominal));
  }
  if (wanted.empty()) {
    return runtime::Failure(errors::v1::PART_WITHOUT_HOLES, part.name() + ".hole_groups: empty, want at least one",
                            {{"resource", part.name()}});
  }
  return wanted;
}

// What the kernel says of a hole's pose that cannot be taken; anything else stays what it is.
absl::Status PoseFailure(const absl::Status& status, const std::string& registration, const std::string& group) {
  const runtime::Metadata about = {{"resource", registration}, {"group", group}};
  const std::string message(status.message());
  if (absl::IsFailedPrecondition(status)) return runtime::Failure(errors::v1::POSE_SINGULAR, message, about);
  if (absl::IsOutOfRange(status)) return runtime::Failure(errors::v1::POSE_OUT_OF_LIMITS, message, about);
  return status;
}

storage::CorrectionGroupRow RowOf(const metrology::CorrectedHoleGroup& group, bool tables_applied) {
  storage::CorrectionGroupRow row;
  row.group_name = group.name;
  row.a_deg = group.corrected.a_rad / kRad;
  row.b_deg = group.corrected.b_rad / kRad;
  row.a_nominal_deg = group.nominal.a_rad / kRad;
  row.b_nominal_deg = group.nominal.b_rad / kRad;
  row.a_ideal_deg = group.ideal.a_rad / kRad;
  row.b_ideal_deg = group.ideal.b_rad / kRad;
  row.a_standard_uncertainty_deg = group.a_standard_uncertainty_rad / kRad;
  row.b_standard_uncertainty_deg = group.b_standard_uncertainty_rad / kRad;
  if (tables_applied) row.reached_deg = {group.reached.a_rad / kRad, group.reached.b_rad / kRad};
  for (const metrology::CorrectedHole& hole : group.holes) {
    storage::CorrectionHoleRow& hole_row = row.holes.emplace_back();
    hole_row.hole_name = hole.name;
    for (int i = 0; i < 3; ++i) {
      hole_row.start_mm[static_cast<std::size_t>(i)] = hole.start_mm[i];
      hole_row.nominal_start_mm[static_cast<std::size_t>(i)] = hole.nominal_start_mm[i];
    }
    hole_row.expanded_uncertainty_um = hole.expanded_uncertainty_um;
  }
  return row;
}

absl::StatusOr<std::string> ProgramOf(const std::string& nc_template,
                                      const std::vector<metrology::CorrectedHoleGroup>& groups,
                                      const std::array<std::string, 2>& axes) {
  std::map<std::string, metrology::NcTarget> targets;
  for (const metrology::CorrectedHoleGroup& group : groups) {
    for (const metrology::CorrectedHole& hole : group.holes) {
      targets[group.name + "/" + hole.name] = {hole.start_mm.x(), hole.start_mm.y(), hole.start_mm.z(),
                                               group.corrected.a_rad / kRad, group.corrected.b_rad / kRad};
    }
  }
  return metrology::ReplaceCoordinates(nc_template, targets, {axes[0].front(), axes[1].front()});
}

std::string SummaryOf(const storage::CorrectionRow& row, const std::vector<metrology::CorrectedHoleGroup>& groups) {
  double greatest_shift_mm = 0, greatest_uncertainty_um = 0;
  int holes = 0;
  for (const metrology::CorrectedHoleGroup& group : groups) {
    for (const metrology::CorrectedHole& hole : group.holes) {
      greatest_shift_mm = std::max(greatest_shift_mm, (hole.start_mm - hole.nominal_start_mm).norm());
      greatest_uncertainty_um = std::max(greatest_uncertainty_um, hole.expanded_uncertainty_um);
      ++holes;
    }
  }
  return nlohmann::json{{"group_count", groups.size()},
                        {"hole_count", holes},
                        {"release", row.release},
                        {"greatest_shift_mm", greatest_shift_mm},
                        {"greatest_expanded_uncertainty_um", greatest_uncertainty_um}}
      .dump();
}

storage::RecordEntry EntryOf(const storage::CorrectionRow& row, const Inputs& inputs) {
  storage::RecordEntry entry;
  entry.kind = "correction";
  entry.name = runtime::NameOf("corrections", row.correction_id);
  entry.inputs = {
      inputs.registration.name(), inputs.registration.machine() + "@" + std::to_string(row.machine_revision),
      inputs.registration.part() + "@" + std::to_string(row.part_revision), inputs.sensor.name, inputs.rotation.name};
  for (const clients::FetchedAxis& table : inputs.tables) entry.inputs.push_back(table.name);
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = registration::v1::Method_Name(inputs.registration.method());
  entry.software_version = row.software_version;
  entry.requested_by = row.requested_by;
  return entry;
}

absl::StatusOr<storage::CorrectionRow> RowFor(const v1::CorrectRequest& request, const Inputs& inputs) {
  const registration::v1::Registration& registration = inputs.registration;
  storage::CorrectionRow row;
  row.correction_id = storage::NewUuid();
  for (const auto& [field, collection, name, id] :
       {std::tuple{"registration.blade", "blades", &registration.blade(), &row.blade_serial},
        std::tuple{"registration.name", "registrations", &registration.name(), &row.registration_id},
        std::tuple{"registration.machine", "machines", &registration.machine(), &row.machine_id},
        std::tuple{"registration.part", "parts", &registration.part(), &row.part_id},
        std::tuple{"sensor_calibration.name", "calibrations", &inputs.sensor.name, &row.sensor_calibration_id},
        std::tuple{"rotation_calibration.name", "calibrations", &inputs.rotation.name, &row.rotation_calibration_id}}) {
    const absl::StatusOr<std::string> found = runtime::IdOf(field, collection, *name);
    if (!found.ok()) return found.status();
    *id = *found;
  }
  row.machine_revision = registration.machine_revision();
  row.part_revision = registration.part_revision();
  row.valid_until = std::min(inputs.sensor.valid_until, inputs.rotation.valid_until);
  for (const clients::FetchedAxis& table : inputs.tables) {
    row.valid_until = std::min(row.valid_until, table.valid_until);
    row.characterisation_ids.push_back(table.name.substr(table.name.find('/') + 1));
  }
  row.axes = {inputs.rotation.letters.begin(), inputs.rotation.letters.end()};
  row.requested_by = request.requested_by();
  row.software_version = runtime::SoftwareVersion();
  return row;
}

}  // namespace

absl::StatusOr<MadeCorrection> CorrectBlade(const Peers& peers, const v1::CorrectRequest& request,
                                            const ContextFactory& context) {
  const absl::StatusOr<Inputs> inputs = FetchInputs(peers, request.registration(), context);
  if (!inputs.ok()) return inputs.status();
  const auto pose =
      clients::RegisteredPoseOf(inputs->registration, inputs->sensor.sensor, inputs->rotation, inputs->tables);
  if (!pose.ok()) return pose.status();
  const absl::StatusOr<MachineAxes> machine_axes = AxesOf(inputs->machine);
  if (!machine_axes.ok()) return machine_axes.status();
  if (machine_axes->letters != inputs->rotation.letters)
    return runtime::Failure(errors::v1::KINEMATICS_UNSUPPORTED,
                            inputs->rotation.name + ".axes: " + inputs->rotation.letters[0] + ", " +
                                inputs->rotation.letters[1] + ", want " + machine_axes->letters[0] + ", " +
                                machine_axes->letters[1] + " as " + inputs->machine.name() +
                                " has them now; calibrate its rotary axes again",
                            {{"resource", inputs->machine.name()}});
  const auto nominal_pose = runtime::FromProto("part.zero_from_part_nominal", inputs->part.zero_from_part_nominal());
  if (!nominal_pose.ok()) return nominal_pose.status();
  const auto wanted = WantedGroups(request, inputs->part);
  if (!wanted.ok()) return wanted.status();
  absl::StatusOr<storage::CorrectionRow> row = RowFor(request, *inputs);
  if (!row.ok()) return row.status();

  const metrology::SafetyEnvelope envelope = EnvelopeOf(inputs->machine);
  row->envelope_translation_mm = envelope.translation_mm;
  row->envelope_rotation_deg = envelope.rotation_rad / kRad;
  std::vector<metrology::CorrectedHoleGroup> groups;
  for (const metrology::NominalHoleGroup& group : *wanted) {
    absl::StatusOr<metrology::CorrectedHoleGroup> corrected = metrology::CorrectGroup(
        group, *pose, *nominal_pose, inputs->rotation.axes, machine_axes->nominal, machine_axes->limits);
    if (!corrected.ok()) return PoseFailure(corrected.status(), request.registration(), group.name);
    for (std::string& reason : metrology::BeyondEnvelope(*corrected, envelope, machine_axes->letters))
      row->release_reasons.push_back(std::move(reason));
    row->groups.push_back(RowOf(*corrected, pose->positioning.Applies()));
    groups.push_back(*std::move(corrected));
  }
  row->release = row->release_reasons.empty() ? "AUTOMATIC" : "AWAITING_PERSON";

  MadeCorrection made;
  if (!request.nc_template().empty()) {
    // A bad template is refused whether or not its program may be given now.
    absl::StatusOr<std::string> program = ProgramOf(request.nc_template(), groups, machine_axes->letters);
    if (!program.ok()) return program.status();
    if (row->release_reasons.empty()) made.nc_program = *std::move(program);
  }
  made.entry = EntryOf(*row, *inputs);
  made.entry.summary_json = SummaryOf(*row, groups);
  made.row = *std::move(row);
  return made;
}

}  // namespace sixpoint::correction
