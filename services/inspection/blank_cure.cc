#include "services/inspection/blank_cure.h"

#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "metrology/inspection/cure.h"
#include "services/inspection/deviation_order.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;
using namespace plant::v1;  // NOLINT: quantities' names say whose they are

// Of what one motion has to meet: a call's memory and time.
constexpr std::size_t kMostPatches = 500'000;

// What a rigid motion does not change.
bool IsOfShape(CharacteristicQuantity quantity) {
  static const std::set<CharacteristicQuantity> kOfShape = {CHARACTERISTIC_QUANTITY_SECTION_CHORD,
                                                            CHARACTERISTIC_QUANTITY_SECTION_THICKNESS,
                                                            CHARACTERISTIC_QUANTITY_SECTION_THICKNESS_PLACE,
                                                            CHARACTERISTIC_QUANTITY_SECTION_LEADING_EDGE_RADIUS,
                                                            CHARACTERISTIC_QUANTITY_SECTION_TRAILING_EDGE_RADIUS,
                                                            CHARACTERISTIC_QUANTITY_SECTION_LEADING_EDGE_FORM,
                                                            CHARACTERISTIC_QUANTITY_SECTION_TRAILING_EDGE_FORM,
                                                            CHARACTERISTIC_QUANTITY_SECTION_CAMBER_HEIGHT,
                                                            CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM,
                                                            CHARACTERISTIC_QUANTITY_TWIST};
  return kOfShape.count(quantity) > 0;
}

// What a rigid motion may take out of its limits.
bool IsMoved(CharacteristicQuantity quantity) {
  static const std::set<CharacteristicQuantity> kMoved = {
      CHARACTERISTIC_QUANTITY_SECTION_STAGGER, CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM_AND_LOCATION,
      CHARACTERISTIC_QUANTITY_BOW_X, CHARACTERISTIC_QUANTITY_BOW_Y, CHARACTERISTIC_QUANTITY_THROAT};
  return kMoved.count(quantity) > 0;
}

bool IsLocated(const Characteristic& characteristic) {
  return characteristic.quantity() == CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION;
}

// Patches of some profiles, each with where it is from.
struct ZonePatches {
  std::vector<metrology::LimitedPatch> patches;
  std::vector<storage::LimitConflictRow> told;  // as many
};

metrology::SurfaceRegion KernelRegion(const Drawing& drawing, const std::string& name) {
  for (const DrawingRegion& region : drawing.regions())
    if (region.region() == name)
      if (const auto kernel = KernelRegionOf("region", RegionOf(region)); kernel.ok()) return kernel->region;
  return {};
}

void AddPatches(const AssessmentInputs& inputs, const Characteristic& characteristic, int result_index,
                ZonePatches* zone) {
  const storage::DeviationPatchesRow& rows = inputs.patches.at(result_index);
  const metrology::SurfaceRegion region = KernelRegion(inputs.drawing, characteristic.region());
  const v1::ProfileTolerance tolerance = ToleranceOf(inputs.drawing, characteristic);
  const metrology::DecisionRule rule = KernelRuleOf(tolerance.decision_rule());
  const auto three = [](const std::vector<double>& of, std::size_t i) {
    return Eigen::Vector3d(of[3 * i], of[3 * i + 1], of[3 * i + 2]);
  };
  for (std::size_t i = 0; i < rows.means_um.size(); ++i) {
    const Eigen::Vector3d centre_mm = three(rows.centres_in_part_mm, i), normal = three(rows.normals_in_part, i);
    if (!std::isfinite(rows.means_um[i]) || !region.Has(centre_mm, normal)) continue;
    zone->patches.push_back({centre_mm, normal, runtime::kMmPerUm * rows.means_um[i],
                             rule.sure_guard_factor() * runtime::kMmPerUm * rows.expanded_uncertainties_um[i],
                             rule.guard_factor * runtime::kMmPerUm * rows.expanded_uncertainties_um[i],
                             tolerance.lower_mm(), tolerance.upper_mm()});
    zone->told.push_back({characteristic.characteristic(),
                          result_index,
                          static_cast<int>(i),
                          rows.means_um[i],
                          rows.expanded_uncertainties_um[i],
                          {centre_mm.x(), centre_mm.y(), centre_mm.z()},
                          false,
                          0});
  }
}

absl::StatusOr<std::string> CureOf(const ZonePatches& zone, const std::function<bool()>& keep_going,
                                   Assessed* assessed) {
  if (zone.patches.empty() || zone.patches.size() > kMostPatches) return std::string("UNKNOWN");
  const auto found = metrology::FindCure(zone.patches, keep_going);
  if (!found.ok()) return found.status();
  if (found->cure == metrology::Cure::kNone && assessed->conflicts.empty())
    for (const metrology::CureFinding::Conflict& conflict : found->conflicts) {
      storage::LimitConflictRow row = zone.told[conflict.patch];
      row.above = conflict.above;
      row.share = conflict.share;
      assessed->conflicts.push_back(std::move(row));
    }
  return std::string(found->cure == metrology::Cure::kNone       ? "NONE"
                     : found->cure == metrology::Cure::kPossible ? "POSSIBLE"
                                                                 : "UNKNOWN");
}

// Of each finding, in their order.
std::vector<const Characteristic*> CharacteristicsOf(const AssessmentInputs& inputs, const Assessed& assessed) {
  std::map<std::string, const Characteristic*> by_number;
  for (const Characteristic& one : inputs.drawing.characteristics()) by_number[one.characteristic()] = &one;
  std::vector<const Characteristic*> all;
  for (const storage::CharacteristicFindingRow& finding : assessed.findings)
    all.push_back(by_number.at(finding.characteristic));
  return all;
}

// All profiles with which the one at that place has to be met at once: of form by itself.
ZonePatches ZoneOf(const AssessmentInputs& inputs, const Assessed& assessed,
                   const std::vector<const Characteristic*>& of, std::size_t place) {
  const Characteristic& one = *of[place];
  ZonePatches zone;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::optional<int>& result = assessed.findings[i].result_index;
    if (!result || inputs.patches.count(*result) == 0) continue;
    const bool together = IsLocated(one) && IsLocated(*of[i]) && of[i]->datum_system() == one.datum_system();
    if (zone.patches.size() > kMostPatches) break;
    if (together || i == place) AddPatches(inputs, *of[i], *result, &zone);
  }
  return zone;
}

// A motion that cures a profile where it lies may take something else out that no patch tells of: stagger and its like, what was not seen, and
// profiles of another datum system, which it moves too.
void WithholdUnsureCures(const AssessmentInputs& inputs, const std::vector<const Characteristic*>& of,
                         Assessed* assessed) {
  std::set<std::string> datum_systems;
  bool others = false;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::optional<int>& result = assessed->findings[i].result_index;
    if (IsLocated(*of[i])) datum_systems.insert(of[i]->datum_system());
    others =
        others || IsMoved(of[i]->quantity()) || (IsLocated(*of[i]) && (!result || inputs.patches.count(*result) == 0));
  }
  if (!others && datum_systems.size() < 2) return;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (IsLocated(*of[i]) && assessed->findings[i].cure == "POSSIBLE") assessed->findings[i].cure = "UNKNOWN";
}

}  // namespace

absl::Status FindCures(const AssessmentInputs& inputs, const std::function<bool()>& keep_going, Assessed* assessed) {
  const std::vector<const Characteristic*> of = CharacteristicsOf(inputs, *assessed);
  std::map<std::string, std::string> by_datum_system;  // profiles of form and location: one answer for all
  for (std::size_t i = 0; i < of.size(); ++i) {
    storage::CharacteristicFindingRow& finding = assessed->findings[i];
    if (finding.verdict != "NOT_CONFORM") continue;
    finding.cure = IsOfShape(of[i]->quantity()) ? "NONE" : "UNKNOWN";
    if (KindOf(of[i]->quantity()) != ResultKind::kDeviationMap) continue;
    const bool located = IsLocated(*of[i]);
    if (const auto known = by_datum_system.find(of[i]->datum_system()); located && known != by_datum_system.end()) {
      finding.cure = known->second;
      continue;
    }
    const auto cure = CureOf(ZoneOf(inputs, *assessed, of, i), keep_going, assessed);
    if (!cure.ok()) return cure.status();
    finding.cure = *cure;
    if (located) by_datum_system[of[i]->datum_system()] = *cure;
  }
  WithholdUnsureCures(inputs, of, assessed);
  return absl::OkStatus();
}

}  // namespace sixpoint::inspection
