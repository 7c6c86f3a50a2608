#include "cli/commands.h"
#include "cli/reports.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"

namespace sixpoint::cli {

using inspection::v1::InspectionService;

void AddInspectionCommands(CLI::App* app, Session* session) {
  struct Arguments {
    std::string id, blade;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* inspection = app->add_subcommand("inspection", "Inspections that were made");
  inspection->require_subcommand(1);

  CLI::App* list = inspection->add_subcommand("list", "Lists inspections, newest first");
  list->add_option("--blade", arguments->blade, "Only of this blade");
  AddLimitOption(list, &arguments->limit);
  session->OnCommand(list, [session, arguments] {
    inspection::v1::ListInspectionsRequest request;
    if (!arguments->blade.empty()) request.set_blade(NameText("blades", arguments->blade));
    return ListAndPrint<InspectionService>(
        session, "inspection", &InspectionService::Stub::ListInspections, request, arguments->limit,
        Table({"inspection", "blade", "verdict", "positioned by", "by", "recorded"}),
        &inspection::v1::ListInspectionsResponse::inspections, [](const inspection::v1::Inspection& entry) {
          return Cells{IdText(entry.name()),         IdText(entry.blade()),
                       VerdictName(entry.verdict()), MethodText(entry.positioning().method()),
                       entry.requested_by(),         TimeText(entry.recorded_at())};
        });
  });

  CLI::App* show = inspection->add_subcommand("show", "Shows an inspection hole by hole");
  show->add_option("ID", arguments->id, "The inspection")->required();
  session->OnCommand(show, [session, arguments] {
    inspection::v1::GetInspectionRequest request;
    request.set_name(NameText("inspections", arguments->id));
    return CallAndPrint<InspectionService>(session, "inspection", &InspectionService::Stub::GetInspection, request,
                                           InspectionText)
        .status();
  });
}

}  // namespace sixpoint::cli
