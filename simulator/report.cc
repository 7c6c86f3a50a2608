#include "simulator/report.h"

#include <cstdarg>
#include <cstdio>

#include "simulator/blade_requests.h"
#include "simulator/demo.h"

namespace sixpoint::simulator {
namespace {

using nlohmann::json;

__attribute__((format(printf, 2, 3))) void Print(std::string* out, const char* format, ...) {
  char line[400];
  va_list values;
  va_start(values, format);
  std::vsnprintf(line, sizeof line, format, values);
  va_end(values);
  *out += line;
}

const char* Word(inspection::v1::Verdict verdict) {
  switch (verdict) {
    case inspection::v1::VERDICT_CONFORM:
      return "conform";
    case inspection::v1::VERDICT_NOT_CONFORM:
      return "not conform";
    case inspection::v1::VERDICT_UNDECIDABLE:
      return "undecidable";
    case inspection::v1::VERDICT_NOT_MEASURED:
      return "not measured";
    default:
      return "none";
  }
}

std::string IdOf(const std::string& name) { return name.substr(name.find('/') + 1); }

int CountOf(const BladeRunResult& result, inspection::v1::Verdict verdict) {
  int count = 0;
  for (const auto& hole : result.inspection.holes()) count += hole.verdict() == verdict ? 1 : 0;
  return count;
}

}  // namespace

std::string Shortfall(const BladeRunResult& result) {
  std::string why;
  // Negated, so that a NaN falls short.
  if (!(result.six_point_error_um <= kPoseLimit_um))
    Print(&why, "pose off by %.1f um, want <= %g; ", result.six_point_error_um, kPoseLimit_um);
  if (result.measured_count != static_cast<int>(result.holes.size()) || result.holes.empty())
    Print(&why, "%d of %zu holes measured; ", result.measured_count, result.holes.size());
  for (const HoleComparison& hole : result.holes) {
    // Pairs keep a part of a casting's deviation in the pose that holes are judged in: the stated uncertainty must say so.
    const double limit_um =
        result.is_casting ? std::max(kHoleLimit_um, hole.measured.position_expanded_uncertainty_um()) : kHoleLimit_um;
    if (hole.is_measured && !(std::abs(hole.position_difference_um) <= limit_um))
      Print(&why, "%s/%s measured %.1f um from the truth, want <= %g; ", hole.truth.group.c_str(),
            hole.truth.hole.c_str(), hole.position_difference_um, limit_um);
  }
  if (!(result.nest_position_difference_um <= kHoleLimit_um))
    Print(&why, "a hole measured %.1f um from the truth by the nest, want <= %g; ", result.nest_position_difference_um,
          kHoleLimit_um);
  return why.substr(0, why.size() < 2 ? 0 : why.size() - 2);
}

std::string CorrectionTable(const BladeRunResult& result) {
  std::string out;
  Print(&out, "%s, blade %s: nominal -> corrected, machine coordinates\n", IdOf(result.machine).c_str(),
        IdOf(result.blade).c_str());
  Print(&out, "  %-6s %9s %9s %9s %9s %9s    %9s %9s %9s %9s %9s  %6s\n", "hole", "X mm", "Y mm", "Z mm", "A deg",
        "B deg", "X mm", "Y mm", "Z mm", "A deg", "B deg", "u95 um");
  for (const auto& group : result.correction.groups()) {
    for (const auto& hole : group.holes()) {
      Print(&out, "  %-6s %9.4f %9.4f %9.4f %9.4f %9.4f    %9.4f %9.4f %9.4f %9.4f %9.4f  %6.2f\n",
            (group.group() + "/" + hole.hole()).c_str(), hole.nominal_start_mm().x_mm(), hole.nominal_start_mm().y_mm(),
            hole.nominal_start_mm().z_mm(), group.a_nominal_deg(), group.b_nominal_deg(), hole.start_mm().x_mm(),
            hole.start_mm().y_mm(), hole.start_mm().z_mm(), group.a_deg(), group.b_deg(),
            hole.expanded_uncertainty_um());
    }
  }
  return out;
}

std::string HoleTable(const BladeRunResult& result) {
  std::string out;
  Print(&out, "%s, blade %s: each hole against its CAD position, measured beside true\n", IdOf(result.machine).c_str(),
        IdOf(result.blade).c_str());
  Print(&out, "  %-6s %11s %9s %8s    %12s %9s %8s  %s\n", "hole", "measured um", "true um", "U um", "measured deg",
        "true deg", "U deg", "verdict");
  for (const HoleComparison& hole : result.holes) {
    const std::string name = hole.truth.group + "/" + hole.truth.hole;
    if (!hole.is_measured) {
      Print(&out, "  %-6s %11s %9.1f %8s    %12s %9.3f %8s  not measured: %s\n", name.c_str(), "-",
            1e3 * hole.truth.position_error_mm, "-", "-", hole.truth.inclination_error_deg, "-",
            hole.measured.reason().c_str());
      continue;
    }
    Print(&out, "  %-6s %11.1f %9.1f %8.1f    %12.3f %9.3f %8.3f  %s\n", name.c_str(),
          1e3 * hole.measured.position_error_mm(), 1e3 * hole.truth.position_error_mm,
          hole.measured.position_expanded_uncertainty_um(), hole.measured.inclination_error_deg(),
          hole.truth.inclination_error_deg, hole.measured.inclination_expanded_uncertainty_deg(),
          Word(hole.measured.verdict()));
  }
  return out;
}

std::string SummaryTable(const std::vector<BladeRunResult>& results, const std::vector<absl::Status>& statuses) {
  std::string out;
  Print(&out, "%-10s %-26s %7s | %-26s | %-19s | %-15s | %-31s | %s\n", "", "", "", "calibration off the truth",
        "pose off the truth", "holes off truth", "holes by verdict", "seconds");
  Print(&out, "%-10s %-26s %7s | %8s %8s %8s | %9s %9s | %7s %7s | %7s %7s %7s %7s | %6s %6s %6s %6s\n", "machine",
        "blade", "Mpoints", "deg", "T um", "axes um", "fit um", "6-pt um", "um", "deg", "conform", "not", "undec.",
        "unmeas.", "cal.", "reg.", "corr.", "insp.");
  for (std::size_t i = 0; i < results.size(); ++i) {
    const BladeRunResult& r = results[i];
    Print(&out,
          "%-10s %-26s %7.2f | %8.4f %8.2f %8.2f | %9.2f %9.2f | %7.1f %7.3f | %7d %7d %7d %7d | %6.1f %6.1f %6.2f "
          "%6.1f\n",
          IdOf(r.machine).c_str(), IdOf(r.blade).c_str(), 1e-6 * static_cast<double>(r.point_count),
          r.sensor_angle_error_deg, r.t_sm_error_um, r.axes_error_um, r.best_fit_error_um, r.six_point_error_um,
          r.worst_position_difference_um, r.worst_inclination_difference_deg,
          CountOf(r, inspection::v1::VERDICT_CONFORM), CountOf(r, inspection::v1::VERDICT_NOT_CONFORM),
          CountOf(r, inspection::v1::VERDICT_UNDECIDABLE), CountOf(r, inspection::v1::VERDICT_NOT_MEASURED),
          r.calibrate_s, r.register_s, r.correct_s, r.inspect_s);
    if (!statuses[i].ok())
      Print(&out, "  FAILED: %s\n", std::string(statuses[i].message()).c_str());
    else if (const std::string why = Shortfall(r); !why.empty())
      Print(&out, "  FALLS SHORT: %s\n", why.c_str());
  }
  return out;
}

json ToJson(const BladeRunResult& r, const absl::Status& status) {
  json holes = json::array();
  for (const HoleComparison& hole : r.holes) {
    json entry{{"group", hole.truth.group},
               {"hole", hole.truth.hole},
               {"true_position_error_mm", hole.truth.position_error_mm},
               {"true_inclination_error_deg", hole.truth.inclination_error_deg},
               {"verdict", Word(hole.is_measured ? hole.measured.verdict() : inspection::v1::VERDICT_NOT_MEASURED)}};
    if (hole.is_measured) {
      entry["position_error_mm"] = hole.measured.position_error_mm();
      entry["inclination_error_deg"] = hole.measured.inclination_error_deg();
      entry["u95_position_um"] = hole.measured.position_expanded_uncertainty_um();
      entry["u95_inclination_deg"] = hole.measured.inclination_expanded_uncertainty_deg();
    }
    holes.push_back(std::move(entry));
  }
  const std::string why = status.ok() ? Shortfall(r) : std::string(status.message());
  return json{{"machine", r.machine},
              {"blade", r.blade},
              {"ok", status.ok() && why.empty()},
              {"why", why},
              {"scans", r.scans},
              {"point_count", r.point_count},
              {"sensor_calibration", r.sensor_calibration.name()},
              {"rotation_calibration", r.rotation_calibration.name()},
              {"best_fit_registration", r.best_fit.name()},
              {"six_point_registration", r.six_point.name()},
              {"correction", r.correction.name()},
              {"inspection", r.inspection.name()},
              {"positioning_disagrees", r.inspection.positioning().disagrees()},
              {"positioning_covered", r.inspection.positioning().covered()},
              {"nest_position_difference_um", r.nest_position_difference_um},
              {"sensor_angle_error_deg", r.sensor_angle_error_deg},
              {"t_sm_error_um", r.t_sm_error_um},
              {"axes_error_um", r.axes_error_um},
              {"best_fit_error_um", r.best_fit_error_um},
              {"six_point_error_um", r.six_point_error_um},
              {"station", r.six_point.station()},
              {"left_out_count", r.six_point.evidence().left_out_count()},
              {"planned_sweeps", r.whole_plan.portions_size()},
              {"planned_six_point_sweeps", r.six_point_plan.portions_size()},
              {"planned_coverage", LeastCoverage(r.whole_plan)},
              {"planned_six_point_coverage", LeastCoverage(r.six_point_plan)},
              {"holes", holes},
              {"worst_position_difference_um", r.worst_position_difference_um},
              {"worst_inclination_difference_deg", r.worst_inclination_difference_deg},
              {"seconds",
               {{"scan", r.scan_s},
                {"calibrate", r.calibrate_s},
                {"register", r.register_s},
                {"correct", r.correct_s},
                {"inspect", r.inspect_s},
                {"total", r.total_s}}}};
}

}  // namespace sixpoint::simulator
