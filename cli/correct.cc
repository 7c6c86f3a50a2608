#include <iostream>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::CorrectionService;

struct Arguments {
  std::string registration, template_file, out;
  std::vector<std::string> groups;
};

absl::Status Correct(Session* session, const Arguments& arguments) {
  if (!arguments.out.empty() && arguments.template_file.empty()) {
    return runtime::Refuse("--out", arguments.out, "--template too: the program is made from it");
  }
  absl::Status status = CheckOut(*session, arguments.out);
  if (!status.ok()) return status;
  correction::v1::CorrectRequest request;
  request.set_registration(NameText("registrations", arguments.registration));
  for (const std::string& group : arguments.groups) request.add_groups(group);
  if (!arguments.template_file.empty()) {
    absl::StatusOr<std::string> nc_template = ReadFile(arguments.template_file, 1u << 20);
    if (!nc_template.ok()) return nc_template.status();
    request.set_nc_template(*nc_template);
  }
  request.set_requested_by(session->requested_by());
  request.set_request_id(NewRequestId());
  correction::v1::Correction response;
  status = session->Call<CorrectionService>("correction", &CorrectionService::Stub::Correct, request, &response);
  if (!status.ok()) return status;
  const bool released = response.release() == correction::v1::RELEASE_AUTOMATIC;
  if (!arguments.out.empty() && released) {
    status = WriteOut(arguments.out, response.nc_program());
    if (!status.ok()) return status;
  }
  if (session->json) {
    PrintJson(response);
  } else {
    std::ostream& beside = BesideOut(arguments.out);
    beside << CorrectionText(response);
    if (!arguments.out.empty()) {
      beside << (released ? "program written to " : "no program written to ") << OutText(arguments.out) << "\n";
    } else {
      beside << response.nc_program();
    }
  }
  if (!released) session->MarkNotUsable();
  return absl::OkStatus();
}

}  // namespace

void AddCorrectCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<Arguments>();
  Command* command = app->AddCommand("correct", "Moves the machining program onto the real blade");
  command->AddOption("--registration", &arguments->registration, "The registration to correct by")->Required();
  command->AddOption("--groups", &arguments->groups, "Only these hole groups: G1,G2,...")->List();
  command->AddOption("--template", &arguments->template_file, "NC program whose coordinates are replaced");
  AddOutOption(command, &arguments->out, "Where the corrected program is written");
  session->OnCommand(command, [session, arguments] { return Correct(session, *arguments); });
}

}  // namespace sixpoint::cli
