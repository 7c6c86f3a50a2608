// What is told of one section: each parameter by an algorithm that has a name (docs/methods/sections.md).
//
// Section frame; mm and radians. Thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "metrology/sections/camber.h"
#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

enum class SectionParameter : std::size_t {
  kChordNoseTail,    // between the places where the camber line, continued, leaves the outline
  kChordCaliper,     // the greatest distance between two parallel jaws
  kChordTangent,     // between jaws across the line that touches the pressure side at two places
  kStaggerNoseTail,  // of the line from leading to trailing tip, from the reference direction, counter-clockwise; rad
  kStaggerCaliper,   // of the way from one jaw's contact to the other's
  kStaggerTangent,   // of the touching line
  kThicknessInscribed,       // diameter of the greatest circle inside
  kThicknessInscribedPlace,  // of its centre along the nose-tail chord, as part of it from the leading tip
  kThicknessTwoPoint,        // the longest line across the camber line from side to side
  kThicknessTwoPointPlace,
  kInscribedX,  // the greatest circle's centre
  kInscribedY,
  kLeadingRadius,  // least-squares circle of the outline whose normals are within 50 deg of the end's direction
  kLeadingForm,    // its residuals' range
  kTrailingRadius,
  kTrailingForm,
  kCamberHeight,       // greatest distance of the camber line from the nose-tail line
  kCamberHeightPlace,  // as part of that chord
  kLeadingX,           // the tips
  kLeadingY,
  kTrailingX,
  kTrailingY,
  kCount
};
constexpr std::size_t kSectionParameterCount = static_cast<std::size_t>(SectionParameter::kCount);

// "chord NOSE_TAIL"
std::string NameOf(SectionParameter parameter);

enum class NotMeasured {
  kMeasured,
  kLeadingEndNotSeen,
  kTrailingEndNotSeen,
  kEndIsSquare,
  kEndIsSharp,
  kEndPartlySeen,    // a gap within the part that the algorithm uses
  kNoDoubleTangent,  // the pressure side is nowhere hollow, or the section is symmetrical
  kContactNotSeen,   // a gap where a jaw or a line would touch
  kNotTwoSided,      // no circle touches both sides
};
std::string ReasonOf(NotMeasured reason);

struct SectionValues {
  std::array<std::optional<double>, kSectionParameterCount> values;
  std::array<NotMeasured, kSectionParameterCount> reasons{};
  EndKind leading = EndKind::kNotSeen, trailing = EndKind::kNotSeen;

  const std::optional<double>& operator[](SectionParameter p) const { return values[static_cast<std::size_t>(p)]; }
  NotMeasured reason(SectionParameter p) const { return reasons[static_cast<std::size_t>(p)]; }
  void Set(SectionParameter p, double value);
  void Unset(SectionParameter p, NotMeasured reason);
};

// camber: that of the outline; absent where there is none.
SectionValues ValuesOf(const Outline& outline, const std::optional<Camber>& camber);

}  // namespace sixpoint::metrology
