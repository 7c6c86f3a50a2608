#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {

using registration::v1::RegistrationService;

void AddRegisterCommand(CLI::App* app, Session* session) {
  struct Arguments {
    std::string blade, method;
    std::vector<std::string> scans;
    bool axis_tables = false;
    RegisterOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app->add_subcommand("register", "Finds where a blade really stands");
  command->add_option("--blade", arguments->blade, "Serial number")->required();
  command->add_option("--scans", arguments->scans, "Its scans: ID,ID,...")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--method", arguments->method, "local, six-point, six-point-normals, best-fit or allowance")
      ->required()
      ->check(CLI::IsMember(RegisterMethods()));
  command->add_flag(
      "--axis-tables", arguments->axis_tables,
      "Take the scans where the axes' characterisations say they were; not where the control compensates");
  AddRegisterOptions(command, &arguments->options);
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    auto options = FitOptionsOf(arguments->options);
    if (!options.ok()) return options.status();
    registration::v1::RegisterRequest request;
    request.set_blade(NameText("blades", arguments->blade));
    for (const std::string& scan : arguments->scans) request.add_scans(NameText("scans", scan));
    request.set_method(RegisterMethodOf(arguments->method));
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
