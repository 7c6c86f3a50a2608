#include "services/inspection/section_rows.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "services/clients/registered_row.h"
#include "services/runtime/little_endian.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/row_geometry.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/units.h"
#include "storage/blobs.h"

namespace sixpoint::inspection {
namespace {

using metrology::SectionParameter;
using storage::SectionValueRow;

constexpr char kNoOutline[] = "no outline was found";
constexpr char kBoundless[] = "boundless: what it is told of is straight";
// What the record keeps: the circle of a straight edge has no radius.
constexpr double kGreatestKept = 1e9;
bool IsKept(double number) { return std::abs(number) < kGreatestKept; }

// By SectionParameter's order.
struct ToldParameter {
  const char* parameter;
  const char* unit;
};
constexpr std::array<ToldParameter, metrology::kSectionParameterCount> kTold = {{
    {"CHORD_NOSE_TAIL", "MM"},     {"CHORD_CALIPER", "MM"},
    {"CHORD_TANGENT", "MM"},       {"STAGGER_NOSE_TAIL", "DEG"},
    {"STAGGER_CALIPER", "DEG"},    {"STAGGER_TANGENT", "DEG"},
    {"THICKNESS_INSCRIBED", "MM"}, {"THICKNESS_INSCRIBED_PLACE", "RATIO"},
    {"THICKNESS_TWO_POINT", "MM"}, {"THICKNESS_TWO_POINT_PLACE", "RATIO"},
    {"INSCRIBED_X", "MM"},         {"INSCRIBED_Y", "MM"},
    {"LEADING_RADIUS", "MM"},      {"LEADING_FORM", "MM"},
    {"TRAILING_RADIUS", "MM"},     {"TRAILING_FORM", "MM"},
    {"CAMBER_HEIGHT", "MM"},       {"CAMBER_HEIGHT_PLACE", "RATIO"},
    {"LEADING_X", "MM"},           {"LEADING_Y", "MM"},
    {"TRAILING_X", "MM"},          {"TRAILING_Y", "MM"},
}};

const char* EndKindText(metrology::EndKind kind) {
  switch (kind) {
    case metrology::EndKind::kRound:
      return "ROUND";
    case metrology::EndKind::kSquare:
      return "SQUARE";
    case metrology::EndKind::kSharp:
      return "SHARP";
    case metrology::EndKind::kNotSeen:
      break;
  }
  return "NOT_SEEN";
}

SectionValueRow ValueRowOf(const SectionFinding& finding, std::size_t i) {
  const auto parameter = static_cast<SectionParameter>(i);
  SectionValueRow row{kTold[i].parameter, kTold[i].unit, {}, {}, {}, {}, {}, {}, ""};
  const double scale = std::string(kTold[i].unit) == "DEG" ? runtime::kDegPerRad : 1;
  if (finding.nominal_values[parameter] && IsKept(scale * *finding.nominal_values[parameter]))
    row.nominal = scale * *finding.nominal_values[parameter];
  if (!finding.measured) {
    row.reason = kNoOutline;
  } else if (!finding.values.values[parameter]) {
    row.reason = metrology::ReasonOf(finding.values.values.reason(parameter));
  } else if (const metrology::ParameterUncertainty& u = finding.values.uncertainty(parameter);
             !IsKept(scale * *finding.values.values[parameter]) || !IsKept(scale * u.expanded) ||
             !IsKept(scale * u.by_noise) || !IsKept(scale * u.by_form) || !IsKept(scale * u.by_pose)) {
    row.reason = kBoundless;
  } else {
    row.value = scale * *finding.values.values[parameter];
    row.expanded_uncertainty = scale * u.expanded;
    row.by_noise = scale * u.by_noise;
    row.by_form = scale * u.by_form;
    row.by_pose = scale * u.by_pose;
  }
  return row;
}

// Of a profile nothing is drawn but 0.
void AddProfile(const SectionFinding& finding, std::vector<SectionValueRow>* rows) {
  const auto add = [&](const char* parameter, double value_mm, double expanded_mm) {
    SectionValueRow row{parameter, "MM", 0, {}, {}, {}, {}, {}, ""};
    if (finding.measured) {
      row.value = value_mm;
      row.expanded_uncertainty = expanded_mm;
    } else {
      row.reason = kNoOutline;
    }
    rows->push_back(std::move(row));
  };
  const metrology::MeasuredSection::Profile profile =
      finding.measured && finding.values.profile ? *finding.values.profile : metrology::MeasuredSection::Profile();
  add("PROFILE_LOCATION_LEAST", profile.deviation.location.least_mm, profile.location_least_expanded_mm);
  add("PROFILE_LOCATION_GREATEST", profile.deviation.location.greatest_mm, profile.location_greatest_expanded_mm);
  add("PROFILE_FORM_LEAST", profile.deviation.form.least_mm, profile.form_least_expanded_mm);
  add("PROFILE_FORM_GREATEST", profile.deviation.form.greatest_mm, profile.form_greatest_expanded_mm);
}

void AddSpan(const char* parameter, const char* unit, const std::optional<SpanFinding>& span,
             std::vector<SectionValueRow>* rows) {
  if (!span) return;
  const double scale = std::string(unit) == "DEG" ? runtime::kDegPerRad : 1;
  SectionValueRow row{parameter, unit, span->nominal, {}, {}, {}, {}, {}, span->reason};
  if (span->value) {
    row.value = scale * *span->value;
    row.expanded_uncertainty = scale * span->expanded;
  }
  rows->push_back(std::move(row));
}

storage::SectionRow SectionRowOf(const SectionOrder::Section& section, const SectionFinding& finding) {
  storage::SectionRow row;
  row.section = section.name;
  row.origin_in_part_mm = runtime::ThreeOf(section.plane.origin_mm);
  row.normal_in_part = runtime::ThreeOf(section.plane.normal);
  row.reference_in_part = runtime::ThreeOf(section.plane.reference);
  if (section.leading_mm) row.leading_in_part_mm = runtime::ListOf(*section.leading_mm);
  if (section.near_mm) row.near_in_part_mm = runtime::ListOf(*section.near_mm);
  row.point_count = finding.evidence.used_count;
  row.outlier_count = finding.evidence.outlier_count;
  row.reason = finding.reason;
  if (finding.measured) {
    const metrology::FittedOutline& fitted = finding.measured->fitted;
    row.found = storage::SectionRow::Found{EndKindText(finding.values.values.leading),
                                           EndKindText(finding.values.values.trailing),
                                           runtime::kUmPerMm * fitted.sample_sigma_mm,
                                           runtime::kUmPerMm * finding.values.form.sigma_mm,
                                           finding.values.form.length_mm,
                                           fitted.outline.gap_length_mm() / fitted.outline.length_mm()};
  }
  for (std::size_t i = 0; i < kTold.size(); ++i) row.values.push_back(ValueRowOf(finding, i));
  AddProfile(finding, &row.values);
  AddSpan("TWIST", "DEG", finding.twist, &row.values);
  AddSpan("BOW_X", "MM", finding.bow_x, &row.values);
  AddSpan("BOW_Y", "MM", finding.bow_y, &row.values);
  AddSpan("THROAT", "MM", finding.throat, &row.values);
  return row;
}

void AddPoints(const metrology::Outline& outline, std::vector<double>* xy_mm) {
  for (const metrology::OutlineNode& node : outline.nodes())
    xy_mm->insert(xy_mm->end(), {node.point_mm.x(), node.point_mm.y()});
}

storage::SectionOutlineRow OutlineRowOf(const SectionOrder::Section& section, const SectionFinding& finding) {
  storage::SectionOutlineRow row;
  row.part_from_section = runtime::RowMajor(section.part_from_section.matrix().topRows<3>());
  AddPoints(finding.nominal.fitted.outline, &row.nominal_mm);
  if (!finding.measured) return row;
  const metrology::Outline& outline = finding.measured->fitted.outline;
  AddPoints(outline, &row.measured_mm);
  for (const double deviation_mm : finding.values.profile->deviation.location_mm)
    row.deviations_um.push_back(runtime::kUmPerMm * deviation_mm);
  for (std::size_t i = 0; i < outline.size(); ++i)
    if (outline.nodes()[i].before == metrology::Join::kGap) row.gaps_before.push_back(static_cast<std::int64_t>(i));
  return row;
}

std::string DigestOf(const std::vector<storage::SectionOutlineRow>& outlines) {
  std::string bytes;
  for (const storage::SectionOutlineRow& outline : outlines) {
    for (const auto* numbers :
         {&outline.part_from_section, &outline.nominal_mm, &outline.measured_mm, &outline.deviations_um})
      runtime::AppendReals(*numbers, &bytes);
    for (const std::int64_t gap : outline.gaps_before)
      runtime::Append<std::uint32_t>(static_cast<std::int32_t>(gap), &bytes);
  }
  return storage::Sha256Hex(bytes);
}

}  // namespace

runtime::Made<storage::SectionMeasurementRow> RecordOf(const clients::RegisteredBlade& blade, const SectionOrder& order,
                                                       const std::vector<SectionFinding>& findings) {
  const registration::v1::Registration& registration = blade.registration;
  storage::SectionMeasurementRow row;
  row.section_measurement_id = storage::NewUuid();
  clients::SetRegistered(registration, &row);
  row.half_width_mm = order.half_width_mm;
  row.reference_section = order.sections[order.reference].name;
  if (order.neighbour) {
    row.neighbour_offset_in_part_mm = runtime::ListOf(order.neighbour->offset_mm);
    row.neighbour_standard_uncertainty_um = runtime::kUmPerMm * order.neighbour->standard_uncertainty_mm;
  }
  int measured = 0;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    row.sections.push_back(SectionRowOf(order.sections[i], findings[i]));
    row.outlines.push_back(OutlineRowOf(order.sections[i], findings[i]));
    if (findings[i].measured) ++measured;
  }
  row.outlines_sha256 = DigestOf(row.outlines);
  storage::RecordEntry entry =
      clients::EntryOf("section", runtime::NameOf("sections", row.section_measurement_id), registration);
  entry.summary_json = nlohmann::json({{"sections", findings.size()}, {"measured", measured}}).dump();
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::inspection
