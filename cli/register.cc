
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

struct Arguments {
  std::string blade, clamping, method, batch, request_id, part, machine, since, until, sensor_calibration;
  std::vector<std::string> scans, blades;
  bool axis_tables = false;
  RegisterOptions options;
};

// From a file, or registered before.
absl::StatusOr<Again> ManyOf(Session* session, const Arguments& arguments, registration::v1::Method method) {
  if (!arguments.blades.empty()) return BatchOfLatest(session, arguments.blades, method, arguments.axis_tables);
  if (!arguments.part.empty()) {
    registration::v1::ListRegistrationsRequest which;
    which.set_part(NameText("parts", arguments.part));
    if (!arguments.machine.empty()) which.set_machine(NameText("machines", arguments.machine));
    const auto recorded = TimeRangeOf(arguments.since, arguments.until);
    if (!recorded.ok()) return recorded.status();
    *which.mutable_recorded() = *recorded;
    return BatchOfPart(session, std::move(which), method, arguments.axis_tables);
  }
  const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments.batch);
  if (!document.ok()) return document.status();
  auto request = BatchFromDocument(*document);
  if (!request.ok()) return request.status();
  return Again{*std::move(request), {}};
}

std::string MappedBy(const Arguments& arguments) {
  return arguments.sensor_calibration.empty() ? "" : NameText("calibrations", arguments.sensor_calibration);
}

}  // namespace

void AddRegisterCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<Arguments>();
  Command* command = app->AddCommand("register", "Finds where a blade really stands");
  Option* blade = command->AddOption("--blade", &arguments->blade, "Serial number");
  Option* scans = command->AddOption("--scans", &arguments->scans, "Its scans: ID,ID,...")->List();
  Option* method =
      command->AddOption("--method", &arguments->method, "local, six-point, six-point-normals, best-fit or allowance")
          ->OneOf(RegisterMethods());
  Option* axis_tables = command->AddFlag(
      "--axis-tables", &arguments->axis_tables,
      "Take the scans where the axes' characterisations say they were; not where the control compensates");
  Option* clamping =
      command->AddOption("--clamping", &arguments->clamping,
                         "As the machine calls it, another with every clamping; asked again at the program");
  command->AddOption("--sensor-calibration", &arguments->sensor_calibration,
                     "Maps the scans by it; without it by the one that was in force when they were received");
  const std::vector<Option*> how = AddRegisterOptions(command, &arguments->options);
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
  for (Option* other : {blade, scans, clamping, method, axis_tables, blades, part}) batch->Excludes(other);
  for (Option* other : {blade, scans, clamping, part}) blades->Excludes(other);
  for (Option* other : {blade, scans, clamping}) part->Excludes(other);
  for (Option* other : how) other->Excludes(batch)->Excludes(blades)->Excludes(part);
  request_id->Excludes(blade);
  command->RequireAlso([=]() -> std::string {
    if (batch->given() || blades->given() || part->given()) return "";
    if (!blade->given()) return "--blade, --blades, --part or --batch";
    if (!scans->given()) return "--scans";
    return method->given() ? "" : "--method";
  });
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    const registration::v1::Method asked = RegisterMethodOf(arguments->method);
    auto options = FitOptionsOf(arguments->options);
    if (!options.ok()) return options.status();
    if (arguments->blade.empty()) {
      absl::StatusOr<Again> many = ManyOf(session, *arguments, asked);
      if (!many.ok()) return many.status();
      if (!arguments->sensor_calibration.empty())
        for (auto& one : *many->request.mutable_requests()) one.set_sensor_calibration(MappedBy(*arguments));
      many->request.set_request_id(arguments->request_id.empty() ? NewRequestId() : arguments->request_id);
      return RegisterBatch(session, std::move(many->request), many->before);
    }
    registration::v1::RegisterRequest request;
    request.set_blade(NameText("blades", arguments->blade));
    for (const std::string& scan : arguments->scans) request.add_scans(NameText("scans", scan));
    request.set_method(asked);
    *request.mutable_options() = *std::move(options);
    request.set_apply_axis_tables(arguments->axis_tables);
    request.set_clamping(arguments->clamping);
    request.set_sensor_calibration(MappedBy(*arguments));
    request.set_request_id(NewRequestId());
    const absl::StatusOr<registration::v1::Registration> response = RegisterWatched(session, std::move(request));
    if (!response.ok()) return response.status();
    PrintMessage(session->json, *response, [&] { return RegistrationText(*response); });
    if (response->evidence().outcome() != registration::v1::OUTCOME_CONVERGED) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
