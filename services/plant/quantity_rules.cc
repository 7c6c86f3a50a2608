#include "services/plant/quantity_rules.h"

#include <algorithm>

namespace sixpoint::plant {
namespace {

using Place = QuantityRule::Place;
using Zone = QuantityRule::Zone;
using Datums = QuantityRule::Datums;
using Figures = QuantityRule::Figures;

std::vector<QuantityRule> MakeRules() {
  const std::vector<const char*> length = {"MM", "UM"}, angle = {"DEG"}, ratio = {"RATIO"};
  const std::vector<const char*> chords = {"NOSE_TAIL", "CALIPER", "TANGENT"};
  const std::vector<const char*> thicknesses = {"INSCRIBED_CIRCLE", "TWO_POINT"};
  return {
      {"HOLE_POSITION", Place::kHoles, length, Zone::kRound, Datums::kNeeded, Figures::kUpperAlone},
      {"HOLE_DISPLACEMENT_ALONG", Place::kHoles, length, Zone::kWide, Datums::kNeeded, Figures::kOffNominal},
      {"HOLE_DISPLACEMENT_ACROSS", Place::kHoles, length, Zone::kWide, Datums::kNeeded, Figures::kOffNominal},
      {"HOLE_INCLINATION", Place::kHoles, angle, Zone::kNone, Datums::kNeeded, Figures::kUpperAlone, {}, 90},
      {"HOLE_DIAMETER", Place::kHoles, length, Zone::kNone, Datums::kNone, Figures::kNeverNegative},
      {"HOLE_PITCH", Place::kHolePair, length, Zone::kNone, Datums::kNone, Figures::kNeverNegative},
      {"HOLE_PITCH_OVER_DIAMETER", Place::kHolePair, ratio, Zone::kNone, Datums::kNone, Figures::kNeverNegative},
      {"PROFILE_FORM", Place::kSurface, length, Zone::kWide, Datums::kNone, Figures::kOffNominal},
      {"PROFILE_FORM_AND_LOCATION", Place::kSurface, length, Zone::kWide, Datums::kNeeded, Figures::kOffNominal},
      {"SECTION_CHORD", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative, chords},
      {"SECTION_STAGGER", Place::kSection, angle, Zone::kNone, Datums::kNeeded, Figures::kOfValue, chords},
      {"SECTION_THICKNESS", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative,
       thicknesses},
      {"SECTION_THICKNESS_PLACE", Place::kSection, ratio, Zone::kNone, Datums::kEither, Figures::kNeverNegative,
       thicknesses, 1},
      {"SECTION_LEADING_EDGE_RADIUS", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative},
      {"SECTION_TRAILING_EDGE_RADIUS", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative},
      {"SECTION_LEADING_EDGE_FORM", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kUpperAlone},
      {"SECTION_TRAILING_EDGE_FORM", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kUpperAlone},
      {"SECTION_CAMBER_HEIGHT", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative},
      {"SECTION_PROFILE_FORM", Place::kSection, length, Zone::kWide, Datums::kNone, Figures::kOffNominal},
      {"SECTION_PROFILE_FORM_AND_LOCATION", Place::kSection, length, Zone::kWide, Datums::kNeeded,
       Figures::kOffNominal},
      {"TWIST", Place::kSection, angle, Zone::kNone, Datums::kEither, Figures::kOffNominal},
      {"BOW_X", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kOffNominal},
      {"BOW_Y", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kOffNominal},
      {"THROAT", Place::kSection, length, Zone::kNone, Datums::kEither, Figures::kNeverNegative},
      {"MEASURED_ELSEWHERE",
       Place::kAnywhere,
       {"MM", "UM", "DEG", "RATIO"},
       Zone::kNone,
       Datums::kEither,
       Figures::kOfValue},
  };
}

}  // namespace

const QuantityRule& RuleOf(const std::string& quantity) {
  static const auto* const rules = new std::vector<QuantityRule>(MakeRules());
  const auto found =
      std::find_if(rules->begin(), rules->end(), [&](const QuantityRule& rule) { return rule.quantity == quantity; });
  return found == rules->end() ? rules->back() : *found;
}

double GreatestIn(const std::string& unit) {
  if (unit == "DEG") return 360;
  if (unit == "RATIO") return 1000;
  return unit == "UM" ? 1e6 : 1e4;
}

}  // namespace sixpoint::plant
