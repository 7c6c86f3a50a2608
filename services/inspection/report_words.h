// What results and drawings say by a value of an enum, as a page says it.
#pragma once

#include <string>

#include "sixpoint/inspection/v1/section.pb.h"
#include "sixpoint/plant/v1/drawing.pb.h"
#include "sixpoint/registration/v1/method.pb.h"

namespace sixpoint::inspection {

// "A_NOSE_TAIL", "A_" -> "nose tail".
std::string WordsOf(const std::string& name, const std::string& prefix);

// "one; other", or the one of them that says something.
std::string Joined(const std::string& one, const std::string& other);

// How a part stands when a value of it is told; empty: it was not registered.
std::string FitStateOf(registration::v1::Method method);
// Of a characteristic: its datum system with the positioning that the drawing means by it; of one without, `method`'s.
std::string FitStateOf(const plant::v1::Drawing& drawing, const plant::v1::Characteristic& drawn,
                       registration::v1::Method method);

std::string RuleText(const plant::v1::DecisionRule& rule);

// "mm", "um", "deg"; empty: a part of something.
std::string UnitOf(plant::v1::CharacteristicUnit unit);
std::string UnitOf(v1::SectionUnit unit);

// AS9102 form 3, field 7: the class where it is more than minor, and what the drawing marks it with.
std::string DesignatorOf(const plant::v1::Characteristic& drawn);

}  // namespace sixpoint::inspection
