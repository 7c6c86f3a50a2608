// `sixpoint repair`: how a blade whose tip was welded on again is machined.
#include <optional>

#include "cli/commands.h"
#include "cli/download_command.h"
#include "cli/list_filters.h"
#include "cli/number_format.h"
#include "cli/reports.h"
#include "sixpoint/correction/v1/repair.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::Repair;
using correction::v1::RepairService;

std::string RepairSectionsText(const Repair& repair) {
  Table table({">z mm", "taken for", ">mean U um", ">greatest U um", ">left um", ">cut into um", ""});
  const auto number = [](bool has, double value, int places) { return has ? Fixed(value, places) : std::string("-"); };
  for (const correction::v1::RepairSection& one : repair.sections())
    table.AddRow({Fixed(one.z_mm(), 2),
                  EnumText(correction::v1::RepairSectionKind_Name(one.kind()), "REPAIR_SECTION_KIND_"),
                  number(one.has_mean_expanded_uncertainty_um(), one.mean_expanded_uncertainty_um(), 1),
                  number(one.has_greatest_expanded_uncertainty_um(), one.greatest_expanded_uncertainty_um(), 1),
                  number(one.has_greatest_rest_um(), one.greatest_rest_um(), 1),
                  number(one.has_deepest_cut_um(), one.deepest_cut_um(), 1), one.remark()});
  return table.ToText();
}

std::string RepairText(const Repair& repair) {
  const correction::v1::RepairRemoval& removal = repair.removal();
  std::string text = repair.name() + " of " + repair.blade() + " by " + repair.registration() + " (" +
                     MethodText(repair.registration_method()) + "): from " +
                     Significant(repair.heights().repair_line_mm()) + " to " +
                     Significant(repair.heights().target_mm()) + " mm\n" + RepairSectionsText(repair);
  text += Grouped(repair.points().below_line()) + " points below the line, " + Grouped(repair.points().above_line()) +
          " of the weld, " + Grouped(repair.points().left_out()) + " left out; the weld stands out by " +
          Fixed(repair.greatest_stock_mm(), 3) + " mm\n";
  text += std::to_string(repair.roughing_layer_count()) + " roughing layers, " + std::to_string(repair.lap_count()) +
          " laps " + Fixed(repair.step_over_mm(), 3) + " mm apart, " + Grouped(repair.place_count()) + " places, " +
          Fixed(1e-3 * repair.path_length_mm(), 2) + " m; lifted by " + Fixed(repair.greatest_lift_um(), 1) +
          " um at most\n";
  text += "simulated: " + Fixed(removal.deepest_below_line_um(), 2) + " um cut below the line; " +
          Fixed(removal.deepest_in_target_um(), 2) + " um into the target, " +
          Fixed(removal.deepest_beyond_uncertainty_um(), 2) + " um beyond U; " + Fixed(removal.greatest_rest_um(), 1) +
          " um left at most, " + Fixed(removal.mean_rest_um(), 1) + " um mean\n";
  return text + "next: sixpoint correct --registration " + IdText(repair.registration()) + " --model ID --repair " +
         IdText(repair.name()) + "\n";
}

struct PlanRepairArguments {
  std::string registration, extrapolation;
  double first_mm = 0, line_mm = 0, target_mm = 0, diameter_mm = 0, length_mm = 0;
  bool cornered_edges = false;
  std::optional<double> line_width_mm, farthest_mm, scallop_um, lead_deg, tilt_deg, depth_mm, allowance_mm, step_mm,
      guard_um, chord_um, turn_deg, uncertainty_um;
};

correction::v1::PlanRepairRequest RepairRequestOf(const PlanRepairArguments& arguments) {
  correction::v1::PlanRepairRequest request;
  request.set_registration(NameText("registrations", arguments.registration));
  request.set_request_id(NewRequestId());
  correction::v1::RepairHeights& heights = *request.mutable_heights();
  heights.set_first_mm(arguments.first_mm);
  heights.set_repair_line_mm(arguments.line_mm);
  heights.set_target_mm(arguments.target_mm);
  if (arguments.line_width_mm) heights.set_line_width_mm(*arguments.line_width_mm);
  request.mutable_mill()->set_diameter_mm(arguments.diameter_mm);
  request.mutable_mill()->set_length_mm(arguments.length_mm);
  correction::v1::RepairMethod& method = *request.mutable_method();
  if (!arguments.extrapolation.empty())
    method.set_extrapolation(static_cast<correction::v1::RepairExtrapolation>(
        ValueOf(*correction::v1::RepairExtrapolation_descriptor(), arguments.extrapolation)));
  method.set_cornered_edges(arguments.cornered_edges);
  if (arguments.farthest_mm) method.set_farthest_mm(*arguments.farthest_mm);
  if (arguments.scallop_um) method.set_scallop_um(*arguments.scallop_um);
  if (arguments.lead_deg) method.set_lead_deg(*arguments.lead_deg);
  if (arguments.tilt_deg) method.set_tilt_deg(*arguments.tilt_deg);
  if (arguments.depth_mm) method.set_depth_of_cut_mm(*arguments.depth_mm);
  if (arguments.allowance_mm) method.set_finish_allowance_mm(*arguments.allowance_mm);
  if (arguments.step_mm) method.set_roughing_step_mm(*arguments.step_mm);
  if (arguments.guard_um) method.set_guard_um(*arguments.guard_um);
  if (arguments.chord_um) method.set_chord_um(*arguments.chord_um);
  if (arguments.turn_deg) method.set_greatest_turn_deg(*arguments.turn_deg);
  if (arguments.uncertainty_um) method.set_greatest_uncertainty_um(*arguments.uncertainty_um);
  return request;
}

void AddPlanRepairCommand(Command* repair, Session* session) {
  const auto arguments = std::make_shared<PlanRepairArguments>();
  Command* plan = repair->AddCommand(
      "plan", "Continues what is left of a blade above its repair line, and plans the mill's way around that target");
  plan->AddOption("REGISTRATION", &arguments->registration, "The registration of the welded blade")->Required();
  plan->AddOption("--first-mm", &arguments->first_mm, "Height of the lowest section, above platform and fillet")
      ->Required();
  plan->AddOption("--line-mm", &arguments->line_mm, "The repair line: nothing is cut below that height")->Required();
  plan->AddOption("--target-mm", &arguments->target_mm, "Height where the target ends")->Required();
  plan->AddOption("--diameter-mm", &arguments->diameter_mm, "Of the ball-end mill")->Required();
  plan->AddOption("--length-mm", &arguments->length_mm, "From the ball's centre to the holder")->Required();
  plan->AddOption("--extrapolation", &arguments->extrapolation,
                  "How the target is continued; without it process-of-deviation")
      ->OneOf(WordsOf(*correction::v1::RepairExtrapolation_descriptor()));
  plan->AddFlag("--cornered-edges", &arguments->cornered_edges, "The edges are drawn with corners");
  plan->AddOption("--line-width-mm", &arguments->line_width_mm, "Between measured sections; without it 1");
  plan->AddOption("--farthest-mm", &arguments->farthest_mm,
                  "A point farther from the CAD is of something else; without it 5");
  plan->AddOption("--scallop-um", &arguments->scallop_um, "Of the ridges between finishing laps; without it 5");
  plan->AddOption("--lead-deg", &arguments->lead_deg, "The mill leans so far towards the feed; without it 0");
  plan->AddOption("--tilt-deg", &arguments->tilt_deg, "And so far towards the blade's tip; without it 50");
  plan->AddOption("--depth-of-cut-mm", &arguments->depth_mm, "Of a roughing layer; without it 0.5");
  plan->AddOption("--allowance-mm", &arguments->allowance_mm, "What roughing leaves; without it 0.1");
  plan->AddOption("--roughing-step-mm", &arguments->step_mm, "Between roughing laps; without it 1");
  plan->AddOption("--guard-um", &arguments->guard_um, "Kept clear of the surface below the line; without it 10");
  plan->AddOption("--chord-um", &arguments->chord_um, "Of the path between two places; without it 1");
  plan->AddOption("--turn-deg", &arguments->turn_deg, "Of the mill's axis between two places; without it 1.2");
  plan->AddOption("--uncertainty-um", &arguments->uncertainty_um,
                  "A target that is more uncertain anywhere is refused; without it 50");
  session->OnCommand(plan, [session, arguments]() -> absl::Status {
    return CallAndPrint<RepairService>(session, "correction", &RepairService::Stub::PlanRepair,
                                       RepairRequestOf(*arguments), RepairText, "planning the repair")
        .status();
  });
}

// The rows of a download's messages, which are counted from 0.
template <typename Request, typename Message, typename Csv>
absl::StatusOr<std::string> FetchRows(
    Session* session, const std::string& name, const char* head,
    std::unique_ptr<grpc::ClientReader<Message>> (RepairService::Stub::*method)(grpc::ClientContext*, const Request&),
    const Csv& csv_of) {
  Request request;
  request.set_name(name);
  std::string csv;
  int index = 0;
  const auto begin = [&] {
    csv = head;
    index = 0;
  };
  const auto take = [&](const Message& one) {
    csv += csv_of(one, index++);
    return absl::OkStatus();
  };
  absl::Status fetched =
      FetchEach<RepairService>(session, "downloading " + name, "correction", method, request, begin, take);
  if (!fetched.ok()) return fetched;
  return csv;
}

std::string Three(const google::protobuf::RepeatedField<double>& numbers, int place) {
  std::string cells;
  for (int k = 0; k < 3; ++k) cells += ShortestNumber(numbers.Get(3 * place + k)) + ",";
  return cells;
}

absl::StatusOr<std::string> FetchContours(Session* session, const std::string& name, const std::string&) {
  return FetchRows(session, name, "contour,x_mm,y_mm,z_mm,expanded_uncertainty_um,rest_um\n",
                   &RepairService::Stub::DownloadTargetContours,
                   [](const correction::v1::TargetContour& contour, int index) {
                     std::string rows;
                     for (int i = 0; i < contour.rest_um_size(); ++i)
                       rows += std::to_string(index) + "," + Three(contour.points_in_part_mm(), i) +
                               ShortestNumber(contour.expanded_uncertainties_um(i)) + "," +
                               ShortestNumber(contour.rest_um(i)) + "\n";
                     return rows;
                   });
}

absl::StatusOr<std::string> FetchLaps(Session* session, const std::string& name, const std::string&) {
  return FetchRows(session, name, "lap,allowance_mm,x_mm,y_mm,z_mm,axis_x,axis_y,axis_z\n",
                   &RepairService::Stub::DownloadRepairPath, [](const correction::v1::RepairLap& lap, int index) {
                     std::string rows;
                     for (int i = 0; i < lap.centres_in_part_mm_size() / 3; ++i) {
                       rows += std::to_string(index) + "," + ShortestNumber(lap.allowance_mm()) + "," +
                               Three(lap.centres_in_part_mm(), i) + Three(lap.axes_in_part(), i);
                       rows.back() = '\n';
                     }
                     return rows;
                   });
}

}  // namespace

void AddRepairCommands(Command* app, Session* session) {
  Command* repair = app->AddCommand("repair", "How blades whose worn tips were welded on again are machined");
  repair->RequireCommand();
  AddPlanRepairCommand(repair, session);
  AddListCommand<RepairService>(repair, session, "Lists repairs, newest first", "correction",
                                &RepairService::Stub::ListRepairs, correction::v1::ListRepairsRequest(),
                                Table({"repair", "blade", ">line mm", ">laps", ">weld mm", "by", "recorded"}),
                                &correction::v1::ListRepairsResponse::repairs, [](const Repair& one) {
                                  return Cells{IdText(one.name()),
                                               IdText(one.blade()),
                                               Fixed(one.heights().repair_line_mm(), 2),
                                               std::to_string(one.lap_count()),
                                               Fixed(one.greatest_stock_mm(), 3),
                                               one.requested_by(),
                                               TimeText(one.recorded_at())};
                                });
  const auto id = std::make_shared<std::string>();
  Command* show = repair->AddCommand("show", "Shows a repair height by height");
  show->AddOption("ID", id.get(), "The repair")->Required();
  session->OnCommand(show, [session, id] {
    correction::v1::GetRepairRequest request;
    request.set_name(NameText("repairs", *id));
    return CallAndPrint<RepairService>(session, "correction", &RepairService::Stub::GetRepair, request, RepairText)
        .status();
  });
  AddDownloadCommand(repair, session,
                     {"contours", "Writes the target with its uncertainty and what is left", "CSV file"}, "The repair",
                     "repairs", FetchContours);
  AddDownloadCommand(repair, session, {"path", "Writes the mill's way around the target", "CSV file"}, "The repair",
                     "repairs", FetchLaps);
}

}  // namespace sixpoint::cli
