#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>

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
  std::string blade, method, batch, request_id, part, machine, since, until;
  std::vector<std::string> scans, blades;
  bool axis_tables = false;
  RegisterOptions options;
};

// From a file, or registered before.
absl::StatusOr<Again> ManyOf(Session* session, const Arguments& arguments, registration::v1::Method method) {
  if (!arguments.blades.empty()) return BatchOfLatest(session, arguments.blades, method, arguments.axis_tables);
  if (!arguments.part.empty()) {
    AgainFilter filter;
    filter.part = NameText("parts", arguments.part);
    if (!arguments.machine.empty()) filter.machine = NameText("machines", arguments.machine);
    const auto since = TimeOf("--since", arguments.since);
    if (!since.ok()) return since.status();
    filter.since = *since;
    filter.until = google::protobuf::util::TimeUtil::GetCurrentTime();
    if (!arguments.until.empty()) {
      const auto until = TimeOf("--until", arguments.until);
      if (!until.ok()) return until.status();
      filter.until = *until;
    }
    return BatchOfPart(session, filter, method, arguments.axis_tables);
  }
  const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments.batch);
  if (!document.ok()) return document.status();
  auto request = BatchFromDocument(*document);
  if (!request.ok()) return request.status();
  return Again{*std::move(request), {}};
}

}  // namespace

void AddRegisterCommand(CLI::App* app, Session* session) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app->add_subcommand("register", "Finds where a blade really stands");
  CLI::Option* blade = command->add_option("--blade", arguments->blade, "Serial number");
  CLI::Option* scans =
      command->add_option("--scans", arguments->scans, "Its scans: ID,ID,...")->delimiter(',')->allow_extra_args(false);
  CLI::Option* method =
      command->add_option("--method", arguments->method, "local, six-point, six-point-normals, best-fit or allowance")
          ->check(CLI::IsMember(RegisterMethods()));
  CLI::Option* axis_tables = command->add_flag(
      "--axis-tables", arguments->axis_tables,
      "Take the scans where the axes' characterisations say they were; not where the control compensates");
  const std::vector<CLI::Option*> how = AddRegisterOptions(command, &arguments->options);
  CLI::Option* batch = command->add_option("--batch", arguments->batch, "Many blades, from a file");
  CLI::Option* blades =
      command
          ->add_option("--blades", arguments->blades,
                       "Many blades again, from the scans of each one's latest registration: SN,SN,...")
          ->delimiter(',')
          ->allow_extra_args(false);
  CLI::Option* part = command->add_option("--part", arguments->part,
                                          "Many blades again: each of this part that was registered since --since");
  CLI::Option* since = command->add_option("--since", arguments->since, "2026-11-21, or 2026-11-21T03:25:01Z");
  CLI::Option* until = command->add_option("--until", arguments->until, "As --since; without it until now");
  CLI::Option* machine = command->add_option("--machine", arguments->machine, "Only what this machine scanned");
  part->needs(since);
  for (CLI::Option* other : {since, until, machine}) other->needs(part);
  CLI::Option* request_id =
      command->add_option("--request-id", arguments->request_id, "Goes on with a batch that broke off");
  for (CLI::Option* other : {blade, scans, method, axis_tables, blades, part}) batch->excludes(other);
  for (CLI::Option* other : {blade, scans, part}) blades->excludes(other);
  for (CLI::Option* other : {blade, scans}) part->excludes(other);
  for (CLI::Option* other : how) other->excludes(batch)->excludes(blades)->excludes(part);
  request_id->excludes(blade);
  command->parse_complete_callback([=] {
    if (batch->count() > 0 || blades->count() > 0 || part->count() > 0) return;
    if (blade->count() == 0) throw CLI::RequiredError("--blade, --blades, --part or --batch");
    if (scans->count() == 0) throw CLI::RequiredError("--scans");
    if (method->count() == 0) throw CLI::RequiredError("--method");
  });
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    const registration::v1::Method asked = RegisterMethodOf(arguments->method);
    auto options = FitOptionsOf(arguments->options);
    if (!options.ok()) return options.status();
    if (arguments->blade.empty()) {
      absl::StatusOr<Again> many = ManyOf(session, *arguments, asked);
      if (!many.ok()) return many.status();
      many->request.set_requested_by(session->requested_by());
      many->request.set_request_id(arguments->request_id.empty() ? NewRequestId() : arguments->request_id);
      return RegisterBatch(session, std::move(many->request), many->before);
    }
    registration::v1::RegisterRequest request;
    request.set_blade(NameText("blades", arguments->blade));
    for (const std::string& scan : arguments->scans) request.add_scans(NameText("scans", scan));
    request.set_method(asked);
    *request.mutable_options() = *std::move(options);
    request.set_apply_axis_tables(arguments->axis_tables);
    request.set_requested_by(session->requested_by());
    request.set_request_id(NewRequestId());
    const absl::StatusOr<registration::v1::Registration> response = RegisterWatched(session, std::move(request));
    if (!response.ok()) return response.status();
    PrintMessage(session->json, *response, [&] { return RegistrationText(*response); });
    if (response->evidence().outcome() != registration::v1::OUTCOME_CONVERGED) session->MarkNotUsable();
    return absl::OkStatus();
  });
}

}  // namespace sixpoint::cli
