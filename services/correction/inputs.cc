#include "services/correction/inputs.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "metrology/correction/start_uncertainty.h"
#include "services/clients/registered_pose.h"
#include "services/clients/stations.h"
#include "services/correction/pose_failure.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {
namespace {

// The tables that the registration applied, each still in force: the same that the angles are commanded by.
absl::StatusOr<std::vector<clients::FetchedAxis>> TablesInForce(const clients::BladePeers& peers,
                                                                const registration::v1::Registration& registration,
                                                                const runtime::Caller& caller) {
  auto tables = clients::TablesOf(registration, peers.calibrations, caller.make_context);
  if (!tables.ok()) return tables.status();
  for (const clients::FetchedAxis& table : *tables) {
    const auto in_force = peers.calibrations.AxisInForce(registration.machine(), table.axis, caller.make_context());
    if (!in_force.ok()) return in_force.status();
    const std::string name = in_force->has_value() ? (*in_force)->name : "none in force";
    if (name != table.name)
      return peers.calibrations.NotInForce("registration.angles." + table.axis, table.name, name,
                                           caller.make_context());
  }
  return tables;
}

absl::Status FetchCalibrations(const clients::BladePeers& peers, const runtime::Caller& caller, Inputs* inputs) {
  const registration::v1::Registration& registration = inputs->registration;
  auto sensor = peers.calibrations.Sensor(registration.sensor_calibration(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  if (sensor->withdrawn || sensor->valid_until <= std::chrono::system_clock::now()) {
    const auto in_force = peers.calibrations.SensorInForce(registration.machine(), caller.make_context());
    return peers.calibrations.NotInForce("registration.sensor_calibration", sensor->name,
                                         in_force.ok() ? in_force->name : "none in force", caller.make_context());
  }
  if (absl::Status s = clients::CalibrationClient::CheckNotMoved("registration.sensor_calibration", *sensor,
                                                                 registration.scans_received_at());
      !s.ok())
    return s;
  auto rotation = peers.calibrations.RotationInForce(registration.machine(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  if (rotation->name != registration.rotation_calibration())
    return peers.calibrations.NotInForce("registration.rotation_calibration", registration.rotation_calibration(),
                                         rotation->name, caller.make_context());
  auto tables = TablesInForce(peers, registration, caller);
  if (!tables.ok()) return tables.status();
  inputs->tables = *std::move(tables);
  inputs->sensor = *std::move(sensor);
  inputs->rotation = *std::move(rotation);
  return absl::OkStatus();
}

absl::StatusOr<metrology::NominalHoleGroup> NominalGroup(const plant::v1::HoleGroup& group) {
  metrology::NominalHoleGroup nominal;
  nominal.name = group.group();
  const auto axis = runtime::FromProto("part.hole_groups." + group.group() + ".axis_in_part", group.axis_in_part());
  if (!axis.ok()) return axis.status();
  nominal.axis_in_part = *axis;
  nominal.nominal = {group.a_nominal_deg() * runtime::kRadPerDeg, group.b_nominal_deg() * runtime::kRadPerDeg};
  nominal.position_tolerance_mm = clients::GreatestPositionError_mm(group);
  nominal.inclination_tolerance_rad = group.inclination_tolerance_deg() * runtime::kRadPerDeg;
  for (const plant::v1::Hole& hole : group.holes()) {
    const auto start = runtime::FromProto("part.hole_groups." + group.group() + "." + hole.hole() + ".start_in_part_mm",
                                          hole.start_in_part_mm());
    if (!start.ok()) return start.status();
    nominal.holes.push_back({hole.hole(), *start});
  }
  return nominal;
}

// The groups asked for, all where none are named: in the part's order, or in a machining model's, which is the request's by now.
absl::StatusOr<std::vector<metrology::NominalHoleGroup>> WantedGroups(const v1::CorrectRequest& request,
                                                                      const plant::v1::Part& part, bool has_paths) {
  std::string known;
  std::map<std::string, const plant::v1::HoleGroup*> of_part;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    known += (known.empty() ? "" : ", ") + group.group();
    of_part[group.group()] = &group;
  }
  for (int i = 0; i < request.groups_size(); ++i)
    if (of_part.count(request.groups(i)) == 0)
      return runtime::Refuse("groups[" + std::to_string(i) + "]", request.groups(i),
                             "a hole group of " + part.name() + " (" + known + ")");
  std::vector<const plant::v1::HoleGroup*> asked;
  if (!request.machining_model().empty()) {
    for (const std::string& name : request.groups()) asked.push_back(of_part.at(name));
  } else {
    const std::set<std::string> named(request.groups().begin(), request.groups().end());
    for (const plant::v1::HoleGroup& group : part.hole_groups())
      if (named.empty() || named.count(group.group()) > 0) asked.push_back(&group);
  }
  std::vector<metrology::NominalHoleGroup> wanted;
  for (const plant::v1::HoleGroup* group : asked) {
    absl::StatusOr<metrology::NominalHoleGroup> nominal = NominalGroup(*group);
    if (!nominal.ok()) return nominal.status();
    wanted.push_back(*std::move(nominal));
  }
  if (wanted.empty() && !has_paths)
    return runtime::Failure(errors::v1::PART_WITHOUT_HOLES, part.name() + ".hole_groups: empty, want at least one",
                            {{"resource", part.name()}});
  return wanted;
}

// The machine of then, and the pose as it positions.
absl::Status FetchMachine(const clients::BladePeers& peers, const runtime::Caller& caller, Inputs* inputs) {
  const registration::v1::Registration& registration = inputs->registration;
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  if (inputs->model.has_value())
    if (absl::Status status = CheckModel(*inputs->model, registration.part(), *machine); !status.ok()) return status;
  absl::StatusOr<MachineAxes> axes = AxesOf(*machine);
  if (!axes.ok()) return axes.status();
  inputs->machine_axes = *std::move(axes);
  absl::StatusOr<std::vector<metrology::LinearTravel>> travel =
      TravelOf(*machine, inputs->model.has_value() && inputs->model->has_w_mm() ? std::optional(inputs->model->w_mm())
                                                                                : std::nullopt);
  if (!travel.ok()) return travel.status();
  inputs->travel = *std::move(travel);
  inputs->limits = LimitsOf(*machine);
  inputs->drilling.tool_offset_mm = 1e-3 * machine->error_sources().tool_offset_um();
  inputs->drilling.tool_offset_name += ", " + machine->name();
  if (registration.has_thermal_stretch()) inputs->drilling.stretch = registration.thermal_stretch();
  auto pose =
      clients::RegisteredPoseOf(registration, inputs->sensor.sensor, inputs->rotation, inputs->tables, *machine);
  if (!pose.ok()) return pose.status();
  inputs->pose = *std::move(pose);
  const std::array<std::string, 2>&letters = inputs->machine_axes.letters, &calibrated = inputs->rotation.letters;
  if (letters == calibrated) return absl::OkStatus();
  return runtime::Failure(errors::v1::KINEMATICS_UNSUPPORTED,
                          inputs->rotation.name + ".axes: " + calibrated[0] + ", " + calibrated[1] + ", want " +
                              letters[0] + ", " + letters[1] + " as " + machine->name() +
                              " has them now; calibrate its rotary axes again",
                          {{"resource", machine->name()}});
}

// Before anything else: it says which groups are asked for.
absl::Status FetchAsked(const clients::BladePeers& peers, const v1::CorrectRequest& request,
                        const runtime::Caller& caller, Inputs* inputs) {
  inputs->asked = request;
  auto model = FetchModel(peers.plant, request, caller);
  if (!model.ok() || !model->has_value()) return model.status();
  inputs->model = *std::move(model);
  auto asked = WithModel(request, *inputs->model);
  if (!asked.ok()) return asked.status();
  inputs->asked = *std::move(asked);
  return absl::OkStatus();
}

// The part's nominal angles are of its own nominal pose. At a station that is turned against it they are those nearest to them that turn the
// nominal part's directions alike.
absl::Status TurnToStation(const plant::v1::Part& part, Inputs* inputs) {
  const auto own = runtime::FromProto("part.zero_from_part_nominal", part.zero_from_part_nominal());
  if (!own.ok()) return own.status();
  const Eigen::Matrix3d& turn = inputs->zero_from_part_nominal.linear();
  if (own->linear() == turn) return absl::OkStatus();
  const auto orient = [&](const std::string& group, const Eigen::Vector3d& axis_in_part, double tolerance_rad,
                          metrology::RotaryAngles* nominal) {
    const auto angles = metrology::Orient(inputs->machine_axes.nominal, turn * axis_in_part, *nominal,
                                          inputs->machine_axes.limits, metrology::AllowedTiltOf(tolerance_rad));
    if (angles.ok()) {
      *nominal = *angles;
      return absl::OkStatus();
    }
    const std::string where = "group " + group + ", nominally at station " + inputs->registration.station() + ": ";
    return PoseFailure(absl::Status(angles.status().code(), where + std::string(angles.status().message())),
                       inputs->registration.name(), group);
  };
  for (metrology::NominalHoleGroup& group : inputs->groups)
    if (absl::Status turned = orient(group.name, group.axis_in_part, group.inclination_tolerance_rad, &group.nominal);
        !turned.ok())
      return turned;
  for (ModelPath& path : inputs->paths)
    if (absl::Status turned = orient(path.nominal.name, path.nominal.poses.front().axis_in_part,
                                     path.nominal.inclination_tolerance_rad, &path.nominal.nominal);
        !turned.ok())
      return turned;
  return absl::OkStatus();
}

absl::Status FetchPart(const clients::BladePeers& peers, const runtime::Caller& caller, Inputs* inputs) {
  auto fetched =
      peers.plant.GetPart(inputs->registration.part(), inputs->registration.part_revision(), caller.make_context());
  if (!fetched.ok()) return fetched.status();
  inputs->part = *std::move(fetched);
  const plant::v1::Part& part = inputs->part;
  const auto nominal = clients::NominalPoseAt("registration.station", inputs->registration.station(), part);
  if (!nominal.ok()) return nominal.status();
  inputs->zero_from_part_nominal = *nominal;
  if (inputs->model.has_value()) {
    auto paths = PathsOf(*inputs->model);
    if (!paths.ok()) return paths.status();
    inputs->paths = *std::move(paths);
  }
  auto groups = WantedGroups(inputs->asked, part, !inputs->paths.empty());
  if (!groups.ok()) return groups.status();
  inputs->groups = *std::move(groups);
  if (!inputs->registration.station().empty())
    if (absl::Status turned = TurnToStation(part, inputs); !turned.ok()) return turned;
  if (inputs->model.has_value()) {
    auto electrodes = ElectrodesOf(*inputs->model, part);
    if (!electrodes.ok()) return electrodes.status();
    inputs->electrodes = *std::move(electrodes);
  }
  if (!(inputs->limits.keep_out_mm > 0)) return absl::OkStatus();
  auto surface = peers.plant.GetSurface(part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  inputs->surface = *std::move(surface);
  return absl::OkStatus();
}

// As the registration names them, in force or not.
absl::Status FetchCalibrationsOfThen(const clients::BladePeers& peers, const runtime::Caller& caller, Inputs* inputs) {
  const registration::v1::Registration& registration = inputs->registration;
  auto sensor = peers.calibrations.Sensor(registration.sensor_calibration(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  auto rotation = peers.calibrations.Rotation(registration.rotation_calibration(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  auto tables = clients::TablesOf(registration, peers.calibrations, caller.make_context);
  if (!tables.ok()) return tables.status();
  inputs->sensor = *std::move(sensor);
  inputs->rotation = *std::move(rotation);
  inputs->tables = *std::move(tables);
  return absl::OkStatus();
}

// What the gate asks of the moment at which it judges.
constexpr std::array kOfTheMoment = {
    metrology::GateCheckKind::kRegistrationAge, metrology::GateCheckKind::kClamping,
    metrology::GateCheckKind::kCutBefore,       metrology::GateCheckKind::kInterimCheck,
    metrology::GateCheckKind::kScrapped,        metrology::GateCheckKind::kModelNotNamed};

bool IsOf(metrology::GateCheckKind kind, v1::ReleaseCheckKind of_contract) {
  return v1::ReleaseCheckKind_Name(of_contract) == "RELEASE_CHECK_KIND_" + metrology::NameOf(kind);
}

// A registration of the same machine, or of the same blade, that was made later. What stands on a machine is what was registered there
// last, whatever its clampings are called.
bool SpeaksAgainst(const registration::v1::Registration& later, const registration::v1::Registration& registration) {
  if (later.machine() != registration.machine()) return true;
  const bool is_same_blade = later.blade() == registration.blade();
  const bool is_same_station = later.station() == registration.station();
  // At another station of the fixture another blade stands beside it.
  const bool stands_beside = !is_same_blade && !is_same_station && !later.station().empty() &&
                             !registration.station().empty() && later.part() == registration.part();
  if (!stands_beside && !(is_same_blade && is_same_station)) return true;
  return !later.clamping().empty() && !registration.clamping().empty() && later.clamping() != registration.clamping();
}

}  // namespace

absl::Status CheckCalibrations(const clients::BladePeers& peers, const registration::v1::Registration& registration,
                               const runtime::Caller& caller) {
  Inputs inputs;
  inputs.registration = registration;
  return FetchCalibrations(peers, caller, &inputs);
}

absl::StatusOr<std::vector<std::string>> AgainstClamping(const clients::BladePeers& peers,
                                                         const registration::v1::Registration& registration,
                                                         const runtime::Caller& caller) {
  std::vector<std::string> against;
  for (const bool of_blade : {false, true}) {
    registration::v1::ListRegistrationsRequest request;
    of_blade ? request.set_blade(registration.blade()) : request.set_machine(registration.machine());
    *request.mutable_recorded()->mutable_from() = registration.recorded_at();
    request.set_without_for_inspection(true);  // a verdict may be computed at any time later
    request.set_page_size(200);
    // What stands on the machine is nobody's to hide from it.
    const auto page = peers.registrations.List(request, caller.make_own_context());
    if (!page.ok()) return page.status();
    for (const registration::v1::Registration& later : page->registrations())
      if (later.record_sequence() > registration.record_sequence() && SpeaksAgainst(later, registration))
        against.push_back(later.part() == registration.part() ? later.name() : "a registration of another part");
    // More than a page in the time that a registration holds: nobody knows what they say.
    if (!page->next_page_token().empty()) against.push_back("more registrations than can be looked at");
  }
  return against;
}

bool IsOfTheMoment(v1::ReleaseCheckKind kind) {
  return std::any_of(kOfTheMoment.begin(), kOfTheMoment.end(), [&](auto one) { return IsOf(one, kind); });
}

absl::StatusOr<Inputs> FetchAsRecorded(const clients::BladePeers& peers, const v1::Correction& recorded,
                                       const v1::CorrectRequest& request, const runtime::Caller& caller) {
  Inputs inputs;
  auto registration = peers.registrations.Get(recorded.registration(), caller.make_context());
  if (!registration.ok()) return registration.status();
  inputs.registration = *std::move(registration);
  absl::Status status = clients::CheckConverged(inputs.registration);
  if (status.ok()) status = FetchAsked(peers, request, caller, &inputs);
  if (status.ok()) status = FetchCalibrationsOfThen(peers, caller, &inputs);
  if (status.ok()) status = FetchMachine(peers, caller, &inputs);
  if (status.ok()) status = FetchPart(peers, caller, &inputs);
  if (!status.ok()) return status;
  inputs.now = runtime::MomentOf(recorded.recorded_at());
  for (const v1::ReleaseCheck& check : recorded.checks())
    for (const metrology::GateCheckKind kind : kOfTheMoment)
      if (IsOf(kind, check.kind())) {
        metrology::GateCheck& of_then = inputs.checks_of_then.emplace_back();
        of_then.kind = kind;
        of_then.subject = check.subject();
        if (check.has_value()) of_then.value = check.value();
        of_then.limit = check.limit();
        of_then.failed_count = check.failed_count();
      }
  return inputs;
}

absl::StatusOr<Inputs> FetchInputs(const clients::BladePeers& peers, const v1::CorrectRequest& request,
                                   const runtime::Caller& caller) {
  Inputs inputs;
  absl::StatusOr<registration::v1::Registration> registration =
      peers.registrations.Get(request.registration(), caller.make_context());
  if (!registration.ok()) return registration.status();
  inputs.registration = *std::move(registration);
  absl::Status status = clients::CheckConverged(inputs.registration);
  if (status.ok()) status = FetchAsked(peers, request, caller, &inputs);
  if (status.ok()) status = FetchCalibrations(peers, caller, &inputs);
  if (status.ok()) status = FetchMachine(peers, caller, &inputs);
  if (status.ok()) status = FetchPart(peers, caller, &inputs);
  if (!status.ok()) return status;
  // A template that was copied out of a model would have its electrodes looked at by nobody.
  if (!inputs.model.has_value() && !request.nc_template().empty()) {
    const auto model = peers.plant.FirstMachiningModelOf(inputs.registration.part(), caller.make_context());
    if (!model.ok()) return model.status();
    if (!model->empty()) inputs.models_not_named.push_back(*model);
  }
  auto against = AgainstClamping(peers, inputs.registration, caller);
  if (!against.ok()) return against.status();
  inputs.against_clamping = *std::move(against);
  if (inputs.limits.interim_check_mm > 0) {
    const auto checked =
        peers.calibrations.CheckedInClamping(inputs.sensor.name, inputs.registration.clamping(),
                                             1e3 * inputs.limits.interim_check_mm, caller.make_own_context());
    if (!checked.ok()) return checked.status();
    inputs.checked_in_clamping = *checked;
  }
  inputs.now = std::chrono::system_clock::now();
  return inputs;
}

}  // namespace sixpoint::correction
