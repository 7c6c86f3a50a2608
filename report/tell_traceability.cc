#include <algorithm>
#include <cmath>

#include "report/number_text.h"
#include "report/tell.h"

namespace sixpoint::report {
namespace {

Table CalibrationTable(const std::vector<CalibrationUsed>& calibrations) {
  Table table;
  table.caption = "Calibrations that the result rests on";
  table.empty = "None is named.";
  table.columns = {{"Calibration", "", Align::kLeft},
                   {"Kind", "", Align::kLeft},
                   {"State", "", Align::kLeft},
                   {"Valid from", "", Align::kLeft},
                   {"Valid until", "", Align::kLeft}};
  const auto time = [](const std::optional<Time>& at) { return at ? TimeWords(*at) : "\u2013"; };
  for (const CalibrationUsed& c : calibrations)
    table.rows.push_back(
        {{ToldOr(c.name)}, {Told(c.kind)}, {Told(c.state)}, {time(c.valid_from)}, {time(c.valid_until)}});
  return table;
}

Table ScanTable(const std::vector<ScanUsed>& scans) {
  Table table;
  table.caption = "Scans, with the SHA-256 of their bytes";
  table.empty = "None is named.";
  table.columns = {{"Scan", "", Align::kLeft},
                   {"SHA-256", "", Align::kLeft},
                   {"Points", "", Align::kRight},
                   {"Received", "", Align::kLeft}};
  for (const ScanUsed& s : scans) {
    // In two halves, so that it breaks there.
    const std::string digest =
        s.sha256.empty() ? std::string(kNotGiven) : s.sha256.substr(0, 32) + " " + s.sha256.substr(32);
    table.rows.push_back({{ToldOr(s.name)},
                          {digest, s.sha256.empty() ? Tone::kMissing : Tone::kPlain},
                          {s.point_count ? Grouped(*s.point_count) : "\u2013"},
                          {s.received_at ? TimeWords(*s.received_at) : "\u2013"}});
  }
  return table;
}

Table BudgetTable(const Budget& budget) {
  double sum = 0;
  for (const Budget::Line& line : budget.lines) sum += line.standard_uncertainty * line.standard_uncertainty;
  Table table;
  table.caption = "Uncertainty of " + ToldOr(budget.of, "a value");
  table.empty = "No source is named.";
  table.columns = {{"Source", "", Align::kLeft},
                   {"Standard uncertainty", UnitText(budget.unit), Align::kRight},
                   {"Share of variance", "%", Align::kRight},
                   {"Degrees of freedom", "", Align::kRight}};
  int decimals = DecimalsFor(budget.unit, {});
  if (budget.unit == "mm") decimals = 5;
  for (const Budget::Line& line : budget.lines) {
    const double variance = line.standard_uncertainty * line.standard_uncertainty;
    table.rows.push_back({{ToldOr(line.source)},
                          {Fixed(line.standard_uncertainty, decimals)},
                          {sum > 0 ? Fixed(100 * variance / sum, 1) : "\u2013"},
                          {line.degrees_of_freedom ? Fixed(*line.degrees_of_freedom, 0) : "\u2013"}});
  }
  table.rows.push_back(
      {{"all sources, independent"}, {Fixed(std::sqrt(sum), decimals)}, {sum > 0 ? "100.0" : "\u2013"}, {"\u2013"}});
  if (budget.expanded_uncertainty)
    table.rows.push_back(
        {{"expanded, U (95 %)"}, {Fixed(*budget.expanded_uncertainty, decimals)}, {"\u2013"}, {"\u2013"}});
  return table;
}

}  // namespace

void TellTraceability(const Report& report, Document* document) {
  const Traceability& t = report.traceability;
  document->blocks.emplace_back(Heading{"Traceability", 2});
  Facts facts{2, {}};
  for (const std::string& result : t.results) facts.facts.push_back({"Result", ToldOr(result)});
  for (const std::string& registration : t.registrations) facts.facts.push_back({"Registration", ToldOr(registration)});
  facts.facts.insert(facts.facts.end(), {{"Method", ToldOr(t.method)},
                                         {"Alignment", ToldOr(t.fit_state)},
                                         {"Machine", ToldOr(t.machine)},
                                         {"Scanner", ToldOr(t.sensor)},
                                         {"Requested by", ToldOr(t.requested_by)},
                                         {"Decision rule", ToldOr(report.decision_rule)},
                                         {"Work order", ToldOr(report.work_order)},
                                         {"Measured", TimeWords(report.measured_at)}});
  for (const SoftwareVersion& software : t.software)
    facts.facts.push_back({ToldOr(software.name, "Software"), ToldOr(software.version)});
  document->blocks.emplace_back(std::move(facts));
  document->blocks.emplace_back(CalibrationTable(t.calibrations));
  document->blocks.emplace_back(ScanTable(t.scans));
  if (t.budgets.empty()) document->blocks.emplace_back(Paragraph{"No budget of uncertainty is given.", Tone::kMissing});
  for (const Budget& budget : t.budgets) document->blocks.emplace_back(BudgetTable(budget));
}

}  // namespace sixpoint::report
