#include <iostream>

#include "cli/budget_report.h"
#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::cli {

using correction::v1::CorrectionService;

namespace {

struct DecidedCorrection {
  std::string correction, reason;
};

template <typename Request>
Request RequestOf(const DecidedCorrection& decision) {
  Request request;
  request.set_name(NameText("corrections", decision.correction));
  request.set_reason(decision.reason);
  request.set_request_id(NewRequestId());
  return request;
}

void AddDecisionCommands(Command* correction, Session* session) {
  const auto decision = std::make_shared<DecidedCorrection>();
  Command* release = correction->AddCommand("release", "Lets a draft's program be used, in spite of what did not pass");
  Command* refuse = correction->AddCommand("refuse", "Stops a correction for ever");
  for (Command* command : {release, refuse}) {
    command->AddOption("ID", &decision->correction, "The correction")->Required();
    command->AddOption("--reason", &decision->reason, "Kept in the record")->Required();
  }
  session->OnCommand(release, [session, decision] {
    return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::ReleaseCorrection,
                                           RequestOf<correction::v1::ReleaseCorrectionRequest>(*decision),
                                           CorrectionText)
        .status();
  });
  session->OnCommand(refuse, [session, decision] {
    return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::RefuseCorrection,
                                           RequestOf<correction::v1::RefuseCorrectionRequest>(*decision),
                                           CorrectionText)
        .status();
  });
}

struct FetchArguments {
  std::string correction, machine, blade, clamping, out, folder;
};

std::string FetchText(const correction::v1::FetchProgramResponse& fetched) {
  return fetched.name() + ": program of " + fetched.correction() + ", " + Grouped(fetched.hole_count()) + " holes" +
         (fetched.cut_count() > 0 ? ", " + Grouped(fetched.cut_count()) + " cut before and left out" : "") +
         "\nSHA-256 " + fetched.program_sha256() + "\nnot to be used after " + TimeText(fetched.usable_until()) + "\n";
}

// As a control's folder takes it: {blade}.nc, whole or not there.
absl::Status Fetch(Session* session, const FetchArguments& arguments) {
  std::string out = arguments.out;
  if (!arguments.folder.empty()) out = arguments.folder + "/" + IdText(arguments.blade) + ".nc";
  absl::Status status = CheckOut(*session, out);
  if (!status.ok()) return status;
  correction::v1::FetchProgramRequest request;
  request.set_name(NameText("corrections", arguments.correction));
  request.set_machine(NameText("machines", arguments.machine));
  request.set_blade(NameText("blades", arguments.blade));
  request.set_clamping(arguments.clamping);
  request.set_request_id(NewRequestId());
  correction::v1::FetchProgramResponse fetched;
  status = session->Call<CorrectionService>("correction", &CorrectionService::Stub::FetchProgram, request, &fetched);
  if (!status.ok()) return status;
  if (!out.empty())
    if (status = WriteOut(out, fetched.nc_program()); !status.ok()) return status;
  if (session->json) {
    PrintJson(fetched);
    return absl::OkStatus();
  }
  std::ostream& beside = BesideOut(out);
  beside << FetchText(fetched);
  out.empty() ? beside << fetched.nc_program() : beside << "program written to " << OutText(out) << "\n";
  return absl::OkStatus();
}

void AddFetchCommand(Command* correction, Session* session) {
  const auto arguments = std::make_shared<FetchArguments>();
  Command* fetch = correction->AddCommand("fetch", "The released program, or what is left of it once holes were cut");
  fetch->AddOption("ID", &arguments->correction, "The correction")->Required();
  fetch->AddOption("--machine", &arguments->machine, "That is to carry it out")->Required();
  fetch->AddOption("--blade", &arguments->blade, "That is clamped there")->Required();
  fetch->AddOption("--clamping", &arguments->clamping, "In which it stands, where the registration states one");
  Option* out = AddOutOption(fetch, &arguments->out, "Where the program is written");
  fetch->AddOption("--folder", &arguments->folder, "A control's folder: the program becomes SERIAL.nc there")
      ->Excludes(out);
  session->OnCommand(fetch, [session, arguments] { return Fetch(session, *arguments); });
}

struct CutArguments {
  std::string correction;
  std::vector<std::string> holes;
};

absl::Status ReportCut(Session* session, const CutArguments& arguments) {
  correction::v1::ReportCutRequest request;
  request.set_name(NameText("corrections", arguments.correction));
  for (const std::string& name : arguments.holes) {
    const std::size_t slash = name.find('/');
    if (slash == std::string::npos) return runtime::Refuse("--holes", name, "GROUP/HOLE such as G1/H3");
    correction::v1::CutHole& hole = *request.add_holes();
    hole.set_group(name.substr(0, slash));
    hole.set_hole(name.substr(slash + 1));
  }
  request.set_request_id(NewRequestId());
  return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::ReportCut, request,
                                         CorrectionText)
      .status();
}

void AddCutCommand(Command* correction, Session* session) {
  const auto arguments = std::make_shared<CutArguments>();
  Command* cut = correction->AddCommand("cut", "Records which holes were cut");
  cut->AddOption("ID", &arguments->correction, "The correction")->Required();
  cut->AddOption("--holes", &arguments->holes, "GROUP/HOLE,GROUP/HOLE,...")->List()->Required();
  session->OnCommand(cut, [session, arguments] { return ReportCut(session, *arguments); });
}

std::string DrawnText(bool drawn, double value_um) { return drawn ? Fixed(value_um, 2) : "-"; }

// First order and draws side by side: a line a hole, and below it one for each source.
std::string DrawsText(const correction::v1::Budget& budget) {
  Table table(
      {"hole, source", ">first order um", ">drawn um", ">95 % of it", ">share", ">degrees of freedom", ">allowed um"});
  for (const correction::v1::HoleBudget& hole : budget.holes()) {
    const bool drawn = hole.has_drawn_expanded_uncertainty_um();
    table.AddRow({hole.group() + "/" + hole.hole() + ", U95", Fixed(hole.expanded_uncertainty_um(), 2),
                  DrawnText(drawn, hole.drawn_expanded_uncertainty_um()),
                  drawn ? Fixed(hole.drawn_low_um(), 2) + " to " + Fixed(hole.drawn_high_um(), 2) : "-", "", "",
                  Fixed(hole.position_tolerance_um(), 1)});
    for (const correction::v1::BudgetLine& line : hole.lines())
      table.AddRow({"  " + line.source(), Fixed(line.standard_uncertainty_um(), 2),
                    DrawnText(line.has_drawn_standard_uncertainty_um(), line.drawn_standard_uncertainty_um()), "",
                    Fixed(100 * line.share(), 1) + " %",
                    line.has_degrees_of_freedom() ? Fixed(line.degrees_of_freedom(), 1) : "", ""});
  }
  return table.ToText() + Grouped(budget.draws()) + " draws of every source through the whole chain\n";
}

void AddDrawsCommand(Command* correction, Session* session) {
  const auto id = std::make_shared<std::string>();
  const auto count = std::make_shared<int>(0);
  Command* draws = correction->AddCommand(
      "draws", "Draws every source of uncertainty through the whole chain, beside the budget of first order");
  draws->AddOption("ID", id.get(), "The correction")->Required();
  draws->AddOption("--count", count.get(), "How many: 1000 to 200000; usually 10000");
  session->OnCommand(draws, [session, id, count] {
    correction::v1::ComputeBudgetRequest request;
    request.set_name(NameText("corrections", *id));
    request.set_draws(*count);
    return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::ComputeBudget, request,
                                           DrawsText, "drawing")
        .status();
  });
}

std::vector<HoleBudget> CorrectedBudgets(const correction::v1::Correction& result) {
  std::vector<HoleBudget> holes;
  for (const auto& group : result.groups())
    for (const auto& hole : group.holes())
      holes.push_back({group.group() + "/" + hole.hole(), hole.expanded_uncertainty_um(), hole.budget()});
  return holes;
}

}  // namespace

void AddCorrectionCommands(Command* app, Session* session) {
  Command* correction = app->AddCommand("correction", "Corrections that were made");
  correction->RequireCommand();
  AddListCommand<CorrectionService>(
      correction, session, "Lists corrections, newest first", "correction", &CorrectionService::Stub::ListCorrections,
      correction::v1::ListCorrectionsRequest(),
      Table({"correction", "blade", "registration", "state", "usable until", "by", "recorded"}),
      &correction::v1::ListCorrectionsResponse::corrections, [](const correction::v1::Correction& entry) {
        return Cells{IdText(entry.name()),           IdText(entry.blade()),
                     IdText(entry.registration()),   EnumText(CorrectionState_Name(entry.state()), "CORRECTION_STATE_"),
                     TimeText(entry.usable_until()), entry.requested_by(),
                     TimeText(entry.recorded_at())};
      });

  const auto id = std::make_shared<std::string>();
  Command* show = correction->AddCommand("show", "Shows a correction hole by hole");
  show->AddOption("ID", id.get(), "The correction")->Required();
  session->OnCommand(show, [session, id] {
    correction::v1::GetCorrectionRequest request;
    request.set_name(NameText("corrections", *id));
    return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::GetCorrection, request,
                                           CorrectionText)
        .status();
  });
  AddBudgetCommand<CorrectionService>(correction, session, "correction", "start",
                                      &CorrectionService::Stub::GetCorrection, CorrectedBudgets);
  AddDrawsCommand(correction, session);
  AddDecisionCommands(correction, session);
  AddFetchCommand(correction, session);
  AddCutCommand(correction, session);
}

}  // namespace sixpoint::cli
