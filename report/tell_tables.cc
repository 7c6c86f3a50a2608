#include <algorithm>
#include <cmath>

#include "report/number_text.h"
#include "report/plots.h"
#include "report/tell.h"

namespace sixpoint::report {
namespace {

Cell NumberCell(const std::optional<double>& number, int decimals) {
  return number ? Cell{Fixed(*number, decimals)} : Cell{"\u2013", Tone::kQuiet};
}

Cell Missing() { return {std::string(kNotMeasuredText), Tone::kMissing}; }

std::string After(const std::string& name, const std::string& fit_state) {
  return fit_state.empty() ? name : name + "  \u00b7  after " + Told(fit_state);
}

// The one unit of all of them; none where they have several.
std::optional<std::string> OneUnit(const std::vector<Characteristic>& characteristics) {
  for (const Characteristic& c : characteristics)
    if (c.unit != characteristics.front().unit) return std::nullopt;
  return characteristics.empty() ? std::optional<std::string>("") : characteristics.front().unit;
}

bool Any(const std::vector<Characteristic>& characteristics, const std::string Characteristic::*text) {
  return std::any_of(characteristics.begin(), characteristics.end(),
                     [text](const Characteristic& c) { return !(c.*text).empty(); });
}

std::vector<Cell> RegionRow(const RegionDeviation& region) {
  const double coverage = region.area_mm2 > 0 ? 100 * region.seen_area_mm2 / region.area_mm2 : 0;
  std::vector<Cell> row = {{ToldOr(region.name)}, {Fixed(region.area_mm2, 1)}, {Fixed(coverage, 1)}};
  if (!region.values) {
    for (int i = 0; i < 7; ++i) row.push_back({"\u2013", Tone::kQuiet});
    row.push_back({std::string(kNotMeasuredText) + ": " + ToldOr(region.reason, "nothing was seen"), Tone::kMissing});
    return row;
  }
  const RegionDeviation::Values& v = *region.values;
  row.push_back({Signed(v.mean_um, 1)});
  row.push_back({Fixed(v.rms_um, 1)});
  for (const double um : {v.p05_um, v.p50_um, v.p95_um, v.lowest_um, v.highest_um}) row.push_back({Signed(um, 1)});
  row.push_back(v.expanded_uncertainty_um ? Cell{"U " + Fixed(*v.expanded_uncertainty_um, 1) + " \u00b5m"}
                                          : Cell{"U not known", Tone::kQuiet});
  return row;
}

Table RegionTable(const std::vector<RegionDeviation>& regions) {
  Table table;
  table.caption = "Deviation of the surface by region";
  table.columns = {
      {"Region", "", Align::kLeft},          {"Area", "mm\u00b2", Align::kRight}, {"Seen", "%", Align::kRight},
      {"Mean", "\u00b5m", Align::kRight},    {"RMS", "\u00b5m", Align::kRight},   {"5 %", "\u00b5m", Align::kRight},
      {"50 %", "\u00b5m", Align::kRight},    {"95 %", "\u00b5m", Align::kRight},  {"Lowest", "\u00b5m", Align::kRight},
      {"Highest", "\u00b5m", Align::kRight}, {"Remark", "", Align::kLeft}};
  for (const RegionDeviation& region : regions) table.rows.push_back(RegionRow(region));
  return table;
}

std::vector<Cell> PositionRow(const Hole& hole, int decimals) {
  std::vector<Cell> row = {{ToldOr(hole.id)}};
  for (const double x : hole.nominal_mm) row.push_back({Fixed(x, 3)});
  for (std::size_t i = 0; i < 3; ++i)
    row.push_back(hole.displacement_mm ? Cell{Signed(1000 * (*hole.displacement_mm)[i], 1)}
                                       : Cell{"\u2013", Tone::kQuiet});
  std::optional<double> position_mm;
  if (const auto& d = hole.displacement_mm)
    position_mm = std::sqrt((*d)[0] * (*d)[0] + (*d)[1] * (*d)[1] + (*d)[2] * (*d)[2]);
  row.push_back(position_mm ? NumberCell(position_mm, decimals) : Missing());
  row.push_back(NumberCell(hole.position_expanded_uncertainty_mm, decimals));
  row.push_back(NumberCell(hole.position_limit_mm, decimals));
  row.push_back(VerdictCell(hole.verdict, hole.judged));
  return row;
}

Table PositionTable(const std::vector<Hole>& holes) {
  std::vector<std::optional<double>> limits;
  for (const Hole& hole : holes) limits.push_back(hole.position_limit_mm);
  const int decimals = DecimalsFor("mm", limits);
  Table table;
  table.caption = "Nominal start of each hole, and how far the measured start is off it";
  table.columns = {{"Hole", "", Align::kLeft},
                   {"x", "mm", Align::kRight},
                   {"y", "mm", Align::kRight},
                   {"z", "mm", Align::kRight},
                   {"\u0394x", "\u00b5m", Align::kRight},
                   {"\u0394y", "\u00b5m", Align::kRight},
                   {"\u0394z", "\u00b5m", Align::kRight},
                   {"Position", "mm", Align::kRight},
                   {"U (95\u00a0%)", "mm", Align::kRight},
                   {"Limit", "mm", Align::kRight},
                   {"Verdict of the hole", "", Align::kLeft}};
  for (const Hole& hole : holes) table.rows.push_back(PositionRow(hole, decimals));
  return table;
}

Table InclinationTable(const std::vector<Hole>& holes) {
  Table table;
  table.caption = "Inclination of each hole to its nominal axis";
  table.columns = {{"Hole", "", Align::kLeft},
                   {"Inclination", "deg", Align::kRight},
                   {"U (95\u00a0%)", "deg", Align::kRight},
                   {"Limit", "deg", Align::kRight},
                   {"Verdict of the hole", "", Align::kLeft},
                   {"Reason", "", Align::kLeft}};
  for (const Hole& hole : holes)
    table.rows.push_back({{ToldOr(hole.id)},
                          hole.inclination_deg ? NumberCell(hole.inclination_deg, 3) : Missing(),
                          NumberCell(hole.inclination_expanded_uncertainty_deg, 3),
                          NumberCell(hole.inclination_limit_deg, 3),
                          VerdictCell(hole.verdict, hole.judged),
                          {Told(hole.reason)}});
  return table;
}

// Ours beside theirs: judged is what stands in the tables before.
void TellOthers(const Report& report, Document* document) {
  Table table;
  table.caption =
      "What other instruments and other positionings say of the same characteristics; the verdict is not by them";
  table.columns = {
      {"Characteristic", "", Align::kLeft},       {"Unit", "", Align::kLeft},   {"Measured", "", Align::kRight},
      {"U (95\u00a0%)", "", Align::kRight},       {"Other", "", Align::kRight}, {"U (95\u00a0%)", "", Align::kRight},
      {"Measured less other", "", Align::kRight}, {"By", "", Align::kLeft}};
  const auto add = [&](const std::vector<Characteristic>& characteristics) {
    for (const Characteristic& c : characteristics) {
      const int decimals = DecimalsFor(c.unit, {c.nominal, c.lower, c.upper});
      for (const OtherValue& other : c.others)
        table.rows.push_back({{ToldOr(c.id)},
                              {UnitText(c.unit)},
                              c.value ? NumberCell(c.value, decimals) : Missing(),
                              NumberCell(c.expanded_uncertainty, decimals),
                              NumberCell(other.value, decimals),
                              NumberCell(other.expanded_uncertainty, decimals),
                              c.value ? Cell{Signed(*c.value - other.value, decimals)} : NumberCell(std::nullopt, 0),
                              {ToldOr(other.source)}});
    }
  };
  for (const CharacteristicGroup& group : report.groups) add(group.characteristics);
  for (const Section& section : report.sections) add(section.parameters);
  if (!table.rows.empty()) document->blocks.emplace_back(std::move(table));
}

// The first one stands on the first page.
void TellFurtherPictures(const Report& report, Document* document) {
  for (std::size_t i = 1; i < report.deviation_pictures.size(); ++i)
    if (!report.deviation_pictures[i].views.empty())
      document->blocks.emplace_back(Figures{{DeviationFigure(report.deviation_pictures[i])}});
  if (report.pictures_left_out > 0)
    document->blocks.emplace_back(Paragraph{std::to_string(report.pictures_left_out) +
                                                " more deviation maps are told by region alone: " +
                                                std::to_string(report.deviation_pictures.size()) + " are drawn.",
                                            Tone::kQuiet});
}

void TellSections(const Report& report, Document* document) {
  if (report.sections.empty()) return;
  document->blocks.emplace_back(Heading{"Sections", 2});
  Figures row;
  for (const Section& section : report.sections) {
    if (section.outlines.nominal.empty()) continue;
    row.figures.push_back(SectionFigure(section, {86, 58}));
    if (row.figures.size() == 2) document->blocks.emplace_back(std::move(row)), row = {};
  }
  if (!row.figures.empty()) document->blocks.emplace_back(std::move(row));
  for (const Section& section : report.sections)
    document->blocks.emplace_back(CharacteristicTable(
        After(ToldOr(section.name, "Section") + " at " + Fixed(section.height_mm, 3) + " mm", section.fit_state),
        section.parameters));
}

}  // namespace

Table CharacteristicTable(const std::string& caption, const std::vector<Characteristic>& characteristics) {
  const std::optional<std::string> unit = OneUnit(characteristics);
  const bool required = Any(characteristics, &Characteristic::requirement);
  const bool classed = Any(characteristics, &Characteristic::designator);
  const bool reasons = Any(characteristics, &Characteristic::reason);
  const std::string shown = unit ? UnitText(*unit) : "";
  Table table;
  table.caption = caption;
  table.empty = "No characteristic.";
  table.columns.push_back({"Characteristic", "", Align::kLeft});
  if (classed) table.columns.push_back({"Class", "", Align::kLeft});
  if (required) table.columns.push_back({"Requirement", "", Align::kLeft});
  if (!unit) table.columns.push_back({"Unit", "", Align::kLeft});
  for (const char* title : {"Nominal", "Lower", "Upper"}) table.columns.push_back({title, shown, Align::kRight});
  table.columns.push_back({"Measured", shown, Align::kRight});
  table.columns.push_back({"U (95\u00a0%)", shown, Align::kRight});
  table.columns.push_back({"Verdict", "", Align::kLeft});
  if (reasons) table.columns.push_back({"Reason", "", Align::kLeft});
  // Of one unit all numbers have as many decimals, so that they stand below each other. What is not judged has its nominal from the CAD, which
  // nobody wrote with so many.
  std::vector<std::optional<double>> exact;
  for (const Characteristic& c : characteristics)
    if (c.judged) exact.insert(exact.end(), {c.nominal, c.lower, c.upper});
  const int common = unit ? DecimalsFor(*unit, exact) : 0;
  for (const Characteristic& c : characteristics) {
    const int decimals = unit       ? common
                         : c.judged ? DecimalsFor(c.unit, {c.nominal, c.lower, c.upper})
                                    : DecimalsFor(c.unit, {});
    std::vector<Cell> row = {{ToldOr(c.id)}};
    if (classed) row.push_back({Told(c.designator)});
    if (required) row.push_back({Told(c.requirement)});
    if (!unit) row.push_back({UnitText(c.unit)});
    for (const auto& number : {c.nominal, c.lower, c.upper}) row.push_back(NumberCell(number, decimals));
    row.push_back(c.value ? NumberCell(c.value, decimals) : Missing());
    row.push_back(NumberCell(c.expanded_uncertainty, decimals));
    row.push_back(VerdictCell(c.verdict, c.judged));
    if (reasons) row.push_back({Told(c.reason)});
    table.rows.push_back(std::move(row));
  }
  return table;
}

void TellTables(const Report& report, Document* document) {
  document->blocks.emplace_back(Heading{"Characteristics", 2});
  if (report.groups.empty())
    document->blocks.emplace_back(Paragraph{"No characteristic of the drawing was judged.", Tone::kMissing});
  for (const CharacteristicGroup& group : report.groups)
    document->blocks.emplace_back(
        CharacteristicTable(After(ToldOr(group.name, "Characteristics"), group.fit_state) +
                                (group.rule.empty() ? "" : "  \u00b7  judged by " + Told(group.rule)),
                            group.characteristics));
  TellOthers(report, document);
  document->blocks.emplace_back(Heading{"Holes", 2});
  if (report.holes.empty()) {
    document->blocks.emplace_back(Paragraph{"No hole was judged.", Tone::kMissing});
  } else {
    document->blocks.emplace_back(PositionTable(report.holes));
    document->blocks.emplace_back(InclinationTable(report.holes));
  }
  document->blocks.emplace_back(Heading{"Surface", 2});
  if (report.regions.empty())
    document->blocks.emplace_back(
        Paragraph{"Deviation of the surface: " + std::string(kNotMeasuredText) + ".", Tone::kMissing});
  else
    document->blocks.emplace_back(RegionTable(report.regions));
  TellFurtherPictures(report, document);
  TellSections(report, document);
}

}  // namespace sixpoint::report
