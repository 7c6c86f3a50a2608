
#include "cli/batch_again.h"
#include "cli/batch_document.h"
#include "cli/commands.h"
#include "cli/document.h"
#include "cli/output.h"
#include "cli/register_batch.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {
namespace {

struct RegisterArguments {
  ScansToRegister scans;
  std::string batch, request_id, part, machine, since, until;
  std::vector<std::string> blades;
};

// From a file, or registered before.
absl::StatusOr<Again> ManyOf(Session* session, const RegisterArguments& arguments, registration::v1::Method method) {
  if (!arguments.blades.empty()) return BatchOfLatest(session, arguments.blades, method, arguments.scans.axis_tables);
  if (!arguments.part.empty()) {
    registration::v1::ListRegistrationsRequest which;
    which.set_part(NameText("parts", arguments.part));
    if (!arguments.machine.empty()) which.set_machine(NameText("machines", arguments.machine));
    const auto recorded = TimeRangeOf(arguments.since, arguments.until);
    if (!recorded.ok()) return recorded.status();
    *which.mutable_recorded() = *recorded;
    return BatchOfPart(session, std::move(which), method, arguments.scans.axis_tables);
  }
  const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments.batch);
  if (!document.ok()) return document.status();
  auto request = BatchFromDocument(*document);
  if (!request.ok()) return request.status();
  return Again{*std::move(request), {}};
}

}  // namespace

void AddRegisterCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<RegisterArguments>();
  Command* command = app->AddCommand("register", "Finds where a blade really stands");
  const ScansToRegisterOptions one = AddScansToRegister(command, &arguments->scans);
  Option* batch = command->AddOption("--batch", &arguments->batch, "Many blades, from a file");
  Option* blades = command
                       ->AddOption("--blades", &arguments->blades,
                                   "Many blades again, from the scans of each one's latest registration: SN,SN,...")
                       ->List();
  Option* part = command->AddOption("--part", &arguments->part,
                                    "Many blades again: each of this part that was registered since --since");
  Option* since = command->AddOption("--since", &arguments->since, "2026-11-21, or 2026-11-21T03:25:01Z");
  Option* until = command->AddOption("--until", &arguments->until, "As --since; without it until now");
  Option* machine = command->AddOption("--machine", &arguments->machine, "Only what this machine scanned");
  part->Needs(since);
  for (Option* other : {since, until, machine}) other->Needs(part);
  Option* request_id =
      command->AddOption("--request-id", &arguments->request_id, "Goes on with a batch that broke off");
  for (Option* other : {one.blade, one.scans, one.clamping, one.method, one.axis_tables, blades, part})
    batch->Excludes(other);
  for (Option* other : {one.blade, one.scans, one.clamping, part}) blades->Excludes(other);
  for (Option* other : {one.blade, one.scans, one.clamping}) part->Excludes(other);
  for (Option* other : one.how) other->Excludes(batch)->Excludes(blades)->Excludes(part);
  request_id->Excludes(one.blade);
  command->RequireAlso([=]() -> std::string {
    if (batch->given() || blades->given() || part->given()) return "";
    if (!one.blade->given()) return "--blade, --blades, --part or --batch";
    if (!one.scans->given()) return "--scans";
    return one.method->given() ? "" : "--method";
  });
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    auto request = RegisterRequestOf(arguments->scans);
    if (!request.ok()) return request.status();
    if (arguments->scans.blade.empty()) {
      absl::StatusOr<Again> many = ManyOf(session, *arguments, request->method());
      if (!many.ok()) return many.status();
      if (!request->sensor_calibration().empty())
        for (auto& again : *many->request.mutable_requests())
          again.set_sensor_calibration(request->sensor_calibration());
      many->request.set_request_id(arguments->request_id.empty() ? NewRequestId() : arguments->request_id);
      return RegisterBatch(session, std::move(many->request), many->before);
    }
    request->set_request_id(NewRequestId());
    const absl::StatusOr<registration::v1::Registration> response = RegisterWatched(session, *std::move(request));
    if (!response.ok()) return response.status();
    PrintMessage(session->json, *response, [&] { return RegistrationText(*response); });
    if (response->evidence().outcome() != registration::v1::OUTCOME_CONVERGED) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
