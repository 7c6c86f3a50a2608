#include "report/tell.h"

#include <algorithm>
#include <map>

#include "report/number_text.h"
#include "report/plots.h"

namespace sixpoint::report {
namespace {

constexpr std::size_t kWorst = 7;

int RankOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNotConform:
      return 0;
    case Verdict::kNotMeasured:
      return 1;
    case Verdict::kUndecidable:
      return 2;
    case Verdict::kConform:
      break;
  }
  return 3;
}

struct Named {
  std::string name;  // with its section's: many sections have a chord
  const Characteristic* characteristic;
};

std::vector<Named> WorstFirst(const Report& report) {
  std::vector<Named> all;
  for (const CharacteristicGroup& group : report.groups)
    for (const Characteristic& c : group.characteristics)
      if (c.judged) all.push_back({ToldOr(c.id), &c});
  for (const Section& section : report.sections)
    for (const Characteristic& c : section.parameters)
      if (c.judged) all.push_back({ToldOr(section.name, "Section") + ": " + ToldOr(c.id), &c});
  std::stable_sort(all.begin(), all.end(), [](const Named& a, const Named& b) {
    const int rank_a = RankOf(a.characteristic->verdict), rank_b = RankOf(b.characteristic->verdict);
    if (rank_a != rank_b) return rank_a < rank_b;
    return ShareOfTolerance(*a.characteristic).value_or(0) > ShareOfTolerance(*b.characteristic).value_or(0);
  });
  return all;
}

// Stays on one line.
std::string Joined(std::string words) {
  for (std::size_t blank; (blank = words.find(' ')) != std::string::npos;) words.replace(blank, 1, "\u00a0");
  return words;
}

std::string CountsOf(const Report& report) {
  std::map<int, std::pair<Verdict, int>> counts;
  const auto add = [&](Verdict verdict) {
    auto& count = counts[RankOf(verdict)];
    count = {verdict, count.second + 1};
  };
  for (const Characteristic* c : JudgedOf(report)) add(c->verdict);
  for (const Hole& hole : report.holes)
    if (hole.judged) add(hole.verdict);
  std::string text;
  for (const auto& [rank, count] : counts)
    text += (text.empty() ? "" : " \u00b7 ") + MarkOf(count.first) + "\u00a0" + std::to_string(count.second) +
            "\u00a0" + Joined(WordOf(count.first));
  return text.empty() ? "No characteristic was judged" : text;
}

std::string LimitsText(const Characteristic& c, int decimals) {
  const std::string unit = " " + UnitText(c.unit);
  if (c.lower && c.upper) return Fixed(*c.lower, decimals) + " to " + Fixed(*c.upper, decimals) + unit;
  if (c.upper) return "\u2264 " + Fixed(*c.upper, decimals) + unit;
  if (c.lower) return "\u2265 " + Fixed(*c.lower, decimals) + unit;
  return "no limit";
}

void TellWorst(const Report& report, Document* document) {
  const std::vector<Named> worst = WorstFirst(report);
  if (worst.empty()) return;
  Table table;
  table.caption = worst.size() > kWorst
                      ? "The " + std::to_string(kWorst) + " characteristics nearest to or beyond their limits, of " +
                            std::to_string(worst.size())
                      : "Characteristics, the worst first";
  table.columns = {{"Characteristic", "", Align::kLeft}, {"Limits", "", Align::kRight},
                   {"Measured", "", Align::kRight},      {"Within its limits", "", Align::kCentre},
                   {"Of tolerance", "%", Align::kRight}, {"Verdict", "", Align::kLeft}};
  for (std::size_t i = 0; i < std::min(kWorst, worst.size()); ++i) {
    const Characteristic& c = *worst[i].characteristic;
    const std::optional<double> share = ShareOfTolerance(c);
    const std::string percent = share ? Fixed(100 * *share, 0) : "\u2013";
    Cell gauge{share ? "at " + percent + " % of its tolerance" : "\u2013", Tone::kQuiet};
    gauge.drawing = PlotWithinLimits(c, 30, 3.2);
    table.rows.push_back(
        {{worst[i].name},
         {LimitsText(c, DecimalsFor(c.unit, {c.lower, c.upper}))},
         {c.value ? ResultText(c) : std::string(kNotMeasuredText), c.value ? Tone::kPlain : Tone::kMissing},
         std::move(gauge),
         {percent},
         VerdictCell(c.verdict)});
  }
  document->blocks.emplace_back(std::move(table));
}

// The section that deviates most, and the holes.
void TellPlots(const Report& report, Document* document) {
  const Section* worst = nullptr;
  double greatest = -1;
  for (const Section& section : report.sections) {
    if (section.outlines.nominal.empty()) continue;
    double deviation = 0;
    for (const OutlinePiece& piece : section.outlines.measured)
      for (const OutlinePoint& p : piece.points) deviation = std::max(deviation, std::abs(p.deviation_mm));
    if (deviation > greatest) greatest = deviation, worst = &section;
  }
  Figures row;
  const bool both = worst && !report.holes.empty();
  const PlotSize size{both ? 86.0 : 120.0, 52};
  if (worst) row.figures.push_back(SectionFigure(*worst, size));
  if (!report.holes.empty()) row.figures.push_back(HoleFigure(report.holes, size));
  if (!row.figures.empty()) document->blocks.emplace_back(std::move(row));
}

void TellPicture(const Report& report, Document* document) {
  if (report.deviation_pictures.empty() || report.deviation_pictures.front().views.empty()) {
    document->blocks.emplace_back(Paragraph{"Deviation of the surface: " + std::string(kNotMeasuredText) + ". " +
                                                ToldOr(report.no_picture_reason, "No reason is given."),
                                            Tone::kMissing});
    return;
  }
  document->blocks.emplace_back(Figures{{DeviationFigure(report.deviation_pictures.front())}});
}

}  // namespace

Figure DeviationFigure(const DeviationPicture& picture) {
  std::string sides;
  for (const auto& view : picture.views) sides += (sides.empty() ? "" : ", ") + Told(view->name);
  const std::string scale = Shortest(picture.scale_um), band = Shortest(picture.band_um);
  Figure figure;
  figure.drawing = PlotDeviation(picture, kPortraitWidth_mm, 76);
  figure.alt = "Deviation of the surface from the CAD, seen from: " + sides + ". Blue is inside, red outside, to " +
               scale + " \u00b5m; grey within \u00b1" + band + " \u00b5m; dark and hatched where it was not seen.";
  figure.caption = "Deviation of the surface from the CAD" + (picture.title.empty() ? "" : ", " + Told(picture.title)) +
                   ". Grey within \u00b1" + band + " \u00b5m.";
  return figure;
}

std::string MarkOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kConform:
      return "\u2713";
    case Verdict::kNotConform:
      return "\u2717";
    case Verdict::kUndecidable:
      return "?";
    case Verdict::kNotMeasured:
      break;
  }
  return "\u2013";
}

std::string WordOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kConform:
      return "conform";
    case Verdict::kNotConform:
      return "NOT CONFORM";
    case Verdict::kUndecidable:
      return "undecidable";
    case Verdict::kNotMeasured:
      break;
  }
  return std::string(kNotMeasuredText);
}

Cell VerdictCell(Verdict verdict, bool judged) {
  if (!judged) return {"not judged", Tone::kQuiet};
  return {MarkOf(verdict) + " " + WordOf(verdict), ToneOf(verdict)};
}

std::string ResultText(const Characteristic& c) {
  if (!c.value) return std::string(kNotMeasuredText) + ": " + ToldOr(c.reason, "no reason is given");
  const int decimals = DecimalsFor(c.unit, {});
  const std::string unit = " " + UnitText(c.unit);
  return Fixed(*c.value, decimals) + (c.expanded_uncertainty
                                          ? " \u00b1 " + Fixed(*c.expanded_uncertainty, decimals) + unit
                                          : unit + ", U not known");
}

void TellFirstPage(const Report& report, Document* document) {
  Banner banner{ToneOf(report.verdict), MarkOf(report.verdict), WordOf(report.verdict), "", CountsOf(report)};
  banner.rule = "Rule: " + ToldOr(report.decision_rule);
  document->blocks.emplace_back(std::move(banner));
  if (!report.reason.empty()) document->blocks.emplace_back(Paragraph{Told(report.reason), Tone::kPlain});
  const auto with = [](const std::string& text, const std::string& revision) {
    return ToldOr(text) + (revision.empty() ? "" : ", revision " + Told(revision));
  };
  Facts facts{4, {}};
  facts.facts = {{"Serial number", ToldOr(report.serial)},
                 {"Part", with(report.part, report.part_revision)},
                 {"Drawing", with(report.drawing, report.drawing_revision)},
                 {"Measured", TimeWords(report.measured_at)},
                 {"Work order", ToldOr(report.work_order)},
                 {"Operation", ToldOr(report.operation)},
                 {"Machine", ToldOr(report.traceability.machine)},
                 {"Alignment", ToldOr(report.traceability.fit_state)}};
  document->blocks.emplace_back(std::move(facts));
  TellPicture(report, document);
  TellWorst(report, document);
  TellPlots(report, document);
}

absl::StatusOr<Document> Tell(const Report& report) {
  if (absl::Status status = Check(report); !status.ok()) return status;
  Document document;
  document.title = ToldOr(report.title, "Inspection report");
  document.subtitle = Told(report.plant);
  document.running = ToldOr(report.part) + "  \u00b7  " + ToldOr(report.serial);
  document.date = report.measured_at;
  TellFirstPage(report, &document);
  document.blocks.emplace_back(PageBreak{});
  TellTables(report, &document);
  TellTraceability(report, &document);
  return document;
}

}  // namespace sixpoint::report
