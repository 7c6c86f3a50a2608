#include "cli/budget_report.h"
#include "cli/commands.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

namespace {

std::vector<HoleBudget> BudgetsOf(const inspection::v1::Inspection& result) {
  std::vector<HoleBudget> holes;
  for (const auto& hole : result.holes())
    if (hole.has_position_expanded_uncertainty_um())
      holes.push_back({hole.group() + "/" + hole.hole(), hole.position_expanded_uncertainty_um(), hole.budget()});
  return holes;
}

}  // namespace

void AddInspectionCommands(Command* app, Session* session) {
  Command* inspection = app->AddCommand("inspection", "Inspections that were made");
  inspection->RequireCommand();
  AddListCommand<InspectionService>(
      inspection, session, "Lists inspections, newest first", "inspection", &InspectionService::Stub::ListInspections,
      inspection::v1::ListInspectionsRequest(),
      Table({"inspection", "blade", "verdict", "positioned by", "by", "recorded"}),
      &inspection::v1::ListInspectionsResponse::inspections, [](const inspection::v1::Inspection& entry) {
        return Cells{IdText(entry.name()),         IdText(entry.blade()),
                     VerdictName(entry.verdict()), MethodText(entry.positioning().method()),
                     entry.requested_by(),         TimeText(entry.recorded_at())};
      });

  const auto id = std::make_shared<std::string>();
  Command* show = inspection->AddCommand("show", "Shows an inspection hole by hole");
  show->AddOption("ID", id.get(), "The inspection")->Required();
  session->OnCommand(show, [session, id] {
    inspection::v1::GetInspectionRequest request;
    request.set_name(NameText("inspections", *id));
    return CallAndPrint<InspectionService>(session, "inspection", &InspectionService::Stub::GetInspection, request,
                                           InspectionText)
        .status();
  });
  AddBudgetCommand<InspectionService>(inspection, session, "inspection", "position",
                                      &InspectionService::Stub::GetInspection, BudgetsOf);
}

}  // namespace sixpoint::cli
