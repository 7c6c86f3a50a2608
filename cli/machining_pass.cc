// `sixpoint pass`: what machining to a shape left, and what is to be done now.
#include <optional>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/reports.h"
#include "sixpoint/correction/v1/machining_pass.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::MachiningPass;
using correction::v1::MachiningPassService;

std::string OutcomeText(const MachiningPass& pass) {
  return EnumText(correction::v1::MachiningPassOutcome_Name(pass.outcome()), "MACHINING_PASS_OUTCOME_");
}

std::string PassText(const MachiningPass& pass) {
  std::string text = pass.name() + ", pass " + std::to_string(pass.number()) + " of " + pass.blade() + " after " +
                     pass.correction() + ": " + OutcomeText(pass) + "\n";
  if (!pass.remark().empty()) text += pass.remark() + "\n";
  Table table({"region", ">seen %", ">left um", ">least um", ">most um", ">above lower um", ">below upper um",
               ">tool leaves um", ">gives way %"});
  const auto number = [](bool has, double value) { return has ? Fixed(value, 1) : std::string("-"); };
  for (const correction::v1::MachinedRegion& region : pass.regions())
    table.AddRow({region.region(), Fixed(100 * region.seen_part(), 1),
                  number(region.has_mean_rest_um(), region.mean_rest_um()),
                  number(region.has_least_rest_um(), region.least_rest_um()),
                  number(region.has_greatest_rest_um(), region.greatest_rest_um()),
                  number(region.has_least_lower_spare_um(), region.least_lower_spare_um()),
                  number(region.has_least_upper_spare_um(), region.least_upper_spare_um()),
                  number(region.has_offset_um(), region.offset_um()),
                  number(region.has_deflection_share(), 100 * region.deflection_share())});
  text += table.ToText();
  if (pass.outcome() == correction::v1::MACHINING_PASS_OUTCOME_ANOTHER_PASS)
    text += "next: sixpoint correct --registration " + IdText(pass.registration()) + " --model ID --pass " +
            IdText(pass.name()) + "\n";
  return text;
}

struct NextArguments {
  std::string correction, registration;
  std::optional<double> greatest_rest_mm;
};

void AddNextCommand(Command* pass, Session* session) {
  const auto arguments = std::make_shared<NextArguments>();
  Command* next = pass->AddCommand(
      "next", "Looks at what a cut correction left of its shape: done, another pass, or scrap; 4: not done");
  next->AddOption("CORRECTION", &arguments->correction, "The correction that was cut, by a reconstruction's shape")
      ->Required();
  next->AddOption("--registration", &arguments->registration, "The registration of what was scanned afterwards")
      ->Required();
  next->AddOption("--rest-mm", &arguments->greatest_rest_mm,
                  "How far the surface may stand above the shape; without it as the profile tolerances let it");
  session->OnCommand(next, [session, arguments]() -> absl::Status {
    correction::v1::NextPassRequest request;
    request.set_correction(NameText("corrections", arguments->correction));
    request.set_registration(NameText("registrations", arguments->registration));
    if (arguments->greatest_rest_mm) request.set_greatest_rest_mm(*arguments->greatest_rest_mm);
    request.set_request_id(NewRequestId());
    const auto made = CallAndPrint<MachiningPassService>(session, "correction", &MachiningPassService::Stub::NextPass,
                                                         request, PassText, "looking at what the pass left");
    if (made.ok() && made->outcome() != correction::v1::MACHINING_PASS_OUTCOME_DONE) session->MarkNotUsable();
    return made.status();
  });
}

}  // namespace

void AddMachiningPassCommands(Command* app, Session* session) {
  Command* pass = app->AddCommand("pass", "What machining to a blank's shape left, and what is to be done now");
  pass->RequireCommand();
  AddNextCommand(pass, session);
  AddListCommand<MachiningPassService>(
      pass, session, "Lists machining passes, newest first", "correction",
      &MachiningPassService::Stub::ListMachiningPasses, correction::v1::ListMachiningPassesRequest(),
      Table({"pass", "blade", ">number", "outcome", "by", "recorded"}),
      &correction::v1::ListMachiningPassesResponse::machining_passes, [](const MachiningPass& one) {
        return Cells{IdText(one.name()), IdText(one.blade()), std::to_string(one.number()),
                     OutcomeText(one),   one.requested_by(),  TimeText(one.recorded_at())};
      });
  const auto id = std::make_shared<std::string>();
  Command* show = pass->AddCommand("show", "Shows a machining pass region by region");
  show->AddOption("ID", id.get(), "The pass")->Required();
  session->OnCommand(show, [session, id] {
    correction::v1::GetMachiningPassRequest request;
    request.set_name(NameText("machining_passes", *id));
    return CallAndPrint<MachiningPassService>(session, "correction", &MachiningPassService::Stub::GetMachiningPass,
                                              request, PassText)
        .status();
  });
}

}  // namespace sixpoint::cli
