// Drawings by themselves: title block, rules, datum systems and places.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "services/plant/checks.h"
#include "services/plant/drawing_checks.h"
#include "services/plant/surface_where.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/decision_rule_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

constexpr double kGreatestHeight_mm = 1e5;
constexpr double kCosineOfOneDegree = 0.99984769515639127;

std::string At(const char* field, int i) { return std::string("drawing.") + field + "[" + std::to_string(i) + "]"; }

absl::Status ReadTitle(const v1::Drawing& in, storage::DrawingRow* row) {
  row->drawing_number = in.drawing_number();
  row->drawing_revision = in.drawing_revision();
  row->part_number = in.part_number();
  row->part_name = in.part_name();
  row->part_revision_level = in.part_revision_level();
  runtime::Refusals refusals;
  refusals.Add(CheckSaid("drawing.drawing_number", in.drawing_number()))
      .Add(CheckSaid("drawing.drawing_revision", in.drawing_revision()))
      .Add(CheckSaid("drawing.part_number", in.part_number()))
      .Add(CheckSaid("drawing.part_name", in.part_name()))
      .Add(CheckSaidOrEmpty("drawing.part_revision_level", in.part_revision_level()));
  std::set<std::string> changes;
  for (int i = 0; i < in.additional_changes_size(); ++i) {
    refusals.Add(CheckCalled(At("additional_changes", i), in.additional_changes(i), &changes));
    row->additional_changes.push_back(in.additional_changes(i));
  }
  if (in.part_revisions().empty())
    refusals.Add(Refuse("drawing.part_revisions", "none", "the part's revisions that it is valid for"));
  for (int i = 0; i < in.part_revisions_size(); ++i) {
    const int least = i == 0 ? 1 : std::max(0, in.part_revisions(i - 1)) + 1;
    if (in.part_revisions(i) < least)
      refusals.Add(Refuse(At("part_revisions", i), in.part_revisions(i),
                          std::to_string(least) + " or more: each revision once, ascending"));
    row->part_revisions.push_back(in.part_revisions(i));
  }
  return refusals.status();
}

absl::Status ReadRegions(const v1::Drawing& in, storage::DrawingRow* drawing) {
  runtime::Refusals refusals;
  std::set<std::string> called;
  for (int i = 0; i < in.regions_size(); ++i) {
    const v1::DrawingRegion& one = in.regions(i);
    const std::string at = At("regions", i);
    storage::DrawingRegionRow row;
    row.region = one.region();
    refusals.Add(CheckCalled(at + ".region", one.region(), &called));
    refusals.Add(ReadWhere(at, one, &row));
    if (!IsBounded(one)) refusals.Add(Refuse(at, "not bounded", "a corner of its box or facing_in_part"));
    drawing->regions.push_back(std::move(row));
  }
  return refusals.status();
}

absl::Status CheckReference(const std::string& field, const storage::DrawingSectionRow& row) {
  static const std::vector<double> kX = {1, 0, 0}, kZ = {0, 0, 1};
  const std::vector<double>& n = row.normal_in_part.empty() ? kZ : row.normal_in_part;
  const std::vector<double>& r = row.reference_in_part.empty() ? kX : row.reference_in_part;
  const double cosine = n[0] * r[0] + n[1] * r[1] + n[2] * r[2];
  if (std::abs(cosine) < kCosineOfOneDegree) return absl::OkStatus();
  return Refuse(field, row.reference_in_part.empty() ? "the part's x" : "along the normal",
                "a direction more than 1 deg off the normal");
}

absl::Status ReadSections(const v1::Drawing& in, storage::DrawingRow* drawing) {
  runtime::Refusals refusals;
  std::set<std::string> called;
  for (int i = 0; i < in.sections_size(); ++i) {
    const v1::DrawingSection& one = in.sections(i);
    const std::string at = At("sections", i);
    storage::DrawingSectionRow row;
    row.section = one.section();
    refusals.Add(CheckCalled(at + ".section", one.section(), &called));
    if (one.has_height_mm() == one.has_origin_in_part_mm())
      refusals.Add(Refuse(at + ".height_mm", one.has_height_mm() ? "one beside an origin" : "",
                          "a height, or else origin_in_part_mm"));
    if (one.has_height_mm()) {
      row.height_mm = one.height_mm();
      refusals.Add(
          CheckRange(at + ".height_mm", one.height_mm(), -kGreatestHeight_mm, kGreatestHeight_mm, "-100000 to 100000"));
      if (one.has_normal_in_part()) refusals.Add(Refuse(at + ".normal_in_part", "one", "none beside a height"));
    }
    if (one.has_origin_in_part_mm())
      refusals.Add(Read(at + ".origin_in_part_mm", true, one.origin_in_part_mm(), &row.origin_in_part_mm));
    if (one.has_normal_in_part())
      refusals.Add(Read(at + ".normal_in_part", true, one.normal_in_part(), &row.normal_in_part));
    if (one.has_reference_in_part())
      refusals.Add(Read(at + ".reference_in_part", true, one.reference_in_part(), &row.reference_in_part));
    if (one.has_leading_in_part_mm())
      refusals.Add(Read(at + ".leading_in_part_mm", true, one.leading_in_part_mm(), &row.leading_in_part_mm));
    if (one.has_near_in_part_mm())
      refusals.Add(Read(at + ".near_in_part_mm", true, one.near_in_part_mm(), &row.near_in_part_mm));
    row.half_width_mm = one.half_width_mm();
    refusals.Add(CheckRange(at + ".half_width_mm", one.half_width_mm(), 0.01, 2, "0.01 to 2"))
        .Add(CheckReference(at + ".reference_in_part", row));
    drawing->sections.push_back(std::move(row));
  }
  return refusals.status();
}

absl::Status ReadDatums(const std::string& at, const v1::DatumSystem& in, storage::DatumSystemRow* row) {
  runtime::Refusals refusals;
  if (in.datums().empty() || in.datums_size() > 3)
    refusals.Add(Refuse(at + ".datums", std::to_string(in.datums_size()) + " datums", "1 to 3"));
  const bool by_points = row->positioning.rfind("SIX_POINT", 0) == 0;
  std::string joined;
  std::set<std::string> letters, points;
  for (int i = 0; i < in.datums_size(); ++i) {
    const v1::Datum& one = in.datums(i);
    const std::string field = at + ".datums[" + std::to_string(i) + "]";
    const bool letter =
        !one.datum().empty() && one.datum().size() <= 2 &&
        std::all_of(one.datum().begin(), one.datum().end(), [](char c) { return c >= 'A' && c <= 'Z'; });
    if (!letter || !letters.insert(one.datum()).second)
      refusals.Add(Refuse(field + ".datum", one.datum(), "one or two of A to Z, each once in its system"));
    const int wanted = by_points ? 3 - i : 0;
    if (one.datum_points_size() != wanted)
      refusals.Add(Refuse(field + ".datum_points", std::to_string(one.datum_points_size()) + " points",
                          by_points ? "3 of the primary, 2 of the secondary and 1 of the tertiary datum"
                                    : "none, for " + row->positioning));
    for (int k = 0; k < one.datum_points_size(); ++k)
      refusals.Add(CheckCalled(field + ".datum_points[" + std::to_string(k) + "]", one.datum_points(k), &points));
    joined += (i == 0 ? "" : "|") + one.datum();
    row->datums.push_back({one.datum(), {one.datum_points().begin(), one.datum_points().end()}});
  }
  if (by_points && in.datums_size() != 3)
    refusals.Add(Refuse(at + ".datums", std::to_string(in.datums_size()) + " datums", "3, for " + row->positioning));
  if (joined != in.datum_system())
    refusals.Add(Refuse(at + ".datum_system", in.datum_system(), "the letters of its datums, " + joined));
  return refusals.status();
}

absl::Status ReadDatumSystems(const v1::Drawing& in, storage::DrawingRow* drawing) {
  runtime::Refusals refusals;
  std::set<std::string> called;
  for (int i = 0; i < in.datum_systems_size(); ++i) {
    const v1::DatumSystem& one = in.datum_systems(i);
    const std::string at = At("datum_systems", i);
    storage::DatumSystemRow row;
    row.datum_system = one.datum_system();
    row.region = one.region();
    refusals.Add(CheckCalled(at + ".datum_system", one.datum_system(), &called))
        .Add(runtime::ReadWord(at + ".positioning", one.positioning(), &row.positioning))
        .Add(ReadDatums(at, one, &row));
    const bool known =
        std::any_of(drawing->regions.begin(), drawing->regions.end(),
                    [&](const storage::DrawingRegionRow& region) { return region.region == row.region; });
    if (row.positioning == "LOCAL" ? !known : !row.region.empty())
      refusals.Add(
          Refuse(at + ".region", row.region,
                 row.positioning == "LOCAL" ? "one of the drawing's regions" : "none, for " + row.positioning));
    drawing->datum_systems.push_back(std::move(row));
  }
  return refusals.status();
}

absl::Status ReadNeighbour(const v1::Drawing& in, storage::DrawingRow* drawing) {
  if (!in.has_neighbour()) return absl::OkStatus();
  const std::string at = "drawing.neighbour";
  auto& offset_mm = drawing->neighbour_offset_in_part_mm;
  runtime::Refusals refusals;
  refusals.Add(Read(at + ".offset_in_part_mm", in.neighbour().has_offset_in_part_mm(),
                    in.neighbour().offset_in_part_mm(), &offset_mm));
  if (!offset_mm.empty() && std::all_of(offset_mm.begin(), offset_mm.end(), [](double one) { return one == 0; }))
    refusals.Add(Refuse(at + ".offset_in_part_mm", "0, 0, 0", "the way to another blade"));
  drawing->neighbour_standard_uncertainty_um = in.neighbour().standard_uncertainty_um();
  if (!in.neighbour().has_standard_uncertainty_um())
    refusals.Add(Refuse(at + ".standard_uncertainty_um", "", "0 to 1000"));
  refusals.Add(
      CheckRange(at + ".standard_uncertainty_um", in.neighbour().standard_uncertainty_um(), 0, 1000, "0 to 1000"));
  return refusals.status();
}

absl::Status ReadRequirements(const v1::Drawing& in, storage::DrawingRow* drawing) {
  runtime::Refusals refusals;
  for (int i = 0; i < in.product_requirements_size(); ++i) {
    const v1::ProductRequirement& one = in.product_requirements(i);
    const std::string at = At("product_requirements", i);
    storage::ProductRequirementRow row{"", one.requirement(), one.specification(), one.code(), one.customer_approval()};
    refusals.Add(runtime::ReadWord(at + ".kind", one.kind(), &row.kind))
        .Add(CheckSaid(at + ".requirement", row.requirement))
        .Add(CheckSaid(at + ".specification", row.specification))
        .Add(CheckSaidOrEmpty(at + ".code", row.code));
    drawing->product_requirements.push_back(std::move(row));
  }
  return refusals.status();
}

}  // namespace

absl::Status CheckSaid(const std::string& field, const std::string& text) {
  if (text.empty()) return Refuse(field, "", "a text");
  return CheckSaidOrEmpty(field, text);
}

absl::Status CheckSaidOrEmpty(const std::string& field, const std::string& text) {
  const bool printable =
      std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; });
  if (!printable) return Refuse(field, "text with control characters", "text without them");
  if (!text.empty() && (text.front() == ' ' || text.back() == ' '))
    return Refuse(field, text, "a text without blanks before or after it");
  return absl::OkStatus();
}

absl::Status CheckCalled(const std::string& field, const std::string& called, std::set<std::string>* before) {
  if (absl::Status said = CheckSaid(field, called); !said.ok()) return said;
  if (!before->insert(called).second) return Refuse(field, called, "another one: it is used before");
  return absl::OkStatus();
}

absl::StatusOr<storage::DrawingRow> Validated(const v1::CreateDrawingRequest& request) {
  const v1::Drawing& drawing = request.drawing();
  storage::DrawingRow row;
  row.drawing_id = request.drawing_id();
  const absl::StatusOr<std::string> part_id = runtime::IdOf("drawing.part", "parts", drawing.part());
  if (part_id.ok()) row.part_id = *part_id;
  runtime::Refusals refusals;
  refusals.Add(runtime::CheckId("drawing_id", row.drawing_id)).Add(part_id.status()).Add(ReadTitle(drawing, &row));
  if (request.has_revises()) {
    row.revises = request.revises();
    if (request.revises() < 0) refusals.Add(Refuse("revises", request.revises(), "0 or more"));
  }
  refusals.Add(runtime::ReadDecisionRule("drawing.decision_rule", drawing.decision_rule(), &row.decision_rule))
      .Add(ReadRegions(drawing, &row))
      .Add(ReadSections(drawing, &row))
      .Add(ReadDatumSystems(drawing, &row))
      .Add(ReadNeighbour(drawing, &row))
      .Add(ReadCharacteristics(drawing, &row))
      .Add(ReadRequirements(drawing, &row));
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  v1::Drawing described = drawing;
  described.clear_requested_by();  // ours to say
  described.clear_characteristic_count();
  row.content_sha256 = ContentSha256(std::move(described));
  return row;
}

}  // namespace sixpoint::plant
