#include "services/correction/correct.h"

#include <array>
#include <map>
#include <utility>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/nc_reader.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

// What the kernel says of a hole's pose that cannot be taken; anything else stays what it is.
absl::Status PoseFailure(const absl::Status& status, const std::string& registration, const std::string& group) {
  const runtime::Metadata about = {{"resource", registration}, {"group", group}};
  const std::string message(status.message());
  if (absl::IsFailedPrecondition(status)) return runtime::Failure(errors::v1::POSE_SINGULAR, message, about);
  if (absl::IsOutOfRange(status)) return runtime::Failure(errors::v1::POSE_OUT_OF_LIMITS, message, about);
  return status;
}

std::map<std::string, metrology::NcTarget> TargetsOf(const std::vector<metrology::CorrectedHoleGroup>& groups) {
  std::map<std::string, metrology::NcTarget> targets;
  for (const metrology::CorrectedHoleGroup& group : groups) {
    for (const metrology::CorrectedHole& hole : group.holes) {
      targets[group.name + "/" + hole.name] = {hole.start_mm.x(), hole.start_mm.y(), hole.start_mm.z(),
                                               group.corrected.a_rad / kRad, group.corrected.b_rad / kRad};
    }
  }
  return targets;
}

// Written, then read back and proven: no program leaves this without.
absl::StatusOr<std::string> ProgramOf(const v1::CorrectRequest& request, const Inputs& inputs, Corrected* corrected) {
  const metrology::RotaryLetters rotary = {inputs.machine_axes.letters[0].front(),
                                           inputs.machine_axes.letters[1].front()};
  const metrology::NcFrame frame = FrameOf(request);
  const std::map<std::string, metrology::NcTarget> targets = TargetsOf(corrected->groups);
  absl::StatusOr<std::string> program = metrology::ReplaceCoordinates(request.nc_template(), targets, rotary, frame);
  if (!program.ok()) return program;
  const auto moves = metrology::ReadNcProgram(*program, rotary, frame);
  if (!moves.ok()) return moves.status();
  const auto proof = metrology::ProveProgram(*moves, targets, inputs.rotation.axes);
  if (!proof.ok()) return proof.status();
  corrected->proof = *proof;
  return program;
}

}  // namespace

metrology::NcFrame FrameOf(const v1::CorrectRequest& request) {
  metrology::NcFrame frame;
  for (const v1::WorkOffset& one : request.work_offsets())
    frame.work_offsets[one.code()] = {one.x_mm(), one.y_mm(), one.z_mm(), one.a_deg(), one.b_deg()};
  return frame;
}

absl::StatusOr<Corrected> CorrectBlade(const v1::CorrectRequest& request, const Inputs& inputs) {
  Corrected corrected;
  for (const metrology::NominalHoleGroup& group : inputs.groups) {
    absl::StatusOr<metrology::CorrectedHoleGroup> moved =
        metrology::CorrectGroup(group, *inputs.pose, inputs.zero_from_part_nominal, inputs.rotation.axes,
                                inputs.machine_axes.nominal, inputs.machine_axes.limits);
    if (!moved.ok()) return PoseFailure(moved.status(), request.registration(), group.name);
    for (std::string& reason : metrology::BeyondEnvelope(*moved, inputs.envelope, inputs.machine_axes.letters))
      corrected.release_reasons.push_back(std::move(reason));
    corrected.groups.push_back(*std::move(moved));
  }
  if (request.nc_template().empty()) return corrected;
  absl::StatusOr<std::string> program = ProgramOf(request, inputs, &corrected);
  if (!program.ok()) return program.status();
  if (corrected.release_reasons.empty()) corrected.nc_program = *std::move(program);
  return corrected;
}

}  // namespace sixpoint::correction
