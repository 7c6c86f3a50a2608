// `sixpoint efficacy`: whether a machine cuts where its corrections predict.
#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/table.h"
#include "sixpoint/inspection/v1/efficacy.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::EfficacyPeriod;
using inspection::v1::EfficacyService;
using inspection::v1::OffsetEstimate;

struct EfficacyArguments {
  std::string machine, part, calibration, since, until;
  int least_blades = 0, most_blades = 0;
};

std::string ComponentText(inspection::v1::OffsetComponent component) {
  return inspection::v1::OffsetComponent_Name(component).substr(std::string("OFFSET_COMPONENT_").size());
}

bool IsAngle(inspection::v1::OffsetComponent component) { return component >= inspection::v1::OFFSET_COMPONENT_A; }

// um, or thousandths of a degree.
std::string Thousandths(double value) { return Fixed(1e3 * value, 2); }

std::string ReasonText(inspection::v1::NotOffered reason) {
  switch (reason) {
    case inspection::v1::NOT_OFFERED_TOO_FEW_BLADES:
      return "not enough blades";
    case inspection::v1::NOT_OFFERED_NOT_SIGNIFICANT:
      return "the blades' scatter explains it";
    case inspection::v1::NOT_OFFERED_WITHIN_UNCERTAINTY:
      return "nothing is beyond its own uncertainty";
    case inspection::v1::NOT_OFFERED_DRIFTS:
      return "it moves over time";
    case inspection::v1::NOT_OFFERED_NEWEST_BLADE_OFF:
      return "the newest blade does not fit those before it";
    case inspection::v1::NOT_OFFERED_NOT_IN_FORCE:
      return "its calibrations or the machine's record are not those of now";
    default:
      return inspection::v1::NotOffered_Name(reason);
  }
}

std::string OffsetsText(const EfficacyPeriod& period) {
  Table table({"found less predicted", "unit", ">value", ">U (95 %)", ">u shared", ">of one blade", ">df", ""});
  for (const OffsetEstimate& offset : period.offsets()) {
    bool offered = false;
    for (const OffsetEstimate& one : period.offered_offset().components())
      offered |= one.component() == offset.component();
    table.AddRow({ComponentText(offset.component()), IsAngle(offset.component()) ? "0.001 deg" : "um",
                  Thousandths(offset.value()),
                  offset.has_expanded_uncertainty() ? Thousandths(offset.expanded_uncertainty()) : "-",
                  Thousandths(offset.shared_standard_uncertainty()),
                  offset.has_standard_deviation() ? Thousandths(offset.standard_deviation()) : "-",
                  offset.has_expanded_uncertainty() ? Fixed(offset.degrees_of_freedom(), 1) : "-",
                  offered ? "offered" : ""});
  }
  std::string text = table.ToText();
  if (!period.not_determined().empty()) {
    text += "not told by these holes:";
    for (const int component : period.not_determined())
      text += " " + ComponentText(static_cast<inspection::v1::OffsetComponent>(component));
    text += "\n";
  }
  if (period.position_test().has_p())
    text += "X, Y, Z together: p " + Significant(period.position_test().p()) + " (below " +
            Significant(period.position_test().level()) + " is significant)\n";
  if (period.angle_test().has_p()) text += "A, B together: p " + Significant(period.angle_test().p()) + "\n";
  return text;
}

std::string SpreadText(const EfficacyPeriod& period) {
  Table table({"spread, standard deviation", ">within a blade um", ">between blades um", ">holes' own um",
               ">trend um/day", ">from", ">to", ">p"});
  for (const auto& spread : period.spreads()) {
    std::vector<std::string> cells = {ComponentText(spread.component()),
                                      spread.has_within_um() ? Fixed(spread.within_um(), 2) : "-",
                                      spread.has_between_um() ? Fixed(spread.between_um(), 2) : "-",
                                      spread.has_holes_um() ? Fixed(spread.holes_um(), 2) : "-"};
    for (const auto& trend : period.trends())
      if (trend.component() == spread.component())
        cells.insert(cells.end(), {Fixed(trend.slope_um_per_day(), 3),
                                   trend.has_slope_lower_um_per_day() ? Fixed(trend.slope_lower_um_per_day(), 3) : "-",
                                   trend.has_slope_upper_um_per_day() ? Fixed(trend.slope_upper_um_per_day(), 3) : "-",
                                   Significant(trend.p()) + (trend.significant() ? " drifts" : "")});
    table.AddRow(std::move(cells));
  }
  return table.ToText();
}

std::string BladesText(const EfficacyPeriod& period) {
  Table table({"blade", "corrected", ">holes", ">reported cut", ">X um", ">Y um", ">Z um"});
  for (const auto& blade : period.blades())
    table.AddRow({IdText(blade.blade()), TimeText(blade.corrected_at()), std::to_string(blade.hole_count()),
                  std::to_string(blade.reported_count()), blade.has_x_mm() ? Thousandths(blade.x_mm()) : "-",
                  blade.has_y_mm() ? Thousandths(blade.y_mm()) : "-",
                  blade.has_z_mm() ? Thousandths(blade.z_mm()) : "-"});
  std::string text = table.ToText();
  if (period.has_newest_blade_p())
    text += "the newest against those before it: p " + Significant(period.newest_blade_p()) +
            (period.newest_blade_off() ? ", it does not fit" : "") + "\n";
  return text;
}

std::string HolesText(const EfficacyPeriod& period) {
  Table table({"off on every blade", ">blades", ">own X um", ">own Y um", ">own Z um", ">U (95 %) um", ">p by Holm"});
  for (const auto& hole : period.holes())
    if (hole.significant())
      table.AddRow({hole.hole(), std::to_string(hole.blade_count()), Thousandths(hole.own_in_machine_mm().x_mm()),
                    Thousandths(hole.own_in_machine_mm().y_mm()), Thousandths(hole.own_in_machine_mm().z_mm()),
                    hole.has_own_expanded_uncertainty_um() ? Fixed(hole.own_expanded_uncertainty_um(), 2) : "-",
                    Significant(hole.adjusted_p())});
  return table.empty() ? "no hole is off on every blade beyond chance\n" : table.ToText();
}

std::string PeriodText(const EfficacyPeriod& period) {
  std::string text = IdText(period.machine()) + ", scanner " + IdText(period.sensor_calibration()) + ", axes " +
                     IdText(period.rotation_calibration()) + (period.in_force() ? "" : ": not in force any more") +
                     "; " + std::to_string(period.blades_size()) + " blades, " + std::to_string(period.hole_count()) +
                     " holes\n";
  text += OffsetsText(period) + SpreadText(period) + BladesText(period) + HolesText(period);
  if (period.has_offered_offset()) {
    text += "offered as the machine's known offset:";
    for (const OffsetEstimate& one : period.offered_offset().components())
      text +=
          " " + ComponentText(one.component()) + " " +
          (IsAngle(one.component()) ? Fixed(one.value(), 5) + " +- " + Fixed(one.expanded_uncertainty(), 5) + " deg"
                                    : Fixed(one.value(), 4) + " +- " + Fixed(one.expanded_uncertainty(), 4) + " mm");
    return text + "; nothing applies it\n";
  }
  text += "no offset is offered: ";
  for (int i = 0; i < period.not_offered_size(); ++i)
    text += (i > 0 ? "; " : "") + ReasonText(static_cast<inspection::v1::NotOffered>(period.not_offered(i)));
  return text + "\n";
}

std::string EfficacyText(const inspection::v1::Efficacy& efficacy) {
  std::string text;
  for (const EfficacyPeriod& period : efficacy.periods()) text += (text.empty() ? "" : "\n") + PeriodText(period);
  if (efficacy.periods().empty()) text = "no inspected blade that " + efficacy.machine() + " cut by a correction\n";
  const auto& out = efficacy.left_out();
  const auto add = [&](int count, const char* what) {
    if (count > 0) text += "left out: " + std::to_string(count) + " " + what + "\n";
  };
  add(out.not_inspected(), "blades that were not inspected");
  add(out.withdrawn(), "blades that rest on a withdrawn calibration");
  add(out.positioning_open(), "blades whose positioning is open");
  add(out.no_hole(), "blades without a measured hole of this machine's");
  add(out.superseded_inspections(), "inspections that newer ones stand for");
  if (efficacy.truncated()) text += "there are more than were looked at: --since, --until, --most-blades\n";
  return text;
}

}  // namespace

void AddEfficacyCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<EfficacyArguments>();
  Command* command = app->AddCommand("efficacy", "Whether a machine cuts where its corrections predict");
  command->AddOption("MACHINE", &arguments->machine, "The machine that cut")->Required();
  command->AddOption("--part", &arguments->part, "Only blades of this part");
  command->AddOption("--calibration", &arguments->calibration, "Only corrections that rest on this calibration");
  command->AddOption("--since", &arguments->since, "Only corrections recorded then or later");
  command->AddOption("--until", &arguments->until, "Only corrections recorded before");
  command->AddOption("--least-blades", &arguments->least_blades, "Fewer offer nothing; default 5");
  command->AddOption("--most-blades", &arguments->most_blades, "The newest that are looked at; default 100");
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    inspection::v1::ComputeEfficacyRequest request;
    request.set_machine(NameText("machines", arguments->machine));
    if (!arguments->part.empty()) request.set_part(NameText("parts", arguments->part));
    if (!arguments->calibration.empty()) request.set_calibration(CalibrationNameText(arguments->calibration));
    const auto corrected = TimeRangeOf(arguments->since, arguments->until);
    if (!corrected.ok()) return corrected.status();
    if (corrected->has_from() || corrected->has_until()) *request.mutable_corrected() = *corrected;
    request.set_least_blades(arguments->least_blades);
    request.set_most_blades(arguments->most_blades);
    return CallAndPrint<EfficacyService>(session, "inspection", &EfficacyService::Stub::ComputeEfficacy, request,
                                         EfficacyText)
        .status();
  });
}

}  // namespace sixpoint::cli
