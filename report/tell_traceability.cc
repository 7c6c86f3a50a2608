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

// In two halves, so that it breaks there.
Cell DigestCell(const std::string& sha256) {
  if (sha256.empty()) return {std::string(kNotGiven), Tone::kMissing};
  return {sha256.substr(0, 32) + " " + sha256.substr(32)};
}

Table ScanTable(const std::vector<ScanUsed>& scans) {
  Table table;
  table.caption = "Scans, with the SHA-256 of their bytes";
  table.empty = "None is named.";
  table.columns = {{"Scan", "", Align::kLeft},
                   {"SHA-256", "", Align::kLeft},
                   {"Points", "", Align::kRight},
                   {"Received", "", Align::kLeft}};
  for (const ScanUsed& s : scans)
    table.rows.push_back({{ToldOr(s.name)},
                          DigestCell(s.sha256),
                          {s.point_count ? Grouped(*s.point_count) : "\u2013"},
                          {s.received_at ? TimeWords(*s.received_at) : "\u2013"}});
  return table;
}

Table InstrumentTable(const std::vector<InstrumentUsed>& instruments) {
  Table table;
  table.caption = "Other instruments, with the SHA-256 of the file that their values came in";
  table.columns = {{"Instrument", "", Align::kLeft},
                   {"Certificate", "", Align::kLeft},
                   {"Measurement", "", Align::kLeft},
                   {"SHA-256", "", Align::kLeft},
                   {"Measured", "", Align::kLeft}};
  for (const InstrumentUsed& i : instruments)
    table.rows.push_back({{ToldOr(i.name)},
                          {ToldOr(i.certificate), i.certificate.empty() ? Tone::kMissing : Tone::kPlain},
                          {ToldOr(i.measurement)},
                          DigestCell(i.file_sha256),
                          {i.measured_at ? TimeWords(*i.measured_at) : "\u2013"}});
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
  if (!t.instruments.empty()) document->blocks.emplace_back(InstrumentTable(t.instruments));
  if (t.budgets.empty()) document->blocks.emplace_back(Paragraph{"No budget of uncertainty is given.", Tone::kMissing});
  for (const Budget& budget : t.budgets) document->blocks.emplace_back(BudgetTable(budget));
}

}  // namespace sixpoint::report
