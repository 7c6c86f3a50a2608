#include "services/correction/decide.h"

#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "services/correction/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

using storage::CorrectionRow;

absl::Status WrongState(const CorrectionRow& row, const std::string& name, errors::v1::ErrorReason reason,
                        const std::string& wanted) {
  std::string found = row.state;
  if (row.state == "REFUSED" && row.refused)
    found += " by " + row.refused->requested_by + " (" + row.refused->reason + ")";
  if (row.state == "SUPERSEDED") found += " by corrections/" + row.superseded_by;
  return runtime::Failure(reason, "name: " + name + ", " + found + ", want " + wanted,
                          {{"resource", name}, {"state", row.state}});
}

template <typename Request>
absl::StatusOr<storage::CorrectionDecision> DecisionOf(const Request& request, const std::string& requested_by,
                                                       const char* event,
                                                       absl::Status (*may)(const CorrectionRow&, const std::string&)) {
  if (absl::Status s = CheckDecision(request.name(), request.reason()); !s.ok()) return s;
  storage::CorrectionDecision decision;
  decision.correction_id = runtime::LastSegment(request.name());
  decision.event = event;
  decision.reason = request.reason();
  decision.requested_by = requested_by;
  decision.software_version = runtime::SoftwareVersion();
  decision.check = [name = request.name(), may](const std::optional<CorrectionRow>& row) {
    return row ? may(*row, name) : NotRecorded(name);
  };
  return decision;
}

absl::Status MayRelease(const CorrectionRow& row, const std::string& name) {
  return row.state == "DRAFT" ? absl::OkStatus() : WrongState(row, name, errors::v1::CORRECTION_DECIDED, "a draft");
}

absl::Status MayRefuse(const CorrectionRow& row, const std::string& name) {
  return row.state == "REFUSED" ? WrongState(row, name, errors::v1::CORRECTION_DECIDED, "one that is not refused")
                                : absl::OkStatus();
}

absl::Status MayReport(const CorrectionRow& row, const v1::ReportCutRequest& request) {
  if (row.release != "AUTOMATIC" && !row.released)
    return WrongState(row, request.name(), errors::v1::PROGRAM_NOT_RELEASED, "one that was released");
  std::map<std::pair<std::string, std::string>, const storage::CorrectionHoleRow*> holes;
  for (const storage::CorrectionGroupRow& group : row.groups)
    for (const storage::CorrectionHoleRow& hole : group.holes) holes[{group.group_name, hole.hole_name}] = &hole;
  runtime::Refusals refusals;
  for (int i = 0; i < request.holes_size(); ++i) {
    const v1::CutHole& cut = request.holes(i);
    const auto found = holes.find({cut.group(), cut.hole()});
    const std::string name = cut.group() + "/" + cut.hole();
    if (found == holes.end())
      refusals.Add(runtime::Refuse("holes[" + std::to_string(i) + "]", name, "a hole of " + request.name()));
    else if (found->second->reported_cut_at)
      return runtime::Failure(
          errors::v1::HOLE_CUT_BEFORE,
          "holes[" + std::to_string(i) + "]: " + name + ", want one that was not reported cut before",
          {{"resource", request.name()}, {"hole", name}});
  }
  return refusals.status();
}

}  // namespace

absl::Status NotRecorded(const std::string& name) {
  return runtime::Failure(errors::v1::CORRECTION_NOT_FOUND, "name: " + name + ", want one of the stored corrections",
                          {{"resource", name}});
}

absl::StatusOr<storage::CorrectionDecision> Decide(const v1::ReleaseCorrectionRequest& request,
                                                   const std::string& requested_by) {
  return DecisionOf(request, requested_by, "RELEASED", MayRelease);
}

absl::StatusOr<storage::CorrectionDecision> Decide(const v1::RefuseCorrectionRequest& request,
                                                   const std::string& requested_by) {
  return DecisionOf(request, requested_by, "REFUSED", MayRefuse);
}

absl::StatusOr<storage::CutReport> ReportOf(const v1::ReportCutRequest& request, const std::string& requested_by) {
  if (absl::Status status = CheckReport(request); !status.ok()) return status;
  storage::CutReport report;
  report.correction_id = runtime::LastSegment(request.name());
  for (const v1::CutHole& hole : request.holes()) report.holes.push_back({hole.group(), hole.hole()});
  if (request.has_cut_at()) report.cut_at = runtime::MomentOf(request.cut_at());
  report.requested_by = requested_by;
  report.software_version = runtime::SoftwareVersion();
  report.check = [request](const std::optional<CorrectionRow>& row) {
    return row ? MayReport(*row, request) : NotRecorded(request.name());
  };
  return report;
}

absl::Status CheckFetchable(const CorrectionRow& row, const v1::FetchProgramRequest& request) {
  for (const auto& [field, found, wanted] :
       {std::tuple("machine", request.machine(), runtime::NameOf("machines", row.machine_id)),
        std::tuple("blade", request.blade(), runtime::NameOf("blades", row.blade_serial)),
        std::tuple("clamping", request.clamping(), row.clamping)}) {
    // What was not stated when the blade was registered cannot be compared.
    if (found == wanted || wanted.empty()) continue;
    return runtime::Failure(errors::v1::CLAMPING_DIFFERS,
                            std::string(field) + ": " + found + ", want " + wanted + ", which was registered",
                            {{"resource", request.name()}, {"field", field}});
  }
  if (row.state != "RELEASED") return WrongState(row, request.name(), errors::v1::PROGRAM_NOT_RELEASED, "RELEASED");
  if (row.program().empty())
    return runtime::Failure(errors::v1::PROGRAM_MISSING,
                            "name: " + request.name() + ", made without a template, want one with a program",
                            {{"resource", request.name()}});
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
