#include "cli/commands.h"
#include "cli/reports.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::cli {

using correction::v1::CorrectionService;

void AddCorrectionCommands(CLI::App* app, Session* session) {
  struct Arguments {
    std::string id, blade;
    int limit = 0;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* correction = app->add_subcommand("correction", "Corrections that were made");
  correction->require_subcommand(1);

  CLI::App* list = correction->add_subcommand("list", "Lists corrections, newest first");
  list->add_option("--blade", arguments->blade, "Only of this blade");
  AddLimitOption(list, &arguments->limit);
  session->OnCommand(list, [session, arguments] {
    correction::v1::ListCorrectionsRequest request;
    if (!arguments->blade.empty()) request.set_blade(NameText("blades", arguments->blade));
    return ListAndPrint<CorrectionService>(
        session, "correction", &CorrectionService::Stub::ListCorrections, request, arguments->limit,
        Table({"correction", "blade", "registration", "release", "usable until", "by", "recorded"}),
        &correction::v1::ListCorrectionsResponse::corrections, [](const correction::v1::Correction& entry) {
          return Cells{IdText(entry.name()),          IdText(entry.blade()),
                       IdText(entry.registration()),  EnumText(Release_Name(entry.release()), "RELEASE_"),
                       TimeText(entry.valid_until()), entry.requested_by(),
                       TimeText(entry.recorded_at())};
        });
  });

  CLI::App* show = correction->add_subcommand("show", "Shows a correction hole by hole");
  show->add_option("ID", arguments->id, "The correction")->required();
  session->OnCommand(show, [session, arguments] {
    correction::v1::GetCorrectionRequest request;
    request.set_name(NameText("corrections", arguments->id));
    return CallAndPrint<CorrectionService>(session, "correction", &CorrectionService::Stub::GetCorrection, request,
                                           CorrectionText)
        .status();
  });
}

}  // namespace sixpoint::cli
