// A drawing against one of the part's revisions that it is valid for: what it names of another revision is refused.
#include <algorithm>
#include <cmath>
#include <string>

#include "services/plant/checks.h"
#include "services/plant/drawing_checks.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;

std::string NameOf(const storage::PartRow& part) { return runtime::RevisedName("parts", part.part_id, part.revision); }

// What there is instead, as far as a person reads it.
template <typename Rows, typename Member>
std::string Known(const Rows& rows, Member member) {
  constexpr std::size_t kMost = 20;
  if (rows.empty()) return " (it has none)";
  std::string text;
  for (std::size_t i = 0; i < std::min(rows.size(), kMost); ++i) text += (i == 0 ? " (" : ", ") + rows[i].*member;
  return text + (rows.size() > kMost ? ", ...)" : ")");
}

absl::Status FitHole(const std::string& field, const std::string& hole, const storage::HoleGroupRow& group,
                     const storage::PartRow& part) {
  const bool known = std::any_of(group.holes.begin(), group.holes.end(),
                                 [&](const storage::HoleRow& row) { return row.hole == hole; });
  if (hole.empty() || known) return absl::OkStatus();
  return Refuse(field, hole,
                "a hole of " + group.group + " of " + NameOf(part) + Known(group.holes, &storage::HoleRow::hole));
}

absl::Status FitCharacteristic(const std::string& at, const storage::CharacteristicRow& one,
                               const storage::PartRow& part) {
  if (one.hole_group.empty()) return absl::OkStatus();
  const auto group = std::find_if(part.hole_groups.begin(), part.hole_groups.end(),
                                  [&](const storage::HoleGroupRow& row) { return row.group == one.hole_group; });
  if (group == part.hole_groups.end())
    return Refuse(at + ".hole_group", one.hole_group,
                  "a hole group of " + NameOf(part) + Known(part.hole_groups, &storage::HoleGroupRow::group));
  runtime::Refusals refusals;
  refusals.Add(FitHole(at + ".hole", one.hole, *group, part)).Add(FitHole(at + ".to_hole", one.to_hole, *group, part));
  if (one.quantity.rfind("HOLE_PITCH", 0) == 0 && group->holes.size() < 2)
    refusals.Add(Refuse(at + ".hole_group", one.hole_group, "a group of two holes or more in " + NameOf(part)));
  constexpr double kSame_mm = 1e-6;
  const double nominal_mm = one.nominal.value_or(0) * (one.unit == "UM" ? 1e-3 : 1);
  if (one.quantity == "HOLE_DIAMETER" && one.nominal && std::abs(nominal_mm - group->diameter_mm) > kSame_mm)
    refusals.Add(
        Refuse(at + ".nominal", *one.nominal,
               NumberText(group->diameter_mm) + " mm, the diameter of " + group->group + " in " + NameOf(part)));
  constexpr double kCosineOfOneDegree = 0.99984769515639127;
  double cosine = 0;
  for (std::size_t k = 0; k < one.along_in_part.size(); ++k) cosine += one.along_in_part[k] * group->axis_in_part[k];
  if (std::abs(cosine) >= kCosineOfOneDegree)
    refusals.Add(Refuse(at + ".along_in_part", "along the axis of " + group->group,
                        "a direction more than 1 deg off the axis of " + group->group + " in " + NameOf(part)));
  return refusals.status();
}

// Of the box of the CAD along the normal.
absl::Status FitSection(const std::string& at, const storage::DrawingSectionRow& section,
                        const storage::PartRow& part) {
  const auto& low = part.tessellation.minimum_mm;
  const auto& high = part.tessellation.maximum_mm;
  const std::vector<double> along_z = {0, 0, 1};
  const std::vector<double>& normal = section.normal_in_part.empty() ? along_z : section.normal_in_part;
  double from_middle_mm = 0, reach_mm = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double origin_mm = section.height_mm ? (k == 2 ? *section.height_mm : 0) : section.origin_in_part_mm[k];
    from_middle_mm += normal[k] * (origin_mm - (low[k] + high[k]) / 2);
    reach_mm += std::abs(normal[k]) * (high[k] - low[k]) / 2;
  }
  if (std::abs(from_middle_mm) < reach_mm) return absl::OkStatus();
  const std::string wanted = "a plane that cuts the CAD's box of " + NameOf(part);
  if (!section.height_mm) return Refuse(at + ".origin_in_part_mm", section.section, wanted);
  return Refuse(at + ".height_mm", *section.height_mm,
                wanted + ", " + NumberText(low[2]) + " to " + NumberText(high[2]) + " mm");
}

absl::Status FitRegion(const std::string& at, const storage::DrawingRegionRow& region, const storage::PartRow& part) {
  for (std::size_t k = 0; k < 3; ++k) {
    const double low_mm = part.tessellation.minimum_mm[k], high_mm = part.tessellation.maximum_mm[k];
    const std::string wanted =
        "a box with some of the CAD of " + NameOf(part) + ", " + NumberText(low_mm) + " to " + NumberText(high_mm);
    if (!region.minimum_in_part_mm.empty() && region.minimum_in_part_mm[k] > high_mm)
      return Refuse(at + ".minimum_in_part_mm." + "xyz"[k] + "_mm", region.minimum_in_part_mm[k], wanted);
    if (!region.maximum_in_part_mm.empty() && region.maximum_in_part_mm[k] < low_mm)
      return Refuse(at + ".maximum_in_part_mm." + "xyz"[k] + "_mm", region.maximum_in_part_mm[k], wanted);
  }
  return absl::OkStatus();
}

absl::Status FitDatums(const std::string& at, const storage::DatumSystemRow& system, const storage::PartRow& part) {
  runtime::Refusals refusals;
  for (std::size_t i = 0; i < system.datums.size(); ++i)
    for (std::size_t k = 0; k < system.datums[i].datum_points.size(); ++k) {
      const std::string& point = system.datums[i].datum_points[k];
      const bool known = std::any_of(part.datum_points.begin(), part.datum_points.end(),
                                     [&](const storage::DatumPointRow& row) { return row.datum == point; });
      if (!known)
        refusals.Add(
            Refuse(at + ".datums[" + std::to_string(i) + "].datum_points[" + std::to_string(k) + "]", point,
                   "a datum point of " + NameOf(part) + Known(part.datum_points, &storage::DatumPointRow::datum)));
    }
  return refusals.status();
}

template <typename Rows, typename Fit>
void AddEach(const char* field, const Rows& rows, const storage::PartRow& part, const Fit& fit,
             runtime::Refusals* refusals) {
  for (std::size_t i = 0; i < rows.size(); ++i)
    refusals->Add(fit(std::string("drawing.") + field + "[" + std::to_string(i) + "]", rows[i], part));
}

}  // namespace

absl::Status FitToPart(const storage::DrawingRow& drawing, const storage::PartRow& part) {
  runtime::Refusals refusals;
  AddEach("regions", drawing.regions, part, FitRegion, &refusals);
  AddEach("sections", drawing.sections, part, FitSection, &refusals);
  AddEach("datum_systems", drawing.datum_systems, part, FitDatums, &refusals);
  AddEach("characteristics", drawing.characteristics, part, FitCharacteristic, &refusals);
  return refusals.status();
}

}  // namespace sixpoint::plant
