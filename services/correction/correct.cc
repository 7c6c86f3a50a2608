#include "services/correction/correct.h"

#include <array>
#include <map>
#include <utility>

#include "metrology/correction/nc_program.h"
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

}  // namespace

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
  absl::StatusOr<std::string> program = ProgramOf(request.nc_template(), corrected.groups, inputs.machine_axes.letters);
  if (!program.ok()) return program.status();
  if (corrected.release_reasons.empty()) corrected.nc_program = *std::move(program);
  return corrected;
}

}  // namespace sixpoint::correction
