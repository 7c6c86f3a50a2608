#include "services/inspection/drawing_orders.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;
using plant::v1::Drawing;

constexpr double kUsualCoverage = 0.95, kUsualFacing_deg = 60;
constexpr int kMostOfMap = 64;
constexpr double kPatch_mm = 1;
// What a fit's box may be as wide as.
constexpr double kUnbounded_mm = 1e6;

bool IsProfileOfForm(const Characteristic& characteristic) {
  return characteristic.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM;
}

// One result that is wanted, while characteristics are still added to it.
struct WantedOrder {
  ResultKind kind = ResultKind::kElsewhere;
  std::string datum_system = {};
  std::vector<int> characteristics = {};  // places in the drawing
  double half_width_mm = 0;
  std::string reference_section = {};
  int profile_count = 0;
};

WantedOrder NeedOf(const Drawing& drawing, int index) {
  const Characteristic& one = drawing.characteristics(index);
  WantedOrder need{KindOf(one.quantity()), one.datum_system(), {index}};
  if (need.kind == ResultKind::kSections) {
    const auto* const section = SectionOf(drawing, one.section());
    need.half_width_mm = section == nullptr ? 0 : section->half_width_mm();
    need.reference_section = one.reference_section();
  }
  need.profile_count = need.kind == ResultKind::kDeviationMap ? 1 : 0;
  return need;
}

bool Serves(const WantedOrder& order, const WantedOrder& need) {
  return order.kind == need.kind && (need.datum_system.empty() || order.datum_system == need.datum_system) &&
         order.half_width_mm == need.half_width_mm &&
         (need.reference_section.empty() || order.reference_section == need.reference_section) &&
         order.profile_count + need.profile_count <= kMostOfMap;
}

// Those that ask most first: what they order others can take.
std::vector<WantedOrder> WantedOf(const Drawing& drawing, v1::AssessmentStage stage) {
  std::vector<WantedOrder> needs, orders;
  for (int i = 0; i < drawing.characteristics_size(); ++i)
    if (IsDue(drawing.characteristics(i), stage) &&
        KindOf(drawing.characteristics(i).quantity()) != ResultKind::kElsewhere)
      needs.push_back(NeedOf(drawing, i));
  const auto asks = [](const WantedOrder& need) {
    return (need.datum_system.empty() ? 0 : 2) + (need.reference_section.empty() ? 0 : 1);
  };
  std::stable_sort(needs.begin(), needs.end(),
                   [&](const WantedOrder& one, const WantedOrder& other) { return asks(one) > asks(other); });
  for (const WantedOrder& need : needs) {
    const auto found =
        std::find_if(orders.begin(), orders.end(), [&](const WantedOrder& order) { return Serves(order, need); });
    if (found == orders.end()) {
      orders.push_back(need);
      continue;
    }
    found->characteristics.push_back(need.characteristics.front());
    found->profile_count += need.profile_count;
  }
  for (WantedOrder& order : orders) std::sort(order.characteristics.begin(), order.characteristics.end());
  std::sort(orders.begin(), orders.end(), [](const WantedOrder& one, const WantedOrder& other) {
    return one.characteristics.front() < other.characteristics.front();
  });
  return orders;
}

v1::MapDeviationRequest MapOf(const Drawing& drawing, const WantedOrder& order) {
  v1::MapDeviationRequest request;
  request.set_patch_mm(kPatch_mm);
  for (const int index : order.characteristics) {
    *request.add_profiles() = ToleranceOf(drawing, drawing.characteristics(index));
    const std::string& name = drawing.characteristics(index).region();
    const auto has = [&](const auto& region) { return region.region() == name; };
    if (name.empty() || std::any_of(request.regions().begin(), request.regions().end(), has)) continue;
    const auto region = std::find_if(drawing.regions().begin(), drawing.regions().end(), has);
    if (region != drawing.regions().end()) *request.add_regions() = RegionOf(*region);
  }
  return request;
}

// All of the drawing's, so that bow is told from its first and its last.
v1::MeasureSectionsRequest SectionsOf(const Drawing& drawing, const WantedOrder& order) {
  v1::MeasureSectionsRequest request;
  for (const plant::v1::DrawingSection& section : drawing.sections()) *request.add_sections() = PlaneOf(section);
  request.set_half_width_mm(order.half_width_mm);
  request.set_reference_section(order.reference_section);
  if (drawing.has_neighbour()) {
    *request.mutable_neighbour()->mutable_offset_in_part_mm() = drawing.neighbour().offset_in_part_mm();
    request.mutable_neighbour()->set_standard_uncertainty_um(drawing.neighbour().standard_uncertainty_um());
  }
  return request;
}

void SetOrder(const Drawing& drawing, const WantedOrder& wanted, const DatumFit& fit, v1::MeasurementOrder* out) {
  for (const int index : wanted.characteristics)
    out->add_characteristics(drawing.characteristics(index).characteristic());
  out->set_datum_system(wanted.datum_system);
  out->set_method(fit.method);
  *out->mutable_options() = fit.options;
  if (wanted.kind == ResultKind::kDeviationMap) *out->mutable_map() = MapOf(drawing, wanted);
  if (wanted.kind == ResultKind::kSections) *out->mutable_sections() = SectionsOf(drawing, wanted);
  if (wanted.kind != ResultKind::kInspection) return;
  out->mutable_inspect()->set_method(fit.method);
  *out->mutable_inspect()->mutable_options() = fit.options;
}

geometry::v1::Direction UnitDirectionOf(const geometry::v1::Direction& of) {
  const double length = std::sqrt(of.x() * of.x() + of.y() * of.y() + of.z() * of.z());
  geometry::v1::Direction unit;
  unit.set_x(of.x() / length);
  unit.set_y(of.y() / length);
  unit.set_z(of.z() / length);
  return unit;
}

}  // namespace

ResultKind KindOf(plant::v1::CharacteristicQuantity quantity) {
  using namespace plant::v1;  // NOLINT: the enum's names say whose they are
  if (quantity == CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE) return ResultKind::kElsewhere;
  if (quantity >= CHARACTERISTIC_QUANTITY_SECTION_CHORD) return ResultKind::kSections;
  return quantity >= CHARACTERISTIC_QUANTITY_PROFILE_FORM ? ResultKind::kDeviationMap : ResultKind::kInspection;
}

CharacteristicLimits LimitsOf(const Characteristic& characteristic) {
  CharacteristicLimits limits;
  if (characteristic.has_lower_limit()) limits.lower = characteristic.lower_limit();
  if (characteristic.has_upper_limit()) limits.upper = characteristic.upper_limit();
  switch (characteristic.zone()) {
    case plant::v1::TOLERANCE_ZONE_DIAMETER:
      limits = {std::nullopt, characteristic.upper_limit() / 2};
      break;
    case plant::v1::TOLERANCE_ZONE_WIDTH:
      limits = {-characteristic.upper_limit() / 2, characteristic.upper_limit() / 2};
      break;
    case plant::v1::TOLERANCE_ZONE_HALF_WIDTH:
      limits = {-characteristic.upper_limit(), characteristic.upper_limit()};
      break;
    default:
      break;
  }
  return limits;
}

const plant::v1::DecisionRule& RuleOf(const Drawing& drawing, const Characteristic& characteristic) {
  return characteristic.has_decision_rule() ? characteristic.decision_rule() : drawing.decision_rule();
}

const plant::v1::DatumSystem* DatumSystemOf(const Drawing& drawing, const std::string& datum_system) {
  for (const plant::v1::DatumSystem& system : drawing.datum_systems())
    if (system.datum_system() == datum_system) return &system;
  return nullptr;
}

const plant::v1::DrawingSection* SectionOf(const Drawing& drawing, const std::string& name) {
  for (const plant::v1::DrawingSection& section : drawing.sections())
    if (section.section() == name) return &section;
  return nullptr;
}

absl::StatusOr<DatumFit> FitOf(const Drawing& drawing, const plant::v1::DatumSystem& system) {
  DatumFit fit;
  switch (system.positioning()) {
    case plant::v1::DATUM_POSITIONING_SIX_POINT:
      fit.method = registration::v1::METHOD_SIX_POINT;
      return fit;
    case plant::v1::DATUM_POSITIONING_SIX_POINT_NORMALS:
      fit.method = registration::v1::METHOD_SIX_POINT_NORMALS;
      return fit;
    case plant::v1::DATUM_POSITIONING_LOCAL:
      fit.method = registration::v1::METHOD_LOCAL;
      break;
    default:
      return fit;
  }
  const auto region = std::find_if(drawing.regions().begin(), drawing.regions().end(),
                                   [&](const auto& one) { return one.region() == system.region(); });
  if (region == drawing.regions().end() || region->has_facing_in_part())
    return runtime::Refuse("drawing", "datum system " + system.datum_system() + " by region " + system.region(),
                           "a region that is a box alone: a fit cannot be kept to one side of a wall");
  registration::v1::Box* const box = fit.options.add_regions_in()->mutable_box();
  const auto corner = [](bool said, const geometry::v1::Point& of, double unbounded_mm, geometry::v1::Point* to) {
    if (said) {
      *to = of;
      return;
    }
    to->set_x_mm(unbounded_mm);
    to->set_y_mm(unbounded_mm);
    to->set_z_mm(unbounded_mm);
  };
  corner(region->has_minimum_in_part_mm(), region->minimum_in_part_mm(), -kUnbounded_mm, box->mutable_minimum_mm());
  corner(region->has_maximum_in_part_mm(), region->maximum_in_part_mm(), kUnbounded_mm, box->mutable_maximum_mm());
  return fit;
}

v1::ProfileTolerance ToleranceOf(const Drawing& drawing, const Characteristic& characteristic) {
  v1::ProfileTolerance tolerance;
  tolerance.set_characteristic(characteristic.characteristic());
  tolerance.set_region(characteristic.region());
  tolerance.set_zone(IsProfileOfForm(characteristic) ? v1::PROFILE_ZONE_FORM : v1::PROFILE_ZONE_FORM_AND_LOCATION);
  const CharacteristicLimits limits = LimitsOf(characteristic);
  const double mm = characteristic.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1e-3 : 1;
  tolerance.set_lower_mm(mm * limits.lower.value_or(0));
  tolerance.set_upper_mm(mm * limits.upper.value_or(0));
  tolerance.set_least_coverage(characteristic.has_least_coverage() ? characteristic.least_coverage() : kUsualCoverage);
  *tolerance.mutable_decision_rule() = RuleOf(drawing, characteristic);
  return tolerance;
}

v1::SurfaceRegion RegionOf(const plant::v1::DrawingRegion& region) {
  v1::SurfaceRegion out;
  out.set_region(region.region());
  if (region.has_minimum_in_part_mm()) *out.mutable_minimum_in_part_mm() = region.minimum_in_part_mm();
  if (region.has_maximum_in_part_mm()) *out.mutable_maximum_in_part_mm() = region.maximum_in_part_mm();
  if (!region.has_facing_in_part()) return out;
  *out.mutable_facing_in_part() = UnitDirectionOf(region.facing_in_part());
  out.set_facing_within_deg(region.has_facing_within_deg() ? region.facing_within_deg() : kUsualFacing_deg);
  return out;
}

v1::SectionPlane PlaneOf(const plant::v1::DrawingSection& section) {
  v1::SectionPlane plane;
  plane.set_section(section.section());
  if (section.has_height_mm())
    plane.mutable_origin_in_part_mm()->set_z_mm(section.height_mm());
  else
    *plane.mutable_origin_in_part_mm() = section.origin_in_part_mm();
  plane.mutable_normal_in_part()->set_z(1);
  plane.mutable_reference_in_part()->set_x(1);
  if (section.has_normal_in_part()) *plane.mutable_normal_in_part() = UnitDirectionOf(section.normal_in_part());
  if (section.has_reference_in_part())
    *plane.mutable_reference_in_part() = UnitDirectionOf(section.reference_in_part());
  if (section.has_leading_in_part_mm()) *plane.mutable_leading_in_part_mm() = section.leading_in_part_mm();
  if (section.has_near_in_part_mm()) *plane.mutable_near_in_part_mm() = section.near_in_part_mm();
  return plane;
}

bool IsDue(const Characteristic& characteristic, v1::AssessmentStage stage) {
  return stage != v1::ASSESSMENT_STAGE_BEFORE_MACHINING ||
         (KindOf(characteristic.quantity()) != ResultKind::kInspection && characteristic.hole_group().empty());
}

absl::StatusOr<v1::AssessmentPlan> PlanOf(const Drawing& drawing, v1::AssessmentStage stage) {
  v1::AssessmentPlan plan;
  plan.set_drawing(drawing.name() + "@" + std::to_string(drawing.revision()));
  for (const WantedOrder& wanted : WantedOf(drawing, stage)) {
    DatumFit fit;
    if (const auto* const system = DatumSystemOf(drawing, wanted.datum_system); system != nullptr) {
      absl::StatusOr<DatumFit> of_system = FitOf(drawing, *system);
      if (!of_system.ok()) return of_system.status();
      fit = *std::move(of_system);
    }
    SetOrder(drawing, wanted, fit, plan.add_orders());
  }
  for (const Characteristic& one : drawing.characteristics())
    if (KindOf(one.quantity()) == ResultKind::kElsewhere && IsDue(one, stage))
      plan.add_measured_elsewhere(one.characteristic());
  return plan;
}

}  // namespace sixpoint::inspection
