#include "services/correction/correct.h"

#include <array>
#include <map>
#include <utility>

#include "metrology/correction/nc_program.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

absl::Status PoseFailure(const absl::Status& status) {
  if (status.code() == absl::StatusCode::kInvalidArgument) return status;
  const bool singular = status.code() == absl::StatusCode::kFailedPrecondition;
  return runtime::Failure(absl::StatusCode::kFailedPrecondition, singular ? "POSE_SINGULAR" : "POSE_OUT_OF_LIMITS",
                          std::string(status.message()));
}

// The kernel's message is "nc_template line 3: value, want wanted"; the refusal names the field.
absl::Status TemplateRefusal(const absl::Status& status) {
  std::string message(status.message());
  const std::string prefix = "nc_template", want = ", want ";
  if (message.rfind(prefix, 0) == 0) message.erase(0, prefix.size() + 1);
  const std::size_t at = message.rfind(want);
  if (at == std::string::npos) return status;
  return runtime::Refuse("nc_template", message.substr(0, at), message.substr(at + want.size()));
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
  absl::StatusOr<std::string> program =
      metrology::ReplaceCoordinates(nc_template, targets, {axes[0].front(), axes[1].front()});
  if (!program.ok()) return TemplateRefusal(program.status());
  return program;
}

}  // namespace

absl::StatusOr<Corrected> CorrectBlade(const v1::CorrectRequest& request, const Inputs& inputs) {
  Corrected corrected;
  for (const metrology::NominalHoleGroup& group : inputs.groups) {
    absl::StatusOr<metrology::CorrectedHoleGroup> moved =
        metrology::CorrectGroup(group, inputs.pose, inputs.zero_from_part_nominal, inputs.rotation.axes,
                                inputs.machine_axes.nominal, inputs.machine_axes.limits);
    if (!moved.ok()) return PoseFailure(moved.status());
    for (std::string& reason : metrology::BeyondEnvelope(*moved, inputs.envelope, inputs.machine_axes.letters))
      corrected.release_reasons.push_back(std::move(reason));
    corrected.groups.push_back(*std::move(moved));
  }
  if (request.nc_template().empty()) return corrected;
  absl::StatusOr<std::string> program = ProgramOf(request.nc_template(), corrected.groups, inputs.machine_axes.letters);
  if (!program.ok()) return program.status();
  if (corrected.release_reasons.empty()) corrected.nc_program = *std::move(program);
  return corrected;
}

}  // namespace sixpoint::correction
