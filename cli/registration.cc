#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/reports.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {

using registration::v1::RegistrationService;

void AddRegistrationCommands(Command* app, Session* session) {
  Command* registration = app->AddCommand("registration", "Registrations that were made");
  registration->RequireCommand();
  AddListCommand<RegistrationService>(
      registration, session, "Lists registrations, newest first", "registration",
      &RegistrationService::Stub::ListRegistrations, registration::v1::ListRegistrationsRequest(),
      Table({"registration", "blade", "method", "outcome", ">rms um", "machine", "by", "recorded"}),
      &registration::v1::ListRegistrationsResponse::registrations, [](const registration::v1::Registration& entry) {
        return Cells{IdText(entry.name()),
                     IdText(entry.blade()),
                     MethodText(entry.method()),
                     OutcomeName(entry.evidence().outcome()),
                     FixedOrNone(entry.evidence().residual_rms_um(), 3),
                     IdText(entry.machine()),
                     entry.requested_by(),
                     TimeText(entry.recorded_at())};
      });

  const auto id = std::make_shared<std::string>();
  Command* show = registration->AddCommand("show", "Shows a registration with its evidence");
  show->AddOption("ID", id.get(), "The registration")->Required();
  session->OnCommand(show, [session, id] {
    registration::v1::GetRegistrationRequest request;
    request.set_name(NameText("registrations", *id));
    return CallAndPrint<RegistrationService>(session, "registration", &RegistrationService::Stub::GetRegistration,
                                             request, RegistrationText)
        .status();
  });
}

}  // namespace sixpoint::cli
