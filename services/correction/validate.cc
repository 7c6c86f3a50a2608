#include "services/correction/validate.h"

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {

absl::Status CheckCorrect(const v1::CorrectRequest& request) {
  const absl::StatusOr<std::string> id = runtime::IdOf("registration", "registrations", request.registration());
  runtime::Refusals refusals;
  refusals.Add(id.ok() ? runtime::CheckUuid("registration", *id) : id.status());
  std::set<std::string> seen;
  for (int i = 0; i < request.groups_size(); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty())
      refusals.Add(runtime::Refuse(field, "", "the name of a hole group"));
    else if (!seen.insert(request.groups(i)).second)
      refusals.Add(runtime::Refuse(field, request.groups(i), "each group once"));
  }
  std::set<std::string> codes;
  for (int i = 0; i < request.work_offsets_size(); ++i) {
    const v1::WorkOffset& one = request.work_offsets(i);
    const std::string field = "work_offsets[" + std::to_string(i) + "]";
    if (one.code().size() != 3 || one.code() < "G54" || one.code() > "G59")
      refusals.Add(runtime::Refuse(field + ".code", one.code(), "G54 to G59"));
    else if (!codes.insert(one.code()).second)
      refusals.Add(runtime::Refuse(field + ".code", one.code(), "each once"));
    for (const auto& [name, value] :
         {std::pair("x_mm", one.x_mm()), std::pair("y_mm", one.y_mm()), std::pair("z_mm", one.z_mm()),
          std::pair("a_deg", one.a_deg()), std::pair("b_deg", one.b_deg())})
      if (!(std::abs(value) <= 1e5)) refusals.Add(runtime::Refuse(field + "." + name, value, "-100000 to 100000"));
  }
  std::set<int> tools;
  for (int i = 0; i < request.tool_lengths_size(); ++i) {
    const v1::ToolLength& tool = request.tool_lengths(i);
    const std::string field = "tool_lengths[" + std::to_string(i) + "]";
    if (tool.number() < 1 || tool.number() > 9999)
      refusals.Add(runtime::Refuse(field + ".number", tool.number(), "1 to 9999"));
    else if (!tools.insert(tool.number()).second)
      refusals.Add(runtime::Refuse(field + ".number", tool.number(), "each once"));
    if (!(tool.length_mm() >= 0 && tool.length_mm() <= 2000))
      refusals.Add(runtime::Refuse(field + ".length_mm", tool.length_mm(), "0 to 2000"));
  }
  if (request.nc_template().empty() && request.work_offsets_size() + request.tool_lengths_size() > 0)
    refusals.Add(runtime::Refuse("nc_template", "empty", "the template that the offsets and tools are of"));
  return refusals.status();
}

absl::Status CheckDecision(const std::string& name, const std::string& reason) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("name", "corrections", name).status());
  if (reason.find_first_not_of(" \t\r\n") == std::string::npos) refusals.Add(runtime::Refuse("reason", reason, "why"));
  return refusals.status();
}

absl::Status CheckFetch(const v1::FetchProgramRequest& request) {
  return runtime::Refusals()
      .Add(runtime::IdOf("name", "corrections", request.name()).status())
      .Add(runtime::IdOf("machine", "machines", request.machine()).status())
      .Add(runtime::IdOf("blade", "blades", request.blade()).status())
      .status();
}

absl::Status CheckReport(const v1::ReportCutRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("name", "corrections", request.name()).status());
  if (request.holes().empty()) refusals.Add(runtime::Refuse("holes", "none", "at least one"));
  std::set<std::pair<std::string, std::string>> seen;
  for (int i = 0; i < request.holes_size(); ++i)
    if (!seen.insert({request.holes(i).group(), request.holes(i).hole()}).second)
      refusals.Add(runtime::Refuse("holes[" + std::to_string(i) + "]",
                                   request.holes(i).group() + "/" + request.holes(i).hole(), "each hole once"));
  if (request.has_cut_at()) refusals.Add(runtime::CheckMoment("cut_at", request.cut_at()));
  return refusals.status();
}

}  // namespace sixpoint::correction
