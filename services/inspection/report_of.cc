#include "services/inspection/report_of.h"

#include <algorithm>
#include <utility>

#include "services/inspection/report_groups.h"
#include "services/inspection/report_sections.h"
#include "services/inspection/report_words.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using runtime::LastSegment;

template <typename Result>
ResultHead CommonHeadOf(const Result& result) {
  ResultHead head;
  head.name = result.name();
  head.blade = result.blade();
  head.registration = result.registration();
  head.requested_by = result.requested_by();
  head.software_version = result.software_version();
  head.computed_on = result.computed_on();
  head.work_order = result.work_order();
  head.operation = result.operation();
  head.scans.assign(result.scans().begin(), result.scans().end());
  head.recorded_at = runtime::MomentOf(result.recorded_at());
  return head;
}

std::string Told(std::string text, const std::string& more) {
  return text.empty() || more.empty() ? text + more : text + " " + more;
}

// The newest decision stands for the inspection.
std::string DispositionText(const v1::Inspection& inspection) {
  if (inspection.dispositions().empty()) return "";
  const v1::Disposition& newest = inspection.dispositions(0);
  return "Decided by " + newest.requested_by() + ": " +
         WordsOf(v1::DispositionKind_Name(newest.kind()), "DISPOSITION_KIND_") + ", " + newest.reason() +
         (newest.reference().empty() ? "" : " (" + newest.reference() + ")") + ".";
}

std::string FateText(const v1::Assessment& assessment) {
  if (assessment.fate() == v1::BLANK_FATE_UNSPECIFIED) return "";
  const std::string fate = "Before machining: " + WordsOf(v1::BlankFate_Name(assessment.fate()), "BLANK_FATE_");
  return fate + (assessment.fate_reason().empty() ? "." : ": " + assessment.fate_reason() + ".");
}

std::string ReasonOf(const ReportInputs& inputs, bool nothing_judged) {
  std::string reason;
  if (nothing_judged) reason = "No tolerance was judged.";
  if (inputs.assessment) reason = Told(reason, FateText(*inputs.assessment));
  for (const v1::Inspection& inspection : inputs.inspections) {
    reason = Told(reason, DispositionText(inspection));
    if (inspection.positioning().disagrees() && !inspection.positioning().covered())
      reason = Told(reason, "Positionings of the part disagree, and the uncertainties may be too small.");
  }
  return reason;
}

// Of those that have a verdict the worst.
std::optional<report::Verdict> WorstVerdictOf(const ReportInputs& inputs) {
  std::vector<exchange::MeasuredValue> verdicts;
  for (const v1::Inspection& inspection : inputs.inspections)
    verdicts.emplace_back().verdict = FileVerdictOf(inspection.verdict());
  for (const v1::DeviationMap& map : inputs.maps)
    if (map.verdict() != v1::VERDICT_UNSPECIFIED) verdicts.emplace_back().verdict = FileVerdictOf(map.verdict());
  if (verdicts.empty()) return std::nullopt;
  return exchange::WorstOf(verdicts);
}

std::string GeneralRuleOf(const ReportInputs& inputs) {
  if (inputs.assessment) return RuleText(inputs.drawing.decision_rule());
  for (const v1::Inspection& inspection : inputs.inspections)
    if (!inspection.decision_rule().empty()) return inspection.decision_rule();
  for (const v1::DeviationMap& map : inputs.maps)
    if (!map.decision_rule().empty()) return map.decision_rule();
  return "";
}

// Of several results of a kind the one that it is of.
std::string Numbered(const std::string& name, std::size_t index, std::size_t count) {
  return count > 1 ? name + " (" + std::to_string(index + 1) + ")" : name;
}

report::RegionDeviation ReportedRegionOf(const v1::DeviationStatistics& statistics) {
  report::RegionDeviation region;
  region.name = statistics.region().empty() ? "whole surface" : statistics.region();
  region.area_mm2 = statistics.area_mm2();
  region.seen_area_mm2 = std::min(statistics.seen_area_mm2(), statistics.area_mm2());  // sums of the same patches
  if (!statistics.has_mean_um() || !statistics.has_lowest() || !statistics.has_highest()) {
    region.reason = "nothing of it was seen";
    return region;
  }
  report::RegionDeviation::Values& values = region.values.emplace();
  values.mean_um = statistics.mean_um();
  values.rms_um = statistics.rms_um();
  values.p05_um = statistics.p05_um();
  values.p50_um = statistics.p50_um();
  values.p95_um = statistics.p95_um();
  values.lowest_um = statistics.lowest().mean_um();
  values.highest_um = statistics.highest().mean_um();
  values.expanded_uncertainty_um =
      std::max(statistics.lowest().expanded_uncertainty_um(), statistics.highest().expanded_uncertainty_um());
  return region;
}

std::vector<report::RegionDeviation> RegionsOf(const ReportInputs& inputs) {
  std::vector<report::RegionDeviation> regions;
  for (std::size_t i = 0; i < inputs.maps.size(); ++i)
    for (const v1::DeviationStatistics& statistics : inputs.maps[i].statistics()) {
      report::RegionDeviation& region = regions.emplace_back(ReportedRegionOf(statistics));
      region.name = Numbered(region.name, i, inputs.maps.size());
      region.fit_state = FitStateOf(inputs.maps[i].method());
    }
  return regions;
}

// Of a section's profile as the drawing has it, where it lies about the CAD.
void SetBand(const ReportInputs& inputs, const Balloons& balloons, const std::string& section,
             report::SectionOutlines* outlines) {
  if (!inputs.assessment) return;
  for (const v1::CharacteristicFinding& finding : inputs.assessment->findings()) {
    if (finding.quantity() != plant::v1::CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM_AND_LOCATION) continue;
    const auto drawn = balloons.find(finding.characteristic());
    if (drawn == balloons.end() || drawn->second->section() != section) continue;
    const double unit_mm = finding.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1e-3 : 1;
    if (finding.has_lower_limit()) outlines->lower_mm = unit_mm * finding.lower_limit();
    if (finding.has_upper_limit()) outlines->upper_mm = unit_mm * finding.upper_limit();
    return;
  }
}

std::vector<report::Section> SectionsOf(const ReportInputs& inputs) {
  const Balloons balloons = BalloonsOf(inputs.drawing);
  std::vector<report::Section> sections;
  for (std::size_t m = 0; m < inputs.sections.size(); ++m) {
    const v1::SectionMeasurement& measurement = inputs.sections[m];
    for (int i = 0; i < measurement.sections_size(); ++i) {
      const bool has_outline = m < inputs.outlines.size() && i < static_cast<int>(inputs.outlines[m].size());
      report::Section& section = sections.emplace_back(
          SectionOf(measurement.sections(i), has_outline ? inputs.outlines[m][static_cast<std::size_t>(i)]
                                                         : v1::SectionOutline::default_instance()));
      SetBand(inputs, balloons, section.name, &section.outlines);
      section.name = Numbered(section.name, m, inputs.sections.size());
      section.fit_state = FitStateOf(measurement.method());
    }
  }
  return sections;
}

void SetHead(const ReportInputs& inputs, report::Report* report) {
  const std::vector<ResultHead> heads = HeadsOf(inputs);
  const auto newest = std::max_element(heads.begin(), heads.end(), [](const ResultHead& a, const ResultHead& b) {
    return a.recorded_at < b.recorded_at;
  });
  report->title = "Inspection report";
  if (newest != heads.end()) {
    report->serial = LastSegment(newest->blade);
    report->measured_at = newest->recorded_at;
    report->work_order = newest->work_order;
    report->operation = newest->operation;
  }
  report->part = LastSegment(inputs.part.name());
  report->part_revision = std::to_string(inputs.part.revision());
  report->decision_rule = GeneralRuleOf(inputs);
  if (!inputs.assessment) return;
  report->title = inputs.assessment->stage() == v1::ASSESSMENT_STAGE_BEFORE_MACHINING ? "Assessment before machining"
                                                                                      : "Assessment";
  report->serial = LastSegment(inputs.assessment->blade());
  if (newest == heads.end()) report->measured_at = runtime::MomentOf(inputs.assessment->recorded_at());
  report->drawing = inputs.drawing.drawing_number();
  report->drawing_revision = inputs.drawing.drawing_revision();
  report->work_order = inputs.assessment->work_order();
  report->operation = inputs.assessment->operation();
}

}  // namespace

ResultHead HeadOf(const v1::Inspection& inspection) {
  ResultHead head = CommonHeadOf(inspection);
  head.method = inspection.positioning().method();
  return head;
}

ResultHead HeadOf(const v1::DeviationMap& map) {
  ResultHead head = CommonHeadOf(map);
  head.method = map.method();
  return head;
}

ResultHead HeadOf(const v1::SectionMeasurement& measurement) {
  ResultHead head = CommonHeadOf(measurement);
  head.method = measurement.method();
  return head;
}

std::vector<ResultHead> HeadsOf(const ReportInputs& inputs) {
  std::vector<ResultHead> heads;
  for (const v1::Inspection& inspection : inputs.inspections) heads.push_back(HeadOf(inspection));
  for (const v1::DeviationMap& map : inputs.maps) heads.push_back(HeadOf(map));
  for (const v1::SectionMeasurement& measurement : inputs.sections) heads.push_back(HeadOf(measurement));
  return heads;
}

report::Report ReportOf(const ReportInputs& inputs) {
  report::Report out;
  SetHead(inputs, &out);
  const std::optional<report::Verdict> verdict =
      inputs.assessment ? FileVerdictOf(inputs.assessment->verdict()) : WorstVerdictOf(inputs);
  out.verdict = verdict.value_or(report::Verdict::kNotMeasured);
  out.reason = ReasonOf(inputs, !verdict.has_value());
  if (inputs.assessment) {
    out.groups = GroupsOf(*inputs.assessment, inputs.drawing, inputs.measurements);
  } else {
    for (const v1::Inspection& inspection : inputs.inspections) AddGroupsOf(inspection, &out.groups);
    for (const v1::DeviationMap& map : inputs.maps) AddGroupsOf(map, &out.groups);
  }
  for (report::CharacteristicGroup& group : out.groups)
    if (group.rule == out.decision_rule) group.rule.clear();
  out.holes = ReportedHolesOf(inputs);
  out.regions = RegionsOf(inputs);
  out.sections = SectionsOf(inputs);
  out.deviation_pictures = inputs.pictures;
  for (std::size_t i = 0; inputs.maps.size() > 1 && i < out.deviation_pictures.size(); ++i)
    out.deviation_pictures[i].title = Numbered("after " + FitStateOf(inputs.maps[i].method()), i, inputs.maps.size());
  out.no_picture_reason = inputs.no_picture_reason;
  if (!inputs.pictures.empty()) out.pictures_left_out = inputs.maps.size() - inputs.pictures.size();
  out.traceability = TraceabilityOf(inputs);
  return out;
}

}  // namespace sixpoint::inspection
