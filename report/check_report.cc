#include <algorithm>
#include <cmath>

#include "exchange/verdicts.h"
#include "refusal/refusal.h"
#include "report/check.h"
#include "report/report.h"

namespace sixpoint::report {
namespace {

using exchange::VerdictName;

// A verdict with a value, none without one.
absl::Status CheckJudged(const std::string& at, bool measured, Verdict verdict) {
  if (measured != (verdict == Verdict::kNotMeasured)) return absl::OkStatus();
  return Refuse(at + "verdict", std::string(VerdictName(verdict)),
                measured ? "another, for there is a value" : "NOT_MEASURED, for there is no value");
}

absl::Status CheckNotJudged(const std::string& at, bool limited, Verdict verdict) {
  if (limited) return Refuse(at + "limits", "some", "none, for it is not judged");
  if (verdict == Verdict::kNotMeasured) return absl::OkStatus();
  return Refuse(at + "verdict", std::string(VerdictName(verdict)), "none, for it is not judged");
}

absl::Status CheckHole(const std::string& at, const Hole& hole) {
  Refusals refusals;
  for (const double x : hole.nominal_mm) refusals.Add(CheckNumber(at + "nominal_mm", x));
  if (hole.displacement_mm)
    for (const double x : *hole.displacement_mm) refusals.Add(CheckNumber(at + "displacement_mm", x));
  refusals.Add(CheckUncertainty(at + "position_expanded_uncertainty_mm", hole.position_expanded_uncertainty_mm,
                                hole.displacement_mm.has_value()));
  refusals.Add(CheckUncertainty(at + "inclination_expanded_uncertainty_deg", hole.inclination_expanded_uncertainty_deg,
                                hole.inclination_deg.has_value()));
  refusals.Add(CheckSize(at + "position_limit_mm", hole.position_limit_mm));
  refusals.Add(CheckSize(at + "inclination_limit_deg", hole.inclination_limit_deg));
  refusals.Add(CheckNumber(at + "inclination_deg", hole.inclination_deg));
  // Conform says so of both; any other verdict may rest on one of them.
  const bool position = hole.displacement_mm || !hole.position_limit_mm;
  const bool inclination = hole.inclination_deg || !hole.inclination_limit_deg;
  const bool any = hole.displacement_mm || hole.inclination_deg;
  if (hole.verdict == Verdict::kConform && !(any && position && inclination))
    refusals.Add(Refuse(at + "verdict", "CONFORM", "NOT_MEASURED, for not all of it was measured"));
  if (!hole.judged)
    refusals.Add(CheckNotJudged(at, hole.position_limit_mm || hole.inclination_limit_deg, hole.verdict));
  else if (!any)
    refusals.Add(CheckJudged(at, false, hole.verdict));
  return refusals.status();
}

absl::Status CheckRegion(const std::string& at, const RegionDeviation& region) {
  Refusals refusals;
  refusals.Add(CheckSize(at + "area_mm2", region.area_mm2)).Add(CheckSize(at + "seen_area_mm2", region.seen_area_mm2));
  if (region.seen_area_mm2 > region.area_mm2 * (1 + 1e-9))
    refusals.Add(Refuse(at + "seen_area_mm2", region.seen_area_mm2, "at most area_mm2"));
  if (!region.values) return refusals.status();
  const RegionDeviation::Values& v = *region.values;
  if (!(region.seen_area_mm2 > 0))
    refusals.Add(Refuse(at + "seen_area_mm2", region.seen_area_mm2, "> 0, for values are told of it"));
  for (const double um : {v.mean_um, v.rms_um, v.p05_um, v.p50_um, v.p95_um, v.lowest_um, v.highest_um})
    refusals.Add(CheckNumber(at + "values", um));
  refusals.Add(CheckUncertainty(at + "values.expanded_uncertainty_um", v.expanded_uncertainty_um, true));
  return refusals.status();
}

absl::Status CheckOutlines(const std::string& at, const SectionOutlines& outlines) {
  Refusals refusals;
  std::size_t count = 0;
  for (const auto* pieces : {&outlines.nominal, &outlines.measured})
    for (const OutlinePiece& piece : *pieces) {
      count += piece.points.size();
      if (piece.points.size() < 2)
        refusals.Add(Refuse(at + "points", std::to_string(piece.points.size()), "2 at least in a piece"));
      for (const OutlinePoint& p : piece.points)
        for (const double x : {p.x_mm, p.y_mm, p.normal_x, p.normal_y, p.deviation_mm})
          refusals.Add(CheckNumber(at + "points", x));
    }
  if (count > kMostOutlinePoints)
    refusals.Add(Refuse(at + "points", std::to_string(count), "at most " + std::to_string(kMostOutlinePoints)));
  refusals.Add(CheckNumber(at + "lower_mm", outlines.lower_mm)).Add(CheckNumber(at + "upper_mm", outlines.upper_mm));
  for (const auto& circle : {outlines.greatest_circle, outlines.leading_circle, outlines.trailing_circle})
    if (circle) {
      refusals.Add(CheckNumber(at + "circle", circle->x_mm)).Add(CheckNumber(at + "circle", circle->y_mm));
      refusals.Add(CheckSize(at + "circle.radius_mm", circle->radius_mm));
    }
  if (outlines.chord_mm)
    for (const auto& end : *outlines.chord_mm)
      for (const double x : end) refusals.Add(CheckNumber(at + "chord_mm", x));
  return refusals.status();
}

absl::Status CheckDigest(const std::string& field, const std::string& digest) {
  const bool hex = digest.size() == 64 && digest.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  return digest.empty() || hex ? absl::OkStatus() : Refuse(field, digest, "64 hexadecimal digits");
}

absl::Status CheckTraceability(const Traceability& t) {
  Refusals refusals;
  for (std::size_t i = 0; i < t.scans.size(); ++i)
    refusals.Add(CheckDigest("traceability.scans[" + std::to_string(i) + "].sha256", t.scans[i].sha256));
  for (std::size_t i = 0; i < t.instruments.size(); ++i)
    refusals.Add(
        CheckDigest("traceability.instruments[" + std::to_string(i) + "].file_sha256", t.instruments[i].file_sha256));
  for (const Budget& budget : t.budgets) {
    refusals.Add(CheckUncertainty("traceability.budgets.expanded_uncertainty", budget.expanded_uncertainty, true));
    for (const Budget::Line& line : budget.lines) {
      refusals.Add(CheckSize("traceability.budgets.lines.standard_uncertainty", line.standard_uncertainty));
      refusals.Add(CheckNumber("traceability.budgets.lines.degrees_of_freedom", line.degrees_of_freedom));
    }
  }
  return refusals.status();
}

absl::Status CheckPicture(const std::string& at, const DeviationPicture& picture) {
  Refusals refusals;
  if (picture.views.size() > kMostPictures)
    refusals.Add(
        Refuse(at + ".views", std::to_string(picture.views.size()), "at most " + std::to_string(kMostPictures)));
  for (const auto& view : picture.views) {
    if (!view) return Refuse(at + ".views", "none", "a picture");
    refusals.Add(Under(at, Check(*view)));
  }
  const auto positive = [](double x) { return x > 0 && x < kGreatestNumber; };
  if (!positive(picture.mm_per_px)) refusals.Add(Refuse(at + ".mm_per_px", picture.mm_per_px, "> 0"));
  if (!positive(picture.scale_um)) refusals.Add(Refuse(at + ".scale_um", picture.scale_um, "> 0"));
  if (!(picture.band_um >= 0 && picture.band_um <= picture.scale_um))
    refusals.Add(Refuse(at + ".band_um", picture.band_um, "0 to scale_um"));
  return refusals.status();
}

absl::Status CheckPictures(const Report& report) {
  const std::vector<DeviationPicture>& pictures = report.deviation_pictures;
  if (pictures.size() > kMostPicturedMaps)
    return Refuse("deviation_pictures", std::to_string(pictures.size()),
                  "at most " + std::to_string(kMostPicturedMaps));
  Refusals refusals;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    refusals.Add(CheckPicture("deviation_pictures[" + std::to_string(i) + "]", pictures[i]));
  return refusals.status();
}

std::size_t RowCount(const Report& report) {
  std::size_t rows = report.holes.size() + report.regions.size() + report.traceability.calibrations.size() +
                     report.traceability.scans.size() + report.traceability.software.size() + report.groups.size();
  rows += report.traceability.instruments.size();
  const auto add = [&rows](const std::vector<Characteristic>& characteristics) {
    for (const Characteristic& c : characteristics) rows += 1 + c.others.size();
  };
  for (const CharacteristicGroup& group : report.groups) add(group.characteristics);
  for (const Section& section : report.sections) ++rows, add(section.parameters);
  for (const Budget& budget : report.traceability.budgets) rows += 1 + budget.lines.size();
  return rows;
}

// The blade is conform only if all that is judged of it is, and something is.
absl::Status CheckWhole(const Report& report) {
  if (report.verdict != Verdict::kConform) return absl::OkStatus();
  const std::vector<const Characteristic*> all = JudgedOf(report);
  const bool judges_hole =
      std::any_of(report.holes.begin(), report.holes.end(), [](const Hole& hole) { return hole.judged; });
  if (all.empty() && !judges_hole) return Refuse("verdict", "CONFORM", "NOT_MEASURED, for nothing was judged");
  const auto refuse = [](const std::string& name, Verdict verdict) {
    return Refuse("verdict", "CONFORM", "another, for " + name + " is " + std::string(VerdictName(verdict)));
  };
  for (const Characteristic* c : all)
    if (c->verdict != Verdict::kConform) return refuse(c->id, c->verdict);
  for (const Hole& hole : report.holes)
    if (hole.judged && hole.verdict != Verdict::kConform) return refuse(hole.id, hole.verdict);
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckNumber(const std::string& field, std::optional<double> number) {
  if (!number || std::abs(*number) < kGreatestNumber) return absl::OkStatus();
  return Refuse(field, *number, "finite, less than 1e9");
}

absl::Status CheckSize(const std::string& field, std::optional<double> number) {
  if (!number || (*number >= 0 && *number < kGreatestNumber)) return absl::OkStatus();
  return Refuse(field, *number, "0 to 1e9");
}

absl::Status CheckUncertainty(const std::string& field, std::optional<double> uncertainty, bool measured) {
  if (uncertainty && !measured) return Refuse(field, *uncertainty, "none, for there is no value");
  return CheckSize(field, uncertainty);
}

absl::Status CheckCharacteristic(const std::string& at, const Characteristic& c) {
  Refusals refusals;
  refusals.Add(CheckNumber(at + "nominal", c.nominal)).Add(CheckNumber(at + "value", c.value));
  refusals.Add(CheckNumber(at + "lower", c.lower)).Add(CheckNumber(at + "upper", c.upper));
  if (c.lower && c.upper && *c.lower > *c.upper) refusals.Add(Refuse(at + "lower", *c.lower, "at most upper"));
  refusals.Add(CheckUncertainty(at + "expanded_uncertainty", c.expanded_uncertainty, c.value.has_value()));
  for (const OtherValue& other : c.others)
    refusals.Add(CheckNumber(at + "others.value", other.value))
        .Add(CheckSize(at + "others.expanded_uncertainty", other.expanded_uncertainty));
  refusals.Add(c.judged ? CheckJudged(at, c.value.has_value(), c.verdict)
                        : CheckNotJudged(at, c.lower || c.upper, c.verdict));
  return refusals.status();
}

std::vector<const Characteristic*> JudgedOf(const Report& report) {
  std::vector<const Characteristic*> all;
  const auto add = [&](const std::vector<Characteristic>& characteristics) {
    for (const Characteristic& c : characteristics)
      if (c.judged) all.push_back(&c);
  };
  for (const CharacteristicGroup& group : report.groups) add(group.characteristics);
  for (const Section& section : report.sections) add(section.parameters);
  return all;
}

absl::Status Check(const Report& report) {
  // Before anything is looked at one by one.
  const std::size_t rows = RowCount(report);
  if (rows > kMostRows) return Refuse("rows", std::to_string(rows), "at most " + std::to_string(kMostRows));
  if (report.sections.size() > kMostSections)
    return Refuse("sections", std::to_string(report.sections.size()), "at most " + std::to_string(kMostSections));
  Refusals refusals;
  const auto index = [](const std::string& list, std::size_t i) { return list + "[" + std::to_string(i) + "]."; };
  for (std::size_t g = 0; g < report.groups.size(); ++g)
    for (std::size_t i = 0; i < report.groups[g].characteristics.size(); ++i)
      refusals.Add(
          CheckCharacteristic(index("groups", g) + index("characteristics", i), report.groups[g].characteristics[i]));
  for (std::size_t i = 0; i < report.holes.size(); ++i) refusals.Add(CheckHole(index("holes", i), report.holes[i]));
  for (std::size_t i = 0; i < report.regions.size(); ++i)
    refusals.Add(CheckRegion(index("regions", i), report.regions[i]));
  for (std::size_t s = 0; s < report.sections.size(); ++s) {
    const Section& section = report.sections[s];
    refusals.Add(CheckNumber(index("sections", s) + "height_mm", section.height_mm));
    refusals.Add(CheckOutlines(index("sections", s) + "outlines.", section.outlines));
    for (std::size_t i = 0; i < section.parameters.size(); ++i)
      refusals.Add(CheckCharacteristic(index("sections", s) + index("parameters", i), section.parameters[i]));
  }
  refusals.Add(CheckTraceability(report.traceability)).Add(CheckPictures(report)).Add(CheckWhole(report));
  return refusals.status();
}

}  // namespace sixpoint::report
