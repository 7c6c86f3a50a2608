#include "cli/budget_report.h"
#include "cli/commands.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/disposition.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

namespace {

std::vector<HoleBudget> InspectedBudgets(const inspection::v1::Inspection& result) {
  std::vector<HoleBudget> holes;
  for (const auto& hole : result.holes())
    if (hole.has_position_expanded_uncertainty_um())
      holes.push_back({hole.group() + "/" + hole.hole(), hole.position_expanded_uncertainty_um(), hole.budget()});
  return holes;
}

std::string KindText(const inspection::v1::Disposition& disposition) {
  return EnumText(inspection::v1::DispositionKind_Name(disposition.kind()), "DISPOSITION_KIND_");
}

std::string DispositionText(const inspection::v1::Disposition& disposition) {
  return KindText(disposition) + " of " + disposition.blade() + " by " + disposition.requested_by() + ", " +
         TimeText(disposition.recorded_at()) + ": " + disposition.reason() +
         (disposition.reference().empty() ? "" : " (" + disposition.reference() + ")") + "\n";
}

std::string ShownText(const inspection::v1::Inspection& result) {
  std::string text = InspectionText(result);
  for (const inspection::v1::Disposition& disposition : result.dispositions()) text += DispositionText(disposition);
  return text;
}

void AddDisposeCommand(Command* inspection, Session* session) {
  struct Arguments {
    std::string id, as, reason, reference;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* dispose = inspection->AddCommand("dispose", "What is to become of the blade, beside the verdict");
  dispose->AddOption("ID", &arguments->id, "The inspection")->Required();
  dispose->AddOption("--as", &arguments->as, "What is decided")
      ->Required()
      ->OneOf(WordsOf(*inspection::v1::DispositionKind_descriptor()));
  dispose->AddOption("--reason", &arguments->reason, "Why")->Required();
  dispose->AddOption("--reference", &arguments->reference, "A number elsewhere; of a concession its own");
  session->OnCommand(dispose, [session, arguments] {
    inspection::v1::DisposeRequest request;
    request.set_inspection(NameText("inspections", arguments->id));
    request.set_kind(static_cast<inspection::v1::DispositionKind>(
        ValueOf(*inspection::v1::DispositionKind_descriptor(), arguments->as)));
    request.set_reason(arguments->reason);
    request.set_reference(arguments->reference);
    request.set_request_id(NewRequestId());
    return CallAndPrint<inspection::v1::DispositionService>(
               session, "inspection", &inspection::v1::DispositionService::Stub::Dispose, request, DispositionText)
        .status();
  });
}

}  // namespace

void AddInspectionCommands(Command* app, Session* session) {
  Command* inspection = app->AddCommand("inspection", "Inspections that were made");
  inspection->RequireCommand();
  AddListCommand<InspectionService>(
      inspection, session, "Lists inspections, newest first", "inspection", &InspectionService::Stub::ListInspections,
      inspection::v1::ListInspectionsRequest(),
      Table({"inspection", "blade", "verdict", "disposition", "work order", "positioned by", "by", "recorded"}),
      &inspection::v1::ListInspectionsResponse::inspections, [](const inspection::v1::Inspection& entry) {
        return Cells{IdText(entry.name()),         IdText(entry.blade()),
                     VerdictName(entry.verdict()), entry.dispositions().empty() ? "-" : KindText(entry.dispositions(0)),
                     entry.work_order(),           MethodText(entry.positioning().method()),
                     entry.requested_by(),         TimeText(entry.recorded_at())};
      });

  const auto id = std::make_shared<std::string>();
  Command* show = inspection->AddCommand("show", "Shows an inspection hole by hole");
  show->AddOption("ID", id.get(), "The inspection")->Required();
  session->OnCommand(show, [session, id] {
    inspection::v1::GetInspectionRequest request;
    request.set_name(NameText("inspections", *id));
    return CallAndPrint<InspectionService>(session, "inspection", &InspectionService::Stub::GetInspection, request,
                                           ShownText)
        .status();
  });
  AddDisposeCommand(inspection, session);
  AddBudgetCommand<InspectionService>(inspection, session, "inspection", "position",
                                      &InspectionService::Stub::GetInspection, InspectedBudgets);
}

}  // namespace sixpoint::cli
