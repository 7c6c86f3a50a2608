#include "cli/commands.h"
#include "cli/reports.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"

namespace sixpoint::cli {

using correction::v1::CorrectionService;

void AddCorrectionCommands(Command* app, Session* session) {
  Command* correction = app->AddCommand("correction", "Corrections that were made");
  correction->RequireCommand();
  AddListCommand<CorrectionService>(
      correction, session, "Lists corrections, newest first", "correction", &CorrectionService::Stub::ListCorrections,
      correction::v1::ListCorrectionsRequest(),
      Table({"correction", "blade", "registration", "release", "usable until", "by", "recorded"}),
      &correction::v1::ListCorrectionsResponse::corrections, [](const correction::v1::Correction& entry) {
        return Cells{IdText(entry.name()),          IdText(entry.blade()),
                     IdText(entry.registration()),  EnumText(Release_Name(entry.release()), "RELEASE_"),
                     TimeText(entry.valid_until()), entry.requested_by(),
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
}

}  // namespace sixpoint::cli
