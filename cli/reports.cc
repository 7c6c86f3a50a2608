#include "cli/reports.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "cli/calibrate_probe.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "refusal/message_text.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::Calibration;
using geometry::v1::Point;

double Norm(const google::protobuf::RepeatedField<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares);
}

std::string SensorText(const calibration::v1::SensorCalibration& sensor) {
  Table table({"parameter", ">value", ">standard uncertainty", "unit"});
  table.AddRow({"alpha", Fixed(sensor.alpha_deg(), 5), FixedOrTiny(sensor.alpha_standard_uncertainty_deg(), 5), "deg"});
  table.AddRow({"beta", Fixed(sensor.beta_deg(), 5), FixedOrTiny(sensor.beta_standard_uncertainty_deg(), 5), "deg"});
  table.AddRow({"gamma", Fixed(sensor.gamma_deg(), 5), FixedOrTiny(sensor.gamma_standard_uncertainty_deg(), 5), "deg"});
  const Point& t = sensor.t_sm_mm();
  const Point& u = sensor.t_sm_standard_uncertainty_mm();
  table.AddRow({"T_sm x", Fixed(t.x_mm(), 5), FixedOrTiny(u.x_mm(), 5), "mm"});
  table.AddRow({"T_sm y", Fixed(t.y_mm(), 5), FixedOrTiny(u.y_mm(), 5), "mm"});
  table.AddRow({"T_sm z", Fixed(t.z_mm(), 5), FixedOrTiny(u.z_mm(), 5), "mm"});
  if (!sensor.certificate().empty()) return table.ToText() + "as stated by " + sensor.certificate() + "\n";
  std::string text = table.ToText() + "residual rms " + FixedOrTiny(sensor.residual_rms_um(), 3) +
                     " um, condition number " + Fixed(sensor.condition_number(), 1) + "\n";
  if (sensor.has_field_left_um())
    text += "scanner's field: stated " + FixedOrTiny(sensor.field_stated_um(), 2) + " um, found " +
            FixedOrTiny(Norm(sensor.field_terms_um()), 2) + " um and taken off, " +
            FixedOrTiny(sensor.field_left_um(), 2) + " um left (rms)\n";
  Table check({"check: laser minus touch", "scan", ">dx um", ">dy um", ">dz um"});
  for (const auto& residual : sensor.check()) {
    check.AddRow({residual.feature(), IdText(residual.scan()), Fixed(residual.dx_um(), 2), Fixed(residual.dy_um(), 2),
                  Fixed(residual.dz_um(), 2)});
  }
  return text + (check.empty() ? "" : check.ToText());
}

// Both error curves, where the residuals are there.
std::string ErrorCurvesText(const calibration::v1::RotationCalibration& rotation) {
  Table table({">" + (rotation.axes_size() == 2 ? rotation.axes(0) : std::string("A")) + " deg",
               ">" + (rotation.axes_size() == 2 ? rotation.axes(1) : std::string("B")) + " deg", ">before um",
               ">after um", "use"});
  for (const auto& pose : rotation.residuals()) {
    table.AddRow({Fixed(pose.a_deg(), 3), Fixed(pose.b_deg(), 3),
                  pose.has_before_um() ? Fixed(pose.before_um(), 2) : "-", Fixed(pose.distance_um(), 2),
                  pose.held_out() ? "check" : "fit"});
  }
  return table.empty() ? "" : table.ToText();
}

std::string RotationText(const calibration::v1::RotationCalibration& rotation) {
  Table table({"axis", "direction", "point mm"});
  const bool named = rotation.axes_size() == 2;
  for (const auto& [name, axis] : {std::pair(named ? rotation.axes(0) : std::string("A"), &rotation.a_axis()),
                                   std::pair(named ? rotation.axes(1) : std::string("B"), &rotation.b_axis())}) {
    const auto& d = axis->direction();
    table.AddRow(
        {name, Fixed(d.x(), 7) + ", " + Fixed(d.y(), 7) + ", " + Fixed(d.z(), 7), PointText(axis->point_mm(), 5)});
  }
  const bool known = rotation.has_point_c_standard_uncertainty_mm();
  return table.ToText() + "Point C " + PointText(rotation.point_c_mm(), 5) + " mm" +
         (known ? ", standard uncertainty " + PointText(rotation.point_c_standard_uncertainty_mm(), 5) + " mm" : "") +
         "\nresidual rms " + FixedOrTiny(rotation.residual_rms_um(), 3) + " um; check rms " +
         (rotation.check_count() > 0 ? FixedOrTiny(rotation.check_rms_um(), 3) + " um over " : std::string("- over ")) +
         std::to_string(rotation.check_count()) + " poses held out; condition number " +
         Fixed(rotation.condition_number(), 1) + "\n" + ErrorCurvesText(rotation);
}

std::string AxisText(const calibration::v1::AxisCharacterisation& axis) {
  constexpr int kDecimals = 6;
  const auto period = [](const calibration::v1::PeriodicError& error) {
    return " every " + Fixed(error.period_deg(), 4) + " deg";
  };
  Table table({axis.axis() + " axis", ">deg", ">standard uncertainty deg"});
  const auto add = [&](const std::string& name, const calibration::v1::AngleEstimate& estimate) {
    // Digits below what is known of it would be read as a figure.
    const bool known = std::abs(estimate.value_deg()) > estimate.standard_uncertainty_deg();
    table.AddRow({name, known ? FixedOrTiny(estimate.value_deg(), kDecimals) : Fixed(estimate.value_deg(), kDecimals),
                  FixedOrTiny(estimate.standard_uncertainty_deg(), kDecimals)});
  };
  add("reversal error", axis.reversal());
  if (axis.has_periodic())
    add("periodic error, amplitude" + period(axis.periodic()), axis.periodic().amplitude());
  else
    table.AddRow({"periodic error: none above", FixedOrTiny(axis.least_detectable_deg(), kDecimals), "-"});
  add("long wave, amplitude" + period(axis.long_wave()), axis.long_wave().amplitude());
  add("mean error", axis.mean());
  add("greatest error, at " + Fixed(axis.greatest_error_at_deg(), 3) + " deg " +
          (axis.greatest_error_travel() == calibration::v1::TRAVEL_FORWARD ? "forward" : "backward"),
      axis.greatest_error());
  add("standard uncertainty of a position", axis.standard_uncertainty());
  add("the same, table applied", axis.compensated_standard_uncertainty());
  add("one reading about the model", axis.noise());
  std::string text = std::to_string(axis.reading_count()) + " readings";
  if (axis.beyond_limits_count() > 0)
    text += ", " + std::to_string(axis.beyond_limits_count()) + " of them beyond the axis's limits in the record";
  return text + "\n" + table.ToText() + "table: " + std::to_string(axis.table().forward_error_deg_size()) +
         " values each way, every " + Fixed(axis.table().step_deg(), 4) + " deg; standard uncertainty of one " +
         FixedOrTiny(axis.table().standard_uncertainty_deg(), kDecimals) + " deg\n";
}

}  // namespace

std::string MethodText(registration::v1::Method method) { return EnumText(Method_Name(method), "METHOD_"); }
std::string OutcomeName(registration::v1::Outcome outcome) {
  return Outcome_Name(outcome).substr(std::string("OUTCOME_").size());
}
std::string VerdictName(inspection::v1::Verdict verdict) {
  return Verdict_Name(verdict).substr(std::string("VERDICT_").size());
}

std::string CalibrationKindText(const Calibration& calibration) {
  return EnumText(CalibrationKind_Name(calibration.kind()), "CALIBRATION_KIND_") +
         (calibration.has_axis() ? " " + calibration.axis().axis() : "");
}

std::string CalibrationText(const Calibration& calibration) {
  std::string text = calibration.name() + ": " + CalibrationKindText(calibration) + " of " + calibration.machine() +
                     ", " + calibration.method() + ", valid " + TimeText(calibration.valid_from()) + " to " +
                     TimeText(calibration.valid_until()) + "\n";
  text += EnumText(CalibrationState_Name(calibration.state()), "CALIBRATION_STATE_");
  if (!calibration.superseded_by().empty()) text += " by " + calibration.superseded_by();
  if (calibration.has_withdrawal())
    text += " by " + calibration.withdrawal().requested_by() + ": " + calibration.withdrawal().reason();
  if (calibration.environment().has_temperature_c())
    text += ", " + Fixed(calibration.environment().temperature_c(), 1) + " C";
  if (calibration.has_interim_check())
    text += ", newest interim check " +
            EnumText(StudyVerdict_Name(calibration.interim_check().verdict()), "STUDY_VERDICT_") + " (" +
            calibration.interim_check().study() + ")";
  text += "\n";
  for (const calibration::v1::ResidualJudgement& judged : calibration.judgements())
    text += judged.of() + ": " + Fixed(judged.ratio(), 2) + " times what is expected of " + Fixed(judged.count(), 0) +
            ", " +
            (judged.agrees() ? "as chance has it"
                             : "which chance does once in " + Fixed(1 / std::max(judged.probability(), 1e-9), 0) +
                                   ": look at it, then `calibration release`") +
            "\n";
  if (calibration.has_sensor()) text += SensorText(calibration.sensor());
  if (calibration.has_rotation()) text += RotationText(calibration.rotation());
  if (calibration.has_probe()) text += ProbeText(calibration.probe());
  if (calibration.has_axis()) text += AxisText(calibration.axis());
  return text;
}

Table RegistrationTable() {
  return Table({"blade", "method", "outcome", ">points", ">used", ">overlap %", ">iterations", ">rms um", ">sigma um",
                ">condition", ">s"});
}

void AddRegistrationRow(const std::string& blade, const std::string& method,
                        const registration::v1::Registration& registration, Table* table) {
  const auto& evidence = registration.evidence();
  table->AddRow({blade, method, OutcomeName(evidence.outcome()), Grouped(evidence.point_count()),
                 Grouped(evidence.points_used()), Fixed(100 * evidence.overlap(), 1),
                 std::to_string(evidence.iteration_count()), FixedOrNone(evidence.residual_rms_um(), 3),
                 FixedOrNone(evidence.residual_sigma_um(), 3), FixedOrNone(evidence.condition_number(), 1),
                 Fixed(evidence.seconds(), 2)});
}

Table CorrectionTable(const std::string& first, const std::string& bed, const std::string& carried) {
  return Table({first, "group", "hole", ">nominal X", ">Y", ">Z", ">" + bed, ">" + carried, ">corrected X", ">Y", ">Z",
                ">" + bed, ">" + carried, ">U95 um"});
}

void AddCorrectionRows(const std::string& label, const correction::v1::Correction& correction, Table* table) {
  for (const auto& group : correction.groups()) {
    for (const auto& hole : group.holes()) {
      const Point& n = hole.nominal_start_mm();
      const Point& c = hole.start_mm();
      table->AddRow({label, group.group(), hole.hole(), Fixed(n.x_mm(), 4), Fixed(n.y_mm(), 4), Fixed(n.z_mm(), 4),
                     Fixed(group.a_nominal_deg(), 4), Fixed(group.b_nominal_deg(), 4), Fixed(c.x_mm(), 4),
                     Fixed(c.y_mm(), 4), Fixed(c.z_mm(), 4), Fixed(group.a_deg(), 4), Fixed(group.b_deg(), 4),
                     Fixed(hole.expanded_uncertainty_um(), 2)});
    }
  }
}

namespace {

// The gate's questions; what did not pass is marked.
std::string ChecksText(const correction::v1::Correction& correction) {
  if (correction.checks().empty()) return "";
  Table table({"check", "where", ">found", ">limit", "passed"});
  for (const auto& check : correction.checks()) {
    const std::string kind = check.kind() == correction::v1::RELEASE_CHECK_KIND_UNSPECIFIED
                                 ? "unknown"
                                 : EnumText(ReleaseCheckKind_Name(check.kind()), "RELEASE_CHECK_KIND_");
    table.AddRow(
        {kind, check.subject().empty() ? "-" : check.subject(), check.has_value() ? Significant(check.value()) : "-",
         Significant(check.limit()),
         check.passed() ? "yes" : "NO" + (check.failed_count() > 1 ? ", " + Grouped(check.failed_count()) : "")});
  }
  return table.ToText();
}

std::string AdaptationText(const correction::v1::CorrectedGroup& group) {
  if (!group.has_adaptation()) return "";
  const correction::v1::PathAdaptation& adaptation = group.adaptation();
  return group.group() + ": with the shape it goes up to " + Fixed(adaptation.greatest_shift_mm(), 3) + " mm and " +
         Fixed(adaptation.greatest_turn_deg(), 3) + " deg off its template; cuts up to " +
         Fixed(adaptation.gouge_um(), 2) + " um deeper and leaves up to " + Fixed(adaptation.rest_um(), 2) +
         " um more than that of the design\n" +
         (adaptation.has_deepest_compensation_um()
              ? group.group() + ": commanded up to " + Fixed(adaptation.deepest_compensation_um(), 1) +
                    " um deeper than the shape, by the pass before\n"
              : "");
}

}  // namespace

std::string CorrectionText(const correction::v1::Correction& correction) {
  const bool named = correction.axes_size() == 2;
  Table table = CorrectionTable("blade", named ? correction.axes(0) : "A", named ? correction.axes(1) : "B");
  AddCorrectionRows(IdText(correction.blade()), correction, &table);
  std::string text = correction.name() + " of " + correction.blade() + " from " + correction.registration() +
                     " (mm, deg)\n" + table.ToText();
  for (const std::string& name : correction.axis_characterisations()) text += "angles commanded by " + name + "\n";
  if (!correction.machining_model().empty()) text += "by " + correction.machining_model() + "\n";
  if (!correction.reconstruction().empty()) text += "on the shape of " + correction.reconstruction() + "\n";
  if (!correction.machining_pass().empty()) text += "by what " + correction.machining_pass() + " left\n";
  if (!correction.repair().empty()) text += "along the laps of " + correction.repair() + "\n";
  if (correction.has_proof())
    text += "program proven: " + Grouped(correction.proof().pose_count()) + " poses, at most " +
            Fixed(correction.proof().greatest_difference_um(), 3) + " um and " +
            Fixed(correction.proof().greatest_tilt_deg(), 6) + " deg from the correction\n";
  for (const auto& group : correction.groups())
    if (!group.poses().empty())
      text += group.group() + ": a path of " + Grouped(group.poses_size()) + " poses, at most " +
              Fixed(group.greatest_chord_um(), 2) + " um and " + Fixed(group.greatest_axis_deviation_deg(), 4) +
              " deg off its lines between them\n" + AdaptationText(group);
  text += ChecksText(correction);
  int cut = 0, holes = 0;
  for (const auto& group : correction.groups())
    for (const auto& hole : group.holes()) ++holes, cut += hole.has_reported_cut_at();
  if (cut > 0) text += "cut: " + Grouped(cut) + " of " + Grouped(holes) + " holes\n";
  if (correction.state() == correction::v1::CORRECTION_STATE_UNSPECIFIED)
    return text +
           (correction.release() == correction::v1::RELEASE_AUTOMATIC ? "would be released"
                                                                      : "would wait for a person") +
           "; nothing was recorded\n";
  text += "state: " + EnumText(CorrectionState_Name(correction.state()), "CORRECTION_STATE_");
  if (!correction.superseded_by().empty()) text += " by " + correction.superseded_by();
  text += "\n";
  for (const auto& [what, there, decision] : {std::tuple("released", correction.has_released(), &correction.released()),
                                              std::tuple("refused", correction.has_refused(), &correction.refused())})
    if (there)
      text += std::string(what) + " by " + decision->requested_by() + ", " + TimeText(decision->recorded_at()) + ": " +
              decision->reason() + "\n";
  return text + "not to be used after " + TimeText(correction.usable_until()) + "\n";
}

Table InspectionTable() {
  return Table({"group", "hole", "verdict", ">position mm", ">U95 um", ">tolerance mm", ">inclination deg", ">U95 deg",
                ">tolerance deg", ">positioning um", ">half play um", ">points", "reason"});
}

void AddInspectionRows(const inspection::v1::Inspection& inspection, Table* table) {
  for (const auto& hole : inspection.holes()) {
    const bool position = hole.has_position_error_mm(), inclination = hole.has_inclination_error_deg();
    table->AddRow({hole.group(), hole.hole(), VerdictName(hole.verdict()),
                   position ? Fixed(hole.position_error_mm(), 4) : "-",
                   position ? Fixed(hole.position_expanded_uncertainty_um(), 2) : "-",
                   Fixed(hole.position_tolerance_mm(), 4), inclination ? Fixed(hole.inclination_error_deg(), 4) : "-",
                   inclination ? Fixed(hole.inclination_expanded_uncertainty_deg(), 4) : "-",
                   Fixed(hole.inclination_tolerance_deg(), 3),
                   hole.has_positioning_difference_um() ? Fixed(hole.positioning_difference_um(), 1) : "-",
                   hole.has_pin_half_play_um() ? Fixed(hole.pin_half_play_um(), 1) : "-", Grouped(hole.point_count()),
                   hole.reason()});
  }
}

// Where holes lie in the surface, and how wide they are; empty of inspections from before it was kept.
std::string HoleValuesText(const inspection::v1::Inspection& inspection) {
  Table table({"group", "hole", "by", ">along um", ">U95 um", ">across um", ">U95 um", ">leans along deg", ">U95 deg",
               ">across deg", ">U95 deg", ">diameter mm", ">U95 um", "no diameter because"});
  bool any = false;
  for (const auto& hole : inspection.holes()) {
    if (!hole.has_displacement()) continue;
    any = true;
    const auto& lies = hole.displacement();
    Cells cells = {hole.group(), hole.hole(),
                   EnumText(inspection::v1::HoleMeasuredBy_Name(hole.measured_by()), "HOLE_MEASURED_BY_")};
    for (const auto* of : {&lies.along_um(), &lies.across_um()})
      cells.insert(cells.end(), {Fixed(of->value(), 2), Fixed(of->expanded_uncertainty(), 2)});
    for (const auto* of : {&lies.inclination_along_deg(), &lies.inclination_across_deg()})
      cells.insert(cells.end(), {Fixed(of->value(), 4), Fixed(of->expanded_uncertainty(), 4)});
    cells.insert(cells.end(), {hole.has_diameter() ? Fixed(hole.diameter().diameter_mm(), 4) : "-",
                               hole.has_diameter() ? Fixed(hole.diameter().expanded_uncertainty_um(), 1) : "-",
                               hole.diameter_reason()});
    table.AddRow(std::move(cells));
  }
  return any ? table.ToText() : "";
}

std::string PitchesText(const inspection::v1::Inspection& inspection) {
  if (inspection.pitches().empty()) return "";
  Table table({"group", "from", "to", ">drawn mm", ">pitch mm", ">U95 um", ">P/D", ">U95", "reason"});
  for (const auto& pitch : inspection.pitches()) {
    const bool measured = pitch.has_pitch_mm();
    table.AddRow({pitch.group(), pitch.from(), pitch.to(), Fixed(pitch.nominal_pitch_mm(), 4),
                  measured ? Fixed(pitch.pitch_mm(), 4) : "-",
                  measured ? Fixed(pitch.expanded_uncertainty_um(), 2) : "-",
                  measured ? Fixed(pitch.pitch_over_diameter(), 4) : "-",
                  measured ? Fixed(pitch.pitch_over_diameter_expanded_uncertainty(), 4) : "-", pitch.reason()});
  }
  return table.ToText();
}

std::string InspectionText(const inspection::v1::Inspection& inspection) {
  Table table = InspectionTable();
  AddInspectionRows(inspection, &table);
  const auto& deviation = inspection.deviation();
  const auto& positioning = inspection.positioning();
  std::string positioned = "positioned by " + MethodText(positioning.method());
  if (positioning.has_disagreement_ratio())
    positioned += ", best fit and datum points or region differ by up to " + Fixed(positioning.disagreement_um(), 2) +
                  " um, " + Fixed(positioning.disagreement_ratio(), 1) + " times the standard uncertainty";
  if (positioning.disagrees())
    positioned += std::string(": DISAGREES, part and CAD differ in shape; ") +
                  (positioning.covered() ? "U95 holds what another positioning would move each hole (positioning um)"
                   : positioning.method() == registration::v1::METHOD_SIX_POINT_NORMALS
                       ? "U95 is about this positioning alone"
                       : "U95 may be too small, for another positioning could not be made");
  return inspection.name() + " of " + inspection.blade() + ": " + VerdictName(inspection.verdict()) + " (" +
         inspection.decision_rule() + ")\n" + table.ToText() + HoleValuesText(inspection) + PitchesText(inspection) +
         positioned + "\n" + "deviation from CAD: " + Fixed(deviation.minimum_um(), 1) + " to " +
         Fixed(deviation.maximum_um(), 1) + " um, rms " + Fixed(deviation.rms_um(), 2) + " um over " +
         Grouped(deviation.point_count()) + " points (" + Grouped(deviation.excluded_count()) + " set aside)\n";
}

std::string RuleText(const plant::v1::DecisionRule& rule) {
  std::string text = EnumText(DecisionRuleKind_Name(rule.kind()), "DECISION_RULE_KIND_");
  if (rule.kind() == plant::v1::DECISION_RULE_KIND_ISO_14253_1) text = "ISO 14253-1:" + rule.edition();
  if (rule.has_guard_factor()) text += " " + NumberText(rule.guard_factor());
  return text;
}

}  // namespace sixpoint::cli
