// `sixpoint plan MACHINE PART`: how a machine scans a part.
#include <cstdio>
#include <optional>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "services/runtime/errors.h"
#include "sixpoint/registration/v1/measuring_plan.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using registration::v1::MeasuringPlan;
using registration::v1::MeasuringPlanService;

struct PlanArguments {
  std::string machine, part, station, out, table;
  bool six_points = false;
  std::optional<double> radius_mm, coverage, incidence_deg, margin_mm, clearance_mm, feed_mm_per_min, turn_mm_per_deg;
  std::optional<int> portions, output;
  std::vector<double> body;
};

void SetPoint(const double* from, geometry::v1::Point* to) {
  to->set_x_mm(from[0]);
  to->set_y_mm(from[1]);
  to->set_z_mm(from[2]);
}

registration::v1::PlanMeasurementRequest RequestOf(const PlanArguments& arguments) {
  registration::v1::PlanMeasurementRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_part(NameText("parts", arguments.part));
  request.set_station(arguments.station);
  request.set_six_points(arguments.six_points);
  if (arguments.radius_mm) request.set_region_radius_mm(*arguments.radius_mm);
  if (arguments.coverage) request.set_coverage(*arguments.coverage);
  if (arguments.incidence_deg) request.set_greatest_incidence_deg(*arguments.incidence_deg);
  if (arguments.margin_mm) request.set_margin_mm(*arguments.margin_mm);
  if (arguments.clearance_mm) request.set_clearance_mm(*arguments.clearance_mm);
  if (arguments.portions) request.set_most_portions(*arguments.portions);
  if (arguments.turn_mm_per_deg) request.set_rotary_travel_mm_per_deg(*arguments.turn_mm_per_deg);
  if (arguments.feed_mm_per_min) request.set_feed_mm_per_min(*arguments.feed_mm_per_min);
  if (arguments.output) request.set_output(*arguments.output);
  if (arguments.body.empty()) return request;
  SetPoint(arguments.body.data(), request.mutable_body()->mutable_low_mm());
  SetPoint(arguments.body.data() + 3, request.mutable_body()->mutable_high_mm());
  return request;
}

std::string Csv(double value) {
  char text[32];
  std::snprintf(text, sizeof text, ",%.4f", value);
  return text;
}

// One line a portion, in their order: what a scan's header states, and where all axes stand.
std::string TableText(const MeasuringPlan& plan) {
  std::string text = "portion,region,v0_x_mm,v0_y_mm,v0_z_mm,length_mm,seen_mm2";
  for (const char* place : {"enter", "start", "end", "leave"})
    for (const std::string& axis : plan.axes()) text += std::string(",") + place + "_" + axis;
  text += "\n";
  int number = 0;
  for (const registration::v1::PlannedPortion& portion : plan.portions()) {
    text += std::to_string(++number) + "," + CsvCell(portion.region()) + Csv(portion.v0_mm().x_mm()) +
            Csv(portion.v0_mm().y_mm()) + Csv(portion.v0_mm().z_mm()) + Csv(portion.length_mm()) +
            Csv(portion.seen_mm2());
    for (const auto* place : {&portion.enter(), &portion.start(), &portion.end(), &portion.leave()})
      for (const double value : *place) text += Csv(value);
    text += "\n";
  }
  return text;
}

std::string Percent(double part_mm2, double whole_mm2) { return Fixed(100 * part_mm2 / whole_mm2, 1); }

std::string PlanText(const MeasuringPlan& plan) {
  Table portions(
      {">portion", "region", ">a deg", ">b deg", ">V0 x mm", ">V0 y mm", ">V0 z mm", ">length mm", ">seen mm2"});
  int number = 0;
  for (const registration::v1::PlannedPortion& portion : plan.portions())
    portions.AddRow({std::to_string(++number), portion.region(), Fixed(portion.a_deg(), 3), Fixed(portion.b_deg(), 3),
                     Fixed(portion.v0_mm().x_mm(), 3), Fixed(portion.v0_mm().y_mm(), 3),
                     Fixed(portion.v0_mm().z_mm(), 3), Fixed(portion.length_mm(), 1), Fixed(portion.seen_mm2(), 1)});
  Table regions({"region", ">mm2", ">seen %", ">left out %", ">housing %", ">linear limits %", ">hidden %",
                 ">rotary limits %", ">too steep %"});
  for (const registration::v1::RegionCoverage& region : plan.regions()) {
    const double whole = region.wanted_mm2();
    regions.AddRow({region.region().empty() ? "whole part" : region.region(), Fixed(whole, 1),
                    Percent(region.seen_mm2(), whole), Percent(region.left_out_mm2(), whole),
                    Percent(region.clearance_mm2(), whole), Percent(region.travel_mm2(), whole),
                    Percent(region.hidden_mm2(), whole), Percent(region.beyond_rotary_mm2(), whole),
                    Percent(region.too_steep_mm2(), whole)});
  }
  return portions.ToText() + regions.ToText() + std::to_string(plan.portions_size()) + " sweeps of " +
         Fixed(plan.sweep_mm(), 0) + " mm, " + Fixed(plan.travel_mm(), 0) + " mm and " + Fixed(plan.turned_deg(), 0) +
         " deg between them; " + (plan.covered() ? "covered" : "NOT COVERED as far as was wanted") + "\n" +
         (plan.without_program().empty() ? "" : "no program: " + plan.without_program() + "\n") +
         (plan.assumed_axes().empty()
              ? ""
              : "REACH NOT CHECKED: the machine's record has no linear joints; X, Y, Z are taken along "
                "the machine's axes, without limits\n");
}

absl::Status Plan(Session* session, const PlanArguments& arguments) {
  for (const std::string* out : {&arguments.out, &arguments.table})
    if (absl::Status status = CheckOut(*session, *out); !status.ok()) return status;
  if (arguments.out == "-" && arguments.table == "-")
    return runtime::Refuse("--table", "-", "a file, or --out another");
  const auto plan = CallAtLength<MeasuringPlanService>(
      session, "planning", "registration", &MeasuringPlanService::Stub::PlanMeasurement, RequestOf(arguments));
  if (!plan.ok()) return plan.status();
  if (!arguments.out.empty() && !plan->nc_program().empty())
    if (absl::Status status = WriteOut(arguments.out, plan->nc_program()); !status.ok()) return status;
  if (!arguments.table.empty())
    if (absl::Status status = WriteOut(arguments.table, TableText(*plan)); !status.ok()) return status;
  if (session->json) {
    PrintJson(*plan);
  } else {
    std::ostream& beside = BesideOut(arguments.out == "-" ? arguments.out : arguments.table);
    beside << PlanText(*plan);
    if (!arguments.out.empty() && !plan->nc_program().empty())
      beside << "program written to " << OutText(arguments.out) << "\n";
    if (!arguments.table.empty()) beside << "table written to " << OutText(arguments.table) << "\n";
  }
  if (!plan->covered()) session->MarkNotUsable();
  return absl::OkStatus();
}

}  // namespace

void AddPlanCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<PlanArguments>();
  Command* command =
      app->AddCommand("plan", "Says how a machine scans a part: sweeps, what they see, and their program");
  command->AddOption("MACHINE", &arguments->machine, "Its id")->Required();
  command->AddOption("PART", &arguments->part, "Its id")->Required();
  command->AddOption("--station", &arguments->station,
                     "Where in the fixture the part stands; wanted where it has stations");
  Option* six_points =
      command->AddFlag("--six-points", &arguments->six_points, "Only the places about the six datum points");
  command->AddOption("--radius-mm", &arguments->radius_mm, "Of the surface about each datum point (3)")
      ->Needs(six_points);
  command->AddOption("--coverage", &arguments->coverage, "Enough of the surface to be seen, 0 to 1 (0.95)");
  command->AddOption("--incidence-deg", &arguments->incidence_deg, "Between beam and normal, at most (60)");
  command->AddOption("--margin-mm", &arguments->margin_mm, "How far the part may stand from where it is drawn (1.5)");
  command->AddOption("--clearance-mm", &arguments->clearance_mm, "Of the scanner's housing from the part (5)");
  command
      ->AddOption("--body-mm", &arguments->body,
                  "The housing in the sensor frame, X Y Z of its low and of its high corner")
      ->Count(6);
  command->AddOption("--portions", &arguments->portions, "At most so many (100)");
  command->AddOption("--turn-mm-per-deg", &arguments->turn_mm_per_deg,
                     "What a degree counts in the order's travel (1)");
  command->AddOption("--feed-mm-per-min", &arguments->feed_mm_per_min, "Of the program's sweeps (1800)");
  command->AddOption("--output", &arguments->output, "Of the control, on during a sweep: M62 P, M63 P (1)");
  command->AddOption("--table", &arguments->table, "Where the portions are written, a line each (CSV)");
  AddOutOption(command, &arguments->out, "Where the program is written");
  session->OnCommand(command, [session, arguments] { return Plan(session, *arguments); });
}

}  // namespace sixpoint::cli
