#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/person.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::PersonService;

std::string UserText(const plant::v1::Person& person) { return person.user().empty() ? "forgotten" : person.user(); }

}  // namespace

void AddPersonCommands(Command* app, Session* session) {
  Command* person = app->AddCommand("person", "Whose the pseudonyms in the record are");
  person->RequireCommand();

  AddListCommand<PersonService>(
      person, session, "Lists who asked for something that was recorded", "plant", &PersonService::Stub::ListPersons,
      plant::v1::ListPersonsRequest(), Table({"person", "user", "first seen", "forgotten"}),
      &plant::v1::ListPersonsResponse::persons, [](const plant::v1::Person& entry) {
        return Cells{entry.name(), UserText(entry), TimeText(entry.first_seen_at()), TimeText(entry.forgotten_at())};
      });

  const auto argument = std::make_shared<std::string>();
  Command* forget =
      person->AddCommand("forget", "Forgets whose a pseudonym is, for good; the record keeps the pseudonym");
  forget->AddOption("NAME", argument.get(), "users/NAME or persons/PSEUDONYM")->Required();
  session->OnCommand(forget, [session, argument]() -> absl::Status {
    plant::v1::ForgetPersonRequest request;
    request.set_name(*argument);
    plant::v1::Person forgotten;
    absl::Status status =
        session->Call<PersonService>("plant", &PersonService::Stub::ForgetPerson, request, &forgotten);
    if (!status.ok()) return status;
    PrintMessage(session->json, forgotten,
                 [&] { return forgotten.name() + ": forgotten " + TimeText(forgotten.forgotten_at()) + "\n"; });
    return status;
  });
}

}  // namespace sixpoint::cli
