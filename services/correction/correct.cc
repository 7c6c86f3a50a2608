#include "services/correction/correct.h"

#include <algorithm>
#include <utility>

#include "metrology/correction/nc_program.h"
#include "metrology/correction/nc_proof.h"
#include "metrology/correction/nc_reader.h"
#include "services/correction/gate.h"
#include "services/correction/pose_failure.h"
#include "services/runtime/errors.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {
namespace {

// Where a program has to take each hole, by "group/hole", and the tool along each path, by "path/number".
std::map<std::string, metrology::NcTarget> TargetsOf(const Corrected& corrected) {
  std::map<std::string, metrology::NcTarget> targets;
  for (const CorrectedPath& path : corrected.paths) AddTargets(path.path, &targets);
  for (const metrology::CorrectedHoleGroup& group : corrected.groups) {
    for (const metrology::CorrectedHole& hole : group.holes) {
      targets[group.name + "/" + hole.name] = {hole.start_mm.x(), hole.start_mm.y(), hole.start_mm.z(),
                                               group.corrected.a_rad / runtime::kRadPerDeg,
                                               group.corrected.b_rad / runtime::kRadPerDeg};
    }
  }
  return targets;
}

// Written, then read back and proven: no program leaves this without.
absl::StatusOr<ReadProgram> MakeProgram(const Inputs& inputs, Corrected* corrected) {
  const v1::CorrectRequest& request = inputs.asked;
  const metrology::RotaryLetters rotary = {inputs.machine_axes.letters[0].front(),
                                           inputs.machine_axes.letters[1].front()};
  metrology::NcFrame frame = FrameOf(request);
  if (inputs.model.has_value()) AddPostProcessor(*inputs.model, inputs.machine_axes, &frame);
  ReadProgram read;
  read.targets = TargetsOf(*corrected);
  absl::StatusOr<std::string> program =
      metrology::ReplaceCoordinates(request.nc_template(), read.targets, rotary, frame);
  if (!program.ok()) return program.status();
  auto moves = metrology::ReadNcProgram(*program, rotary, frame);
  if (!moves.ok()) return moves.status();
  const auto proof = metrology::ProveProgram(*moves, read.targets, inputs.rotation.axes);
  if (!proof.ok()) return proof.status();
  corrected->proof = *proof;
  corrected->nc_program = *std::move(program);
  read.moves = *std::move(moves);
  for (const auto& [number, length_mm] : frame.tool_lengths_mm) {
    const bool first = number == frame.tool_lengths_mm.begin()->first;
    read.tip_below_mm = {first ? length_mm : std::min(read.tip_below_mm[0], length_mm),
                         std::max(read.tip_below_mm[1], length_mm)};
  }
  return read;
}

}  // namespace

metrology::NcFrame FrameOf(const v1::CorrectRequest& request) {
  metrology::NcFrame frame;
  for (const v1::WorkOffset& one : request.work_offsets())
    frame.work_offsets[one.code()] = {one.x_mm(), one.y_mm(), one.z_mm(), one.a_deg(), one.b_deg()};
  for (const v1::ToolLength& tool : request.tool_lengths()) frame.tool_lengths_mm[tool.number()] = tool.length_mm();
  return frame;
}

absl::StatusOr<Corrected> CorrectBlade(const Inputs& inputs, const std::function<bool()>& keep_going) {
  Corrected corrected;
  for (const metrology::NominalHoleGroup& group : inputs.groups) {
    absl::StatusOr<metrology::CorrectedHoleGroup> moved =
        metrology::CorrectGroup(group, *inputs.pose, inputs.zero_from_part_nominal, inputs.rotation.axes,
                                inputs.machine_axes.nominal, inputs.machine_axes.limits, inputs.drilling);
    if (!moved.ok()) return PoseFailure(moved.status(), inputs.asked.registration(), group.name);
    corrected.groups.push_back(*std::move(moved));
  }
  for (const ModelPath& path : inputs.paths) {
    absl::StatusOr<CorrectedPath> moved = CorrectPath(inputs, path, keep_going);
    if (!moved.ok()) return PoseFailure(moved.status(), inputs.asked.registration(), path.nominal.name);
    corrected.paths.push_back(*std::move(moved));
  }
  ReadProgram program;
  if (!inputs.asked.nc_template().empty()) {
    absl::StatusOr<ReadProgram> made = MakeProgram(inputs, &corrected);
    if (!made.ok()) return made.status();
    program = *std::move(made);
  }
  absl::StatusOr<std::vector<metrology::GateCheck>> checks = Judge(inputs, corrected, program, keep_going);
  if (!checks.ok()) return checks.status();
  corrected.checks = *std::move(checks);
  corrected.released = std::all_of(corrected.checks.begin(), corrected.checks.end(),
                                   [](const metrology::GateCheck& check) { return check.passed(); });
  return corrected;
}

}  // namespace sixpoint::correction
