#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {

using registration::v1::RegistrationService;

void AddRegistrationCommands(CLI::App* app, Session* session) {
  struct Arguments {
    std::string id, blade;
    bool only_disagreeing = false, without_for_inspection = false;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* registration = app->add_subcommand("registration", "Registrations that were made");
  registration->require_subcommand(1);

  CLI::App* list = registration->add_subcommand("list", "Lists registrations, newest first");
  list->add_option("--blade", arguments->blade, "Only of this blade");
  list->add_flag("--disagreeing", arguments->only_disagreeing,
                 "Only those that the best fit of their scans contradicts");
  list->add_flag("--without-inspections", arguments->without_for_inspection,
                 "Not those that an inspection made for its verdict");
  AddLimitOption(list, &arguments->limit);
  session->OnCommand(list, [session, arguments] {
    registration::v1::ListRegistrationsRequest request;
    if (!arguments->blade.empty()) request.set_blade(NameText("blades", arguments->blade));
    request.set_only_disagreeing(arguments->only_disagreeing);
    request.set_without_for_inspection(arguments->without_for_inspection);
    return ListAndPrint<RegistrationService>(
        session, "registration", &RegistrationService::Stub::ListRegistrations, request, arguments->limit,
        Table({"registration", "blade", "method", "outcome", ">rms um", "machine", "by", "recorded"}),
        &registration::v1::ListRegistrationsResponse::registrations, [](const registration::v1::Registration& entry) {
          return Cells{IdText(entry.name()),
                       IdText(entry.blade()),
                       MethodText(entry.method()),
                       OutcomeName(entry.evidence().outcome()),
                       Fixed(entry.evidence().residual_rms_um(), 3),
                       IdText(entry.machine()),
                       entry.requested_by(),
                       TimeText(entry.recorded_at())};
        });
  });

  CLI::App* show = registration->add_subcommand("show", "Shows a registration with its evidence");
  show->add_option("ID", arguments->id, "The registration")->required();
  session->OnCommand(show, [session, arguments] {
    registration::v1::GetRegistrationRequest request;
    request.set_name(NameText("registrations", arguments->id));
    return CallAndPrint<RegistrationService>(session, "registration", &RegistrationService::Stub::GetRegistration,
                                             request, RegistrationText)
        .status();
  });
}

}  // namespace sixpoint::cli
