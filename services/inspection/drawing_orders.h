// What a drawing's characteristics have to be measured by: pure, of the drawing alone (docs/methods/assessment.md).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "sixpoint/inspection/v1/assessment.pb.h"
#include "sixpoint/plant/v1/drawing.pb.h"

namespace sixpoint::inspection {

// Of what kind of result a quantity is.
enum class ResultKind { kInspection, kDeviationMap, kSections, kElsewhere };
ResultKind KindOf(plant::v1::CharacteristicQuantity quantity);

// A value is held against them, in the characteristic's unit: of a zone its borders.
struct CharacteristicLimits {
  std::optional<double> lower, upper;
};
CharacteristicLimits LimitsOf(const plant::v1::Characteristic& characteristic);

// Its own rule, or the drawing's.
const plant::v1::DecisionRule& RuleOf(const plant::v1::Drawing& drawing,
                                      const plant::v1::Characteristic& characteristic);

// None where there is no such thing in the drawing.
const plant::v1::DatumSystem* DatumSystemOf(const plant::v1::Drawing& drawing, const std::string& datum_system);
const plant::v1::DrawingSection* SectionOf(const plant::v1::Drawing& drawing, const std::string& name);

// How a registration makes a datum system. INVALID_ARGUMENT: its region is none that a fit can be kept to.
struct DatumFit {
  registration::v1::Method method = registration::v1::METHOD_BEST_FIT;
  registration::v1::FitOptions options;
};
absl::StatusOr<DatumFit> FitOf(const plant::v1::Drawing& drawing, const plant::v1::DatumSystem& system);

// As they are ordered, and as a result says that it was: all that may be left open is filled in.
v1::ProfileTolerance ToleranceOf(const plant::v1::Drawing& drawing, const plant::v1::Characteristic& characteristic);
v1::SurfaceRegion RegionOf(const plant::v1::DrawingRegion& region);
v1::SectionPlane PlaneOf(const plant::v1::DrawingSection& section);

// Of a blade before machining, what is measured of holes is not due.
bool IsDue(const plant::v1::Characteristic& characteristic, v1::AssessmentStage stage);

// Characteristics without a datum system take what is ordered for others already. INVALID_ARGUMENT as FitOf.
absl::StatusOr<v1::AssessmentPlan> PlanOf(const plant::v1::Drawing& drawing, v1::AssessmentStage stage);

}  // namespace sixpoint::inspection
