#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/output.h"
#include "cli/register_batch.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {

using registration::v1::RegistrationService;

void AddRegisterCommand(CLI::App* app, Session* session) {
  struct Arguments {
    std::string blade, method, batch, request_id;
    std::vector<std::string> scans, blades;
    bool axis_tables = false;
    RegisterOptions options;
  };
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
  CLI::Option* request_id =
      command->add_option("--request-id", arguments->request_id, "Goes on with a batch that broke off");
  for (CLI::Option* other : {blade, scans, method, axis_tables, blades}) batch->excludes(other);
  for (CLI::Option* other : {blade, scans}) blades->excludes(other);
  for (CLI::Option* other : how) other->excludes(batch)->excludes(blades);
  request_id->excludes(blade);
  command->parse_complete_callback([=] {
    if (batch->count() > 0 || blades->count() > 0) return;
    if (blade->count() == 0) throw CLI::RequiredError("--blade, --blades or --batch");
    if (scans->count() == 0) throw CLI::RequiredError("--scans");
    if (method->count() == 0) throw CLI::RequiredError("--method");
  });
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    const registration::v1::Method asked = RegisterMethodOf(arguments->method);
    auto options = FitOptionsOf(arguments->options);
    if (!options.ok()) return options.status();
    if (arguments->blade.empty()) {
      absl::StatusOr<registration::v1::RegisterBatchRequest> many = [&] {
        if (!arguments->blades.empty()) return BatchOfLatest(session, arguments->blades, asked, arguments->axis_tables);
        const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments->batch);
        return document.ok() ? BatchFromDocument(*document)
                             : absl::StatusOr<registration::v1::RegisterBatchRequest>(document.status());
      }();
      if (!many.ok()) return many.status();
      many->set_requested_by(session->requested_by());
      many->set_request_id(arguments->request_id.empty() ? NewRequestId() : arguments->request_id);
      return RegisterBatch(session, *std::move(many));
    }
    registration::v1::RegisterRequest request;
    request.set_blade(NameText("blades", arguments->blade));
    for (const std::string& scan : arguments->scans) request.add_scans(NameText("scans", scan));
    request.set_method(asked);
    *request.mutable_options() = *std::move(options);
    request.set_apply_axis_tables(arguments->axis_tables);
    request.set_requested_by(session->requested_by());
    request.set_request_id(NewRequestId());
    registration::v1::Registration response;
    absl::Status status =
        session->Call<RegistrationService>("registration", &RegistrationService::Stub::Register, request, &response);
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(MessageToJson(response));
    } else {
      std::cout << RegistrationText(response);
    }
    if (response.evidence().outcome() != registration::v1::OUTCOME_CONVERGED) session->MarkNotUsable();
    return status;
  });
}

}  // namespace sixpoint::cli
