#include "services/correction/validate.h"

#include <set>
#include <string>
#include <utility>

#include "services/runtime/control_tables.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

// What the model says is not said again.
absl::Status CheckModelAlone(const v1::CorrectRequest& request) {
  const std::string wanted = "none beside machining_model, which has its own";
  runtime::Refusals refusals;
  refusals.Add(runtime::RevisedIdOf("machining_model", "machining_models", request.machining_model()).status());
  if (!request.nc_template().empty())
    refusals.Add(runtime::Refuse("nc_template", std::to_string(request.nc_template().size()) + " bytes", wanted));
  if (!request.work_offsets().empty())
    refusals.Add(runtime::Refuse("work_offsets", std::to_string(request.work_offsets_size()) + " offsets", wanted));
  if (!request.tool_lengths().empty())
    refusals.Add(runtime::Refuse("tool_lengths", std::to_string(request.tool_lengths_size()) + " tools", wanted));
  return refusals.status();
}

absl::Status CheckName(const std::string& field, const std::string& collection, const std::string& name) {
  const absl::StatusOr<std::string> id = runtime::IdOf(field, collection, name);
  return id.ok() ? runtime::CheckUuid(field, *id) : id.status();
}

absl::Status CheckShape(const v1::CorrectRequest& request) {
  runtime::Refusals refusals;
  if (!request.reconstruction().empty())
    refusals.Add(CheckName("reconstruction", "reconstructions", request.reconstruction()));
  if (!request.machining_pass().empty())
    refusals.Add(CheckName("machining_pass", "machining_passes", request.machining_pass()));
  if (!request.repair().empty()) {
    refusals.Add(CheckName("repair", "repairs", request.repair()));
    if (!request.reconstruction().empty() || !request.machining_pass().empty())
      refusals.Add(runtime::Refuse("repair", request.repair(), "none beside a reconstruction or a machining pass"));
    if (request.groups_size() > 0)
      refusals.Add(runtime::Refuse("groups", std::to_string(request.groups_size()) + " of them",
                                   "none: the repair says where the tool goes"));
  }
  if (!request.reconstruction().empty() && !request.machining_pass().empty())
    refusals.Add(
        runtime::Refuse("reconstruction", request.reconstruction(), "none beside machining_pass, which has one"));
  if (request.machining_model().empty())
    refusals.Add(runtime::Refuse("machining_model", "",
                                 request.repair().empty() ? "the model whose paths go with the shape"
                                                          : "the model by which the repair's laps are led"));
  return refusals.status();
}

absl::Status CheckWhat(const v1::CorrectRequest& request) {
  runtime::Refusals refusals;
  std::set<std::string> seen;
  for (int i = 0; i < request.groups_size(); ++i) {
    const std::string field = "groups[" + std::to_string(i) + "]";
    if (request.groups(i).empty())
      refusals.Add(runtime::Refuse(field, "", "the name of a hole group"));
    else if (!seen.insert(request.groups(i)).second)
      refusals.Add(runtime::Refuse(field, request.groups(i), "each group once"));
  }
  refusals.Add(runtime::CheckWorkOffsets("work_offsets", request.work_offsets()))
      .Add(runtime::CheckToolLengths("tool_lengths", request.tool_lengths()));
  if (!request.reconstruction().empty() || !request.machining_pass().empty() || !request.repair().empty())
    refusals.Add(CheckShape(request));
  if (!request.machining_model().empty()) return refusals.Add(CheckModelAlone(request)).status();
  if (request.nc_template().empty() && request.work_offsets_size() + request.tool_lengths_size() > 0)
    refusals.Add(runtime::Refuse("nc_template", "empty", "the template that the offsets and tools are of"));
  return refusals.status();
}

}  // namespace

absl::Status CheckCorrect(const v1::CorrectRequest& request) {
  return runtime::Refusals()
      .Add(CheckName("registration", "registrations", request.registration()))
      .Add(CheckWhat(request))
      .status();
}

absl::Status CheckCorrectScans(const v1::CorrectScansRequest& request) {
  const std::string wanted = "unset: it follows from the call";
  const registration::v1::RegisterRequest& registration = request.registration();
  const v1::CorrectRequest& correction = request.correction();
  runtime::Refusals refusals;
  if (!registration.request_id().empty())
    refusals.Add(runtime::Refuse("registration.request_id", registration.request_id(), wanted));
  if (registration.for_inspection())
    refusals.Add(runtime::Refuse("registration.for_inspection", "true", "unset: a program follows"));
  if (!correction.registration().empty())
    refusals.Add(runtime::Refuse("correction.registration", correction.registration(), wanted));
  if (!correction.request_id().empty())
    refusals.Add(runtime::Refuse("correction.request_id", correction.request_id(), wanted));
  for (const auto& [field, value] : {std::pair("correction.reconstruction", &correction.reconstruction()),
                                     {"correction.machining_pass", &correction.machining_pass()},
                                     {"correction.repair", &correction.repair()}})
    if (!value->empty())
      refusals.Add(runtime::Refuse(field, *value, "unset: it is of a registration that was made before"));
  if (correction.dry_run())
    refusals.Add(runtime::Refuse("correction.dry_run", "true", "unset: the registration is recorded"));
  return refusals.Add(Under("correction.", CheckWhat(correction))).status();
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
