#include "services/correction/fetch.h"

#include <map>
#include <set>
#include <string>
#include <utility>

#include "metrology/correction/keep_out.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/nc_remaining.h"
#include "services/clients/registered_pose.h"
#include "services/correction/machine_axes.h"
#include "services/correction/messages.h"
#include "services/correction/rows.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

absl::Status NotDivisible(const std::string& correction, const std::string& why) {
  return runtime::Failure(errors::v1::PROGRAM_NOT_DIVISIBLE, correction + ": " + why, {{"resource", correction}});
}

// By their marks: a hole's one, or each of its poses.
struct Holes {
  std::map<std::string, metrology::NcTarget> all, left;
  std::set<std::string> cut;
  int cut_count = 0, left_count = 0;
};

std::map<std::string, metrology::NcTarget> MarksOf(const storage::CorrectionGroupRow& group,
                                                   const storage::CorrectionHoleRow& hole) {
  const std::string before = group.group_name + "/";
  const auto& at = hole.start_mm;
  if (!group.path) return {{before + hole.hole_name, {at[0], at[1], at[2], group.a_deg, group.b_deg}}};
  std::map<std::string, metrology::NcTarget> marks;
  int number = 0;
  for (const storage::CorrectionToolPoseRow& pose : group.path->poses) {
    const auto& [x_mm, y_mm, z_mm] = pose.tip_mm;
    const auto& [a_deg, b_deg] = pose.commanded_deg;
    ++number;
    marks[before + std::to_string(number)] = {x_mm, y_mm, z_mm, a_deg, b_deg, group.group_name, number};
  }
  return marks;
}

Holes HolesOf(const storage::CorrectionRow& correction) {
  Holes holes;
  for (const storage::CorrectionGroupRow& group : correction.groups)
    for (const storage::CorrectionHoleRow& hole : group.holes) {
      ++(hole.reported_cut_at ? holes.cut_count : holes.left_count);
      for (const auto& [mark, target] : MarksOf(group, hole)) {
        holes.all[mark] = target;
        if (hole.reported_cut_at)
          holes.cut.insert(mark);
        else
          holes.left[mark] = target;
      }
    }
  return holes;
}

// As the correction was written with.
absl::StatusOr<metrology::NcFrame> CutFrameOf(const storage::CorrectionRow& correction,
                                              const registration::v1::Registration& registration,
                                              const clients::BladePeers& peers, const runtime::Caller& caller) {
  metrology::NcFrame frame;
  for (const storage::WorkOffsetRow& one : correction.work_offsets) frame.work_offsets[one.code] = one.offset;
  for (const storage::ToolLengthRow& one : correction.tool_lengths) frame.tool_lengths_mm[one.number] = one.length_mm;
  if (correction.machining_model_id.empty()) return frame;
  const auto model = peers.plant.GetMachiningModel(
      runtime::RevisedName("machining_models", correction.machining_model_id, correction.machining_model_revision),
      caller.make_context());
  if (!model.ok()) return model.status();
  if (!model->has_post_processor()) return frame;
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  const auto axes = AxesOf(*machine);
  if (!axes.ok()) return axes.status();
  AddPostProcessor(*model, *axes, &frame);
  return frame;
}

// The ways between what is left are new: they were not looked at when the whole program was judged.
absl::Status CheckWays(const std::vector<metrology::NcMove>& moves, const Holes& holes,
                       const registration::v1::Registration& registration, const metrology::RotaryAxes& axes,
                       const clients::BladePeers& peers, const runtime::Caller& caller) {
  const auto machine =
      peers.plant.GetMachine(registration.machine(), registration.machine_revision(), caller.make_context());
  if (!machine.ok()) return machine.status();
  const double keep_out_mm = LimitsOf(*machine).keep_out_mm;
  if (!(keep_out_mm > 0)) return absl::OkStatus();
  const auto part = peers.plant.GetPart(registration.part(), registration.part_revision(), caller.make_context());
  if (!part.ok()) return part.status();
  const auto surface = peers.plant.GetSurface(*part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  const auto pose = runtime::FromProto("registration.zero_from_part", registration.zero_from_part());
  if (!pose.ok()) return pose.status();
  const auto check =
      metrology::CheckKeepOut(moves, holes.left, {**surface, *pose, axes}, keep_out_mm, caller.keep_going);
  if (!check.ok()) return check.status();
  return check->passed() ? absl::OkStatus() : absl::FailedPreconditionError(metrology::TextOf(*check));
}

absl::Status TakeRemaining(const storage::CorrectionRow& correction, const Holes& holes,
                           const registration::v1::Registration& registration, const clients::BladePeers& peers,
                           const runtime::Caller& caller, storage::ProgramFetchRow* fetch) {
  const std::string name = runtime::NameOf("corrections", correction.correction_id);
  const auto rotation = peers.calibrations.Rotation(runtime::NameOf("calibrations", correction.rotation_calibration_id),
                                                    caller.make_context());
  if (!rotation.ok()) return rotation.status();
  const auto frame = CutFrameOf(correction, registration, peers, caller);
  if (!frame.ok()) return frame.status();
  auto remaining = metrology::LeaveOut(correction.program(), holes.cut,
                                       {correction.axes[0].front(), correction.axes[1].front()}, *frame, holes.all);
  if (!remaining.ok()) return NotDivisible(name, std::string(remaining.status().message()));
  const auto proof = metrology::ProveProgram(remaining->moves, holes.left, rotation->axes);
  if (!proof.ok()) return NotDivisible(name, std::string(proof.status().message()));
  const absl::Status ways = CheckWays(remaining->moves, holes, registration, rotation->axes, peers, caller);
  if (absl::IsFailedPrecondition(ways)) return NotDivisible(name, std::string(ways.message()));
  if (!ways.ok()) return ways;
  fetch->nc_program = std::move(remaining->program);
  fetch->proof = RowOf(*proof);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<registration::v1::Registration> StandingRegistration(const storage::CorrectionRow& correction,
                                                                    const clients::BladePeers& peers,
                                                                    const runtime::Caller& caller) {
  auto registration =
      peers.registrations.Get(runtime::NameOf("registrations", correction.registration_id), caller.make_context());
  if (!registration.ok()) return registration;
  if (absl::Status in_force = CheckCalibrations(peers, *registration, caller); !in_force.ok()) return in_force;
  const auto against = AgainstClamping(peers, *registration, caller);
  if (!against.ok()) return against.status();
  if (against->empty()) return registration;
  const std::string name = runtime::NameOf("corrections", correction.correction_id);
  return runtime::Failure(
      errors::v1::CLAMPING_DIFFERS,
      name + ": " + against->front() + " was made since, want no registration of another blade or clamping",
      {{"resource", name}, {"field", "clamping"}});
}

absl::StatusOr<storage::ProgramFetchRow> FetchOf(const v1::FetchProgramRequest& request,
                                                 const storage::CorrectionRow& correction,
                                                 const registration::v1::Registration& registration,
                                                 const clients::BladePeers& peers, const runtime::Caller& caller) {
  const Holes holes = HolesOf(correction);
  storage::ProgramFetchRow fetch;
  fetch.fetch_id = storage::NewUuid();
  fetch.correction_id = correction.correction_id;
  fetch.hole_count = holes.left_count;
  fetch.cut_count = holes.cut_count;
  fetch.requested_by = caller.requested_by;
  fetch.software_version = runtime::SoftwareVersion();
  if (holes.cut.empty()) {
    if (!correction.proof)
      return NotDivisible(request.name(), "made by a release that proved nothing, want another correction");
    fetch.nc_program = correction.program();
    fetch.proof = *correction.proof;
    return fetch;
  }
  if (absl::Status taken = TakeRemaining(correction, holes, registration, peers, caller, &fetch); !taken.ok())
    return taken;
  return fetch;
}

v1::FetchProgramResponse ResponseOf(const storage::ProgramFetchRow& fetch, const storage::CorrectionRow& correction) {
  v1::FetchProgramResponse response;
  response.set_name(runtime::NameOf("fetches", fetch.fetch_id));
  response.set_correction(runtime::NameOf("corrections", fetch.correction_id));
  response.set_nc_program(fetch.nc_program);
  response.set_program_sha256(fetch.program_sha256);
  SetProof(fetch.proof, response.mutable_proof());
  response.set_hole_count(fetch.hole_count);
  response.set_cut_count(fetch.cut_count);
  runtime::ToProto(correction.usable_until, response.mutable_usable_until());
  return response;
}

}  // namespace sixpoint::correction
