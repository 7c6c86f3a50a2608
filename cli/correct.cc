#include <absl/strings/numbers.h>
#include <absl/strings/str_split.h>

#include <iostream>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "cli/register_options.h"
#include "cli/reports.h"
#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::CorrectionService;

struct CorrectArguments {
  ScansToRegister scans;
  std::string registration, reconstruction, pass, repair, model, template_file, out;
  std::vector<std::string> groups, work_offsets, tools;
  bool dry_run = false;
};

// "G54=0,0,-5,0,0": X, Y, Z in mm, the two rotary axes in deg.
absl::Status AddWorkOffset(const std::string& text, correction::v1::CorrectRequest* request) {
  correction::v1::WorkOffset& offset = *request->add_work_offsets();
  const std::size_t equals = text.find('=');
  offset.set_code(text.substr(0, equals));
  const std::vector<std::string> parts =
      absl::StrSplit(equals == std::string::npos ? std::string() : text.substr(equals + 1), ',');
  double values[5] = {};
  bool sound = parts.size() == 5;
  for (std::size_t i = 0; sound && i < 5; ++i) sound = absl::SimpleAtod(parts[i], &values[i]);
  if (!sound) return runtime::Refuse("--work-offset", text, "CODE=X,Y,Z,A,B such as G54=0,0,0,0,0");
  offset.set_x_mm(values[0]);
  offset.set_y_mm(values[1]);
  offset.set_z_mm(values[2]);
  offset.set_a_deg(values[3]);
  offset.set_b_deg(values[4]);
  return absl::OkStatus();
}

// "1=120.5": a tool's number and its length in mm.
absl::Status AddTool(const std::string& text, correction::v1::CorrectRequest* request) {
  const std::size_t equals = text.find('=');
  correction::v1::ToolLength& tool = *request->add_tool_lengths();
  int number = 0;
  double length_mm = 0;
  if (equals == std::string::npos || !absl::SimpleAtoi(text.substr(0, equals), &number) ||
      !absl::SimpleAtod(text.substr(equals + 1), &length_mm))
    return runtime::Refuse("--tool", text, "NUMBER=LENGTH_MM such as 1=120.5");
  tool.set_number(number);
  tool.set_length_mm(length_mm);
  return absl::OkStatus();
}

absl::StatusOr<correction::v1::CorrectRequest> RequestOf(const CorrectArguments& arguments) {
  correction::v1::CorrectRequest request;
  for (const std::string& group : arguments.groups) request.add_groups(group);
  if (!arguments.model.empty()) request.set_machining_model(NameText("machining_models", arguments.model));
  if (!arguments.reconstruction.empty())
    request.set_reconstruction(NameText("reconstructions", arguments.reconstruction));
  if (!arguments.pass.empty()) request.set_machining_pass(NameText("machining_passes", arguments.pass));
  if (!arguments.repair.empty()) request.set_repair(NameText("repairs", arguments.repair));
  if (!arguments.template_file.empty()) {
    absl::StatusOr<std::string> nc_template = ReadFile(arguments.template_file, 1u << 20);
    if (!nc_template.ok()) return nc_template.status();
    request.set_nc_template(*nc_template);
  }
  for (const std::string& offset : arguments.work_offsets)
    if (absl::Status status = AddWorkOffset(offset, &request); !status.ok()) return status;
  for (const std::string& tool : arguments.tools)
    if (absl::Status status = AddTool(tool, &request); !status.ok()) return status;
  return request;
}

// By a registration that was made, or by one that is made of scans in the same call.
absl::StatusOr<correction::v1::Correction> Corrected(Session* session, const CorrectArguments& arguments) {
  auto request = RequestOf(arguments);
  if (!request.ok()) return request.status();
  if (arguments.scans.blade.empty()) {
    request->set_registration(NameText("registrations", arguments.registration));
    request->set_dry_run(arguments.dry_run);
    request->set_request_id(NewRequestId());
    correction::v1::Correction response;
    absl::Status status =
        session->Call<CorrectionService>("correction", &CorrectionService::Stub::Correct, *request, &response);
    if (!status.ok()) return status;
    return response;
  }
  auto registration = RegisterRequestOf(arguments.scans);
  if (!registration.ok()) return registration.status();
  correction::v1::CorrectScansRequest of_scans;
  *of_scans.mutable_registration() = *std::move(registration);
  *of_scans.mutable_correction() = *std::move(request);
  of_scans.set_request_id(NewRequestId());
  return CallAtLength<CorrectionService>(session, "correcting " + arguments.scans.blade, "correction",
                                         &CorrectionService::Stub::CorrectScans, of_scans);
}

absl::Status Correct(Session* session, const CorrectArguments& arguments) {
  if (!arguments.out.empty() && arguments.template_file.empty() && arguments.model.empty()) {
    return runtime::Refuse("--out", arguments.out, "--template or --model too: the program is made from it");
  }
  absl::Status status = CheckOut(*session, arguments.out);
  if (!status.ok()) return status;
  const absl::StatusOr<correction::v1::Correction> corrected = Corrected(session, arguments);
  if (!corrected.ok()) return corrected.status();
  const correction::v1::Correction& response = *corrected;
  const bool released = response.state() == correction::v1::CORRECTION_STATE_RELEASED;
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
  const bool usable = arguments.dry_run ? response.release() == correction::v1::RELEASE_AUTOMATIC : released;
  if (!usable) session->MarkNotUsable();
  return absl::OkStatus();
}

}  // namespace

void AddCorrectCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<CorrectArguments>();
  Command* command = app->AddCommand("correct", "Moves the machining program onto the real blade");
  Option* registration =
      command->AddOption("--registration", &arguments->registration, "The registration to correct by");
  const ScansToRegisterOptions scans = AddScansToRegister(command, &arguments->scans);
  command->AddOption("--groups", &arguments->groups, "Only these hole groups: G1,G2,...")->List();
  command->AddOption("--template", &arguments->template_file, "NC program whose coordinates are replaced");
  command->AddOption("--model", &arguments->model,
                     "Machining model, ID or ID@REVISION, whose template, offsets, tools and electrodes are taken");
  Option* reconstruction =
      command->AddOption("--reconstruction", &arguments->reconstruction,
                         "Reconstruction of that registration whose shape the model's paths go with");
  Option* pass = command->AddOption("--pass", &arguments->pass,
                                    "Machining pass of that registration: the model's paths go once more with its "
                                    "shape, commanded by what it left");
  Option* repair = command->AddOption("--repair", &arguments->repair,
                                      "Repair of that registration along whose laps the tool goes, as the model's one "
                                      "path is led");
  command->AddOption("--work-offset", &arguments->work_offsets,
                     "What the control holds for a code that the template calls: G54=X,Y,Z,A,B (repeatable)");
  command->AddOption("--tool", &arguments->tools,
                     "A tool whose length the template takes into account (G43 H): NUMBER=LENGTH_MM (repeatable)");
  command->AddFlag("--dry-run", &arguments->dry_run, "Says what would be, and records nothing")->Excludes(scans.blade);
  reconstruction->Needs(registration);
  pass->Needs(registration)->Excludes(reconstruction);
  repair->Needs(registration)->Excludes(reconstruction)->Excludes(pass);
  registration->Excludes(scans.blade);
  for (Option* other : {scans.scans, scans.method, scans.axis_tables, scans.clamping}) other->Needs(scans.blade);
  for (Option* other : scans.how) other->Needs(scans.blade);
  command->RequireAlso([=]() -> std::string {
    if (registration->given()) return "";
    if (!scans.blade->given()) return "--registration, or --blade with its --scans";
    if (!scans.scans->given()) return "--scans";
    return scans.method->given() ? "" : "--method";
  });
  AddOutOption(command, &arguments->out, "Where the corrected program is written");
  session->OnCommand(command, [session, arguments] { return Correct(session, *arguments); });
}

}  // namespace sixpoint::cli
