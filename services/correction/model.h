// The machining model that a correction names, and what follows from it.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "metrology/correction/nc_frame.h"
#include "metrology/correction/tool_cylinder.h"
#include "services/clients/parts.h"
#include "services/correction/machine_axes.h"
#include "services/runtime/call.h"
#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

// What drills a group's holes.
struct GroupElectrode {
  std::string group;
  double diameter_mm = 0, length_mm = 0;
  std::map<std::string, Eigen::Vector3d>
      normals_in_part;  // of the surface at each hole's start, outward; by the hole's name
};

// None where the request names none.
absl::StatusOr<std::optional<plant::v1::MachiningModel>> FetchModel(const clients::PlantClient& plant,
                                                                    const v1::CorrectRequest& request,
                                                                    const runtime::Caller& caller);

// The request as if it had been sent what the model says, which it names with its revision. INVALID_ARGUMENT for a group that the model does
// not machine.
absl::StatusOr<v1::CorrectRequest> WithModel(const v1::CorrectRequest& request, const plant::v1::MachiningModel& model);

// Refuses a model of another part than the blade's, and one that states W on a machine that cannot stand there.
absl::Status CheckModel(const plant::v1::MachiningModel& model, const std::string& part,
                        const plant::v1::Machine& machine);

// What the control's programs say by its post-processor: its words, and directions, which it turns into axes as the machine's record has them.
void AddPostProcessor(const plant::v1::MachiningModel& model, const MachineAxes& axes, metrology::NcFrame* frame);

// Of the model's groups in its order. Refused: an electrode that does not do for the holes of this revision of the part: wider than they are,
// or of which less than their depth is left before the last of its group.
absl::StatusOr<std::vector<GroupElectrode>> ElectrodesOf(const plant::v1::MachiningModel& model,
                                                         const plant::v1::Part& part);

// Each hole's electrode in its whole length: worn it is shorter and goes where that one goes, and a new one may be taken before any hole.
std::vector<metrology::ToolCylinder> ToolsOf(const std::vector<GroupElectrode>& electrodes,
                                             const std::vector<metrology::NominalHoleGroup>& groups);

}  // namespace sixpoint::correction
