#include "cli/study_reports.h"

#include <cmath>
#include <map>

#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/table.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::Spread;
using calibration::v1::Study;

// What the thesis prints: CONF 3.3.3 (n = 15), min, max, mean; mm and deg.
struct Published {
  double minimum, maximum, mean;
};
const std::map<std::string, Published>& PublishedArm() {
  static const std::map<std::string, Published> kTable = {
      {"dx", {-0.01063, 0.001505, -0.00483}},  {"dy", {-0.00236, 0.00931, 0.002439}},
      {"dz", {-0.00285, 0.00318, 0.001501}},   {"dalpha", {-0.0058, 0.0051, -0.00051}},
      {"dbeta", {-0.0058, 0.00688, 0.003107}}, {"dgamma", {-0.0188, 0.0121, -0.00108}}};
  return kTable;
}

std::string ArmText(const calibration::v1::ArmStudy& arm) {
  Table table({"quantity", ">n", ">min", ">max", ">mean", ">u", ">std dev", ">u", ">u of one", "unit", ">thesis min",
               ">max", ">mean"});
  for (const Spread& s : arm.spreads()) {
    const auto published = PublishedArm().find(s.quantity());
    const auto thesis = [&](double Published::*figure) {
      return published == PublishedArm().end() ? "-" : Fixed(published->second.*figure, 5);
    };
    table.AddRow({s.quantity(), std::to_string(s.count()), Fixed(s.minimum(), 5), Fixed(s.maximum(), 5),
                  Fixed(s.mean(), 5), Fixed(s.mean_standard_uncertainty(), 5), Fixed(s.standard_deviation(), 5),
                  Fixed(s.standard_deviation_standard_uncertainty(), 5), Fixed(s.stated_standard_uncertainty(), 5),
                  s.unit(), thesis(&Published::minimum), thesis(&Published::maximum), thesis(&Published::mean)});
  }
  return table.ToText() + std::to_string(arm.scan_count()) + " scans, each against the first, " + "by " +
         arm.sensor_calibration() + "; u of one: what the fits explain\n";
}

std::string InterimText(const calibration::v1::InterimCheck& check) {
  Table table({"place", ">y mm", ">z mm", ">dx um", ">dy um", ">dz um", ">displaced um", ">+- um (95 %)", ""});
  for (int i = 0; i < check.places_size(); ++i) {
    const calibration::v1::InterimPlace& p = check.places(i);
    table.AddRow({i == 0 ? "middle" : "corner", Fixed(p.y_mm(), 1), Fixed(p.z_mm(), 1), Fixed(p.dx_um(), 2),
                  Fixed(p.dy_um(), 2), Fixed(p.dz_um(), 2), Fixed(p.distance_um(), 2), Fixed(p.bound_um(), 2),
                  i == check.worst_place() ? "worst" : ""});
  }
  std::string text = table.ToText() + "against " + check.sensor_calibration();
  if (!check.clamping().empty()) text += ", in clamping " + check.clamping();
  text += "; turned by " + Fixed(check.dalpha_deg(), 4) + ", " + Fixed(check.dbeta_deg(), 4) + ", " +
          Fixed(check.dgamma_deg(), 4) + " deg\n";
  if (check.swing_count() > 0)
    text += "the arm was swung: " +
            (check.arm_study().empty() ? "how far it repeats nobody studied" : "its spread by " + check.arm_study()) +
            "\n";
  return text + (check.limit_um() > 0 ? "limit " + Fixed(check.limit_um(), 1) + " um\n" : "no limit was stated\n");
}

std::string RepeatText(const calibration::v1::RepeatStudy& repeat) {
  static const std::map<std::string, double> kDeviations = {{"alpha", 0.0028}, {"beta", 0.0220}, {"gamma", 0.0234}};
  static const std::map<std::string, Published> kCentres = {
      {"C1", {1.16, 7.38, 3.12}}, {"C2", {0.35, 4.72, 1.71}}, {"C3", {0.74, 6.22, 2.95}}};
  Table parameters(
      {"parameter", ">n", ">mean", ">u", ">std dev", ">u", ">stated u", "unit", ">thesis std dev (n = 17)"});
  for (const Spread& s : repeat.parameters()) {
    const auto published = kDeviations.find(s.quantity());
    parameters.AddRow({s.quantity(), std::to_string(s.count()), Fixed(s.mean(), 5),
                       Fixed(s.mean_standard_uncertainty(), 5), Fixed(s.standard_deviation(), 5),
                       Fixed(s.standard_deviation_standard_uncertainty(), 5), Fixed(s.stated_standard_uncertainty(), 5),
                       s.unit(), published == kDeviations.end() ? "-" : Fixed(published->second, 4)});
  }
  Table centres(
      {"laser against touch", ">n", ">min um", ">max um", ">mean um", ">u um", ">thesis min", ">max", ">mean"});
  for (const Spread& s : repeat.centre_errors()) {
    const auto published = kCentres.find(s.quantity());
    const auto thesis = [&](double Published::*figure) {
      return published == kCentres.end() ? "-" : Fixed(published->second.*figure, 2);
    };
    centres.AddRow({s.quantity(), std::to_string(s.count()), Fixed(s.minimum(), 2), Fixed(s.maximum(), 2),
                    Fixed(s.mean(), 2), Fixed(s.mean_standard_uncertainty(), 2), thesis(&Published::minimum),
                    thesis(&Published::maximum), thesis(&Published::mean)});
  }
  return parameters.ToText() + centres.ToText();
}

std::string GaugeText(const calibration::v1::GaugeStudy& gauge) {
  Table table({"quantity", ">value um", ">u um", "thesis"});
  table.AddRow({"median oscillation (+-)", Fixed(gauge.median_oscillation_um(), 3),
                Fixed(gauge.median_oscillation_standard_uncertainty_um(), 3), "2 (sensor), 23 (rejected projector)"});
  table.AddRow({"greatest oscillation (+-)", Fixed(gauge.greatest_oscillation_um(), 3), "-", ""});
  table.AddRow({"standard deviation of a reading", Fixed(gauge.standard_deviation_um(), 3),
                Fixed(gauge.standard_deviation_standard_uncertainty_um(), 3), ""});
  table.AddRow(
      {"drift, first to last scan", Fixed(gauge.drift_um(), 3), Fixed(gauge.drift_standard_uncertainty_um(), 3), ""});
  return table.ToText() + std::to_string(gauge.scan_count()) + " scans, " + Grouped(gauge.station_count()) +
         " stations" + (gauge.limit_um() > 0 ? ", limit +-" + Fixed(gauge.limit_um(), 3) + " um" : "") + "\n";
}

std::string GaugeRrText(const calibration::v1::GaugeRr& rr) {
  Table table({"source", ">df", ">sum of squares", ">mean square", ">F", ">P", ">variance", ">from", ">to", ">std dev",
               ">% of variance"});
  for (const auto& line : rr.lines()) {
    table.AddRow({line.source(), std::to_string(line.degrees_of_freedom()), Fixed(line.sum_of_squares(), 6),
                  line.has_mean_square() ? Fixed(line.mean_square(), 6) : "", line.has_f() ? Fixed(line.f(), 3) : "",
                  line.has_p() ? Fixed(line.p(), 4) : "", Fixed(line.variance(), 6),
                  line.has_variance_lower() ? Fixed(line.variance_lower(), 6) : "",
                  line.has_variance_upper() ? Fixed(line.variance_upper(), 6) : "", Fixed(line.standard_deviation(), 5),
                  Fixed(line.percent_of_variance(), 1)});
  }
  return table.ToText() + "mean " + Fixed(rr.mean(), 5) + " (u " + Fixed(rr.mean_standard_uncertainty(), 5) + ") " +
         rr.unit() + "; gauge R&R " + Fixed(rr.gauge_rr_standard_deviation(), 5) + " " + rr.unit() + " (" +
         Fixed(100 * rr.confidence(), 0) + " %: " + Fixed(rr.gauge_rr_lower(), 5) + " to " +
         Fixed(rr.gauge_rr_upper(), 5) + "), " + Fixed(rr.gauge_rr_percent_of_total(), 1) +
         " % of the total standard deviation; distinct categories " +
         (rr.has_distinct_categories() ? std::to_string(rr.distinct_categories()) : "-") +
         (rr.balanced() ? "" : "; not balanced: intervals are approximate") + "\n";
}

std::string SphereText(const calibration::v1::SphereCheck& check) {
  Table table({"quantity", ">error um", ">U95 um", ">MPE um", "verdict"});
  for (const auto& e : check.errors())
    table.AddRow({e.quantity(), Fixed(e.error_um(), 3), Fixed(e.expanded_uncertainty_um(), 3),
                  e.has_mpe_um() ? Fixed(e.mpe_um(), 3) : "-", StudyVerdictName(e.verdict())});
  return table.ToText() + "centre " + PointText(check.centre_mm(), 5) + " mm (u " +
         PointText(check.centre_standard_uncertainty_mm(), 5) + "), diameter " + Fixed(check.fitted_diameter_mm(), 5) +
         " mm (u " + Fixed(check.fitted_diameter_standard_uncertainty_um(), 3) + " um), a point " +
         Fixed(check.standard_deviation_um(), 3) + " um over " + std::to_string(check.point_count()) + " points\n";
}

}  // namespace

std::string StudyKindText(calibration::v1::StudyKind kind) {
  return EnumText(calibration::v1::StudyKind_Name(kind), "STUDY_KIND_");
}

std::string StudyVerdictName(calibration::v1::StudyVerdict verdict) {
  return calibration::v1::StudyVerdict_Name(verdict).substr(std::string("STUDY_VERDICT_").size());
}

std::string StudyText(const Study& study) {
  std::string text = study.name() + ": " + StudyKindText(study.kind()) +
                     (study.machine().empty() ? "" : " of " + study.machine()) + ", " +
                     StudyVerdictName(study.verdict());
  if (study.environment().has_temperature_c()) text += ", " + Fixed(study.environment().temperature_c(), 1) + " C";
  text += "\n";
  if (study.has_gauge()) text += GaugeText(study.gauge());
  if (study.has_arm()) text += ArmText(study.arm());
  if (study.has_interim_check()) text += InterimText(study.interim_check());
  if (study.has_repeat()) text += RepeatText(study.repeat());
  if (study.has_gauge_rr()) text += GaugeRrText(study.gauge_rr());
  if (study.has_sphere_check()) text += SphereText(study.sphere_check());
  return text;
}

std::string TrendText(const calibration::v1::CalibrationTrend& trend) {
  std::string text;
  for (const auto& parameter : trend.parameters()) {
    Table table({parameter.parameter(), "valid from", ">value", ">u", ">change", ">in combined u", ">C", ""});
    for (const auto& point : parameter.points())
      table.AddRow({IdText(point.calibration()), TimeText(point.valid_from()), Fixed(point.value(), 5),
                    FixedOrTiny(point.standard_uncertainty(), 5), point.has_change() ? Fixed(point.change(), 5) : "-",
                    point.has_change_ratio() ? Fixed(point.change_ratio(), 2) : "-",
                    point.has_temperature_c() ? Fixed(point.temperature_c(), 1) : "-", point.alarm() ? "ALARM" : ""});
    text += table.ToText();
    if (parameter.has_slope_per_day())
      text += "slope " + Fixed(parameter.slope_per_day(), 7) + " a day (u " +
              FixedOrTiny(parameter.slope_standard_uncertainty_per_day(), 7) + "), t " + Fixed(parameter.slope_t(), 2) +
              " of " + Fixed(parameter.slope_t_limit(), 2) + ", scatter " + Fixed(parameter.scatter_ratio(), 2) +
              " of what is stated\n";
    for (const std::string& alarm : parameter.alarms()) text += "ALARM " + alarm + ": " + parameter.parameter() + "\n";
  }
  return text + (trend.alarm() ? "drift" : "no drift") + " at k = " + Fixed(trend.coverage_factor(), 1) + " (" +
         trend.rule() + ")\n";
}

std::string WithdrawalText(const calibration::v1::WithdrawCalibrationResponse& response) {
  const auto& withdrawal = response.calibration().withdrawal();
  std::string text =
      response.calibration().name() + ": withdrawn by " + withdrawal.requested_by() + ", " + withdrawal.reason() + "\n";
  Table table({"rests on it", "kind", "blade", "by", "recorded"});
  for (const auto& result : response.resting())
    table.AddRow({result.name(), result.kind(), result.blade().empty() ? "-" : IdText(result.blade()),
                  result.requested_by(), TimeText(result.recorded_at())});
  text += table.empty() ? "nothing rests on it\n" : table.ToText();
  if (response.in_force().empty()) return text + "nothing is in force now: calibrate\n";
  return text + "in force now: " + response.in_force() + " (withdraw it too, if the cause concerns it)\n";
}

}  // namespace sixpoint::cli
