#include "services/inspection/disposition_service.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "services/inspection/messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::inspection {
namespace {

absl::Status CheckDispose(const v1::DisposeRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("inspection", "inspections", request.inspection()).status());
  if (!v1::DispositionKind_IsValid(request.kind()) || request.kind() == v1::DISPOSITION_KIND_UNSPECIFIED)
    refusals.Add(runtime::Refuse("kind", std::to_string(request.kind()),
                                 "DISPOSITION_KIND_CONCESSION, REWORK, SCRAP, USE_AS_IS or RETURN"));
  if (request.reason().empty()) refusals.Add(runtime::Refuse("reason", "", "why it was decided so"));
  if (request.kind() == v1::DISPOSITION_KIND_CONCESSION && request.reference().empty())
    refusals.Add(runtime::Refuse("reference", "", "the concession's number"));
  return refusals.status();
}

runtime::Made<storage::DispositionRow> MadeOf(const v1::DisposeRequest& request,
                                              const storage::InspectionRow& inspection) {
  runtime::Made<storage::DispositionRow> made;
  storage::DispositionRow& row = made.row;
  row.disposition_id = storage::NewUuid();
  row.inspection_id = inspection.inspection_id;
  row.blade_serial = inspection.blade_serial;
  row.machine_id = inspection.machine_id;
  row.disposition = v1::DispositionKind_Name(request.kind()).substr(std::strlen("DISPOSITION_KIND_"));
  row.reason = request.reason();
  row.reference = request.reference();
  row.software_version = runtime::SoftwareVersion();
  made.entry.kind = "disposition";
  made.entry.name = runtime::NameOf("dispositions", row.disposition_id);
  made.entry.inputs = {request.inspection()};
  made.entry.blade = row.blade_serial;
  made.entry.machine = row.machine_id;
  made.entry.method = row.disposition;
  made.entry.software_version = row.software_version;
  nlohmann::json summary = {{"verdict", inspection.verdict}, {"reason", row.reason}};
  if (!row.reference.empty()) summary["reference"] = row.reference;
  made.entry.summary_json = summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return made;
}

}  // namespace

grpc::Status DispositionService::Dispose(grpc::ServerContext* context, const v1::DisposeRequest* request,
                                         v1::Disposition* response) {
  if (absl::Status status = CheckDispose(*request); !status.ok()) return runtime::ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::DispositionRow>> {
    const auto inspection =
        inspections_->Find(runtime::LastSegment(request->inspection()), runtime::DeadlineOf(*context));
    if (!inspection.ok()) return inspection.status();
    if (!inspection->has_value())
      return runtime::Failure(errors::v1::INSPECTION_NOT_FOUND,
                              "inspection: " + request->inspection() + ", want one that is recorded",
                              {{"resource", request->inspection()}});
    return MadeOf(*request, **inspection);
  };
  return runtime::Answer(runtime::RecordedResult<v1::Disposition>(dispositions_.get(), "inspection.Dispose", *request,
                                                                  caller, make, DispositionOf),
                         response);
}

}  // namespace sixpoint::inspection
