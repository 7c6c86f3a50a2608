// Characteristics of a drawing, each by the rule of its quantity.
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "services/plant/checks.h"
#include "services/plant/drawing_checks.h"
#include "services/plant/quantity_rules.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/decision_rule_proto.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;
using storage::CharacteristicRow;
using storage::DrawingRow;
using Place = QuantityRule::Place;
using Zone = QuantityRule::Zone;
using Datums = QuantityRule::Datums;
using Figures = QuantityRule::Figures;

bool Has(const std::vector<const char*>& words, const std::string& word) {
  return std::any_of(words.begin(), words.end(), [&](const char* one) { return word == one; });
}

std::string OneOf(const std::vector<const char*>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + std::string(words[i]);
  return text;
}

// Of a field that the quantity has, must have, or has not.
enum class Wanted { kNeeded, kAllowed, kRefused };
absl::Status CheckNamed(const std::string& field, const std::string& name, Wanted wanted, const std::string& quantity,
                        const std::string& what) {
  if (wanted == Wanted::kNeeded && name.empty()) return Refuse(field, "", what + ", for " + quantity);
  if (wanted == Wanted::kRefused && !name.empty()) return Refuse(field, name, "none, for " + quantity);
  return absl::OkStatus();
}

template <typename Rows, typename Member>
absl::Status CheckKnown(const std::string& field, const std::string& name, const Rows& rows, Member member,
                        const std::string& what) {
  if (name.empty()) return absl::OkStatus();
  std::string known;
  for (const auto& row : rows) {
    if (row.*member == name) return absl::OkStatus();
    known += (known.empty() ? "" : ", ") + row.*member;
  }
  return Refuse(field, name, "one of the drawing's " + what + " (" + (known.empty() ? "it has none" : known) + ")");
}

absl::Status CheckPlace(const std::string& at, const QuantityRule& rule, const DrawingRow& drawing,
                        const CharacteristicRow& row) {
  const std::string& quantity = row.quantity;
  const bool holes = rule.place == Place::kHoles || rule.place == Place::kHolePair,
             any = rule.place == Place::kAnywhere;
  const auto by = [&](bool needed, bool allowed = false) {
    return needed ? Wanted::kNeeded : any || allowed ? Wanted::kAllowed : Wanted::kRefused;
  };
  const bool pair = rule.place == Place::kHolePair && !row.hole.empty();
  runtime::Refusals refusals;
  refusals.Add(CheckNamed(at + ".hole_group", row.hole_group, by(holes), quantity, "a hole group of the part"))
      .Add(CheckNamed(at + ".hole", row.hole, holes || any ? Wanted::kAllowed : Wanted::kRefused, quantity, ""))
      .Add(CheckNamed(at + ".to_hole", row.to_hole, pair ? Wanted::kNeeded : Wanted::kRefused,
                      quantity + (pair ? "" : " without a hole"), "the hole that the pitch is told to"))
      .Add(CheckNamed(at + ".section", row.section, by(rule.place == Place::kSection), quantity,
                      "a section of the drawing"))
      .Add(CheckNamed(at + ".reference_section", row.reference_section,
                      quantity == "TWIST" ? Wanted::kNeeded : Wanted::kRefused, quantity,
                      "the section it is told from"))
      .Add(CheckNamed(at + ".region", row.region, by(false, rule.place == Place::kSurface), quantity, ""))
      .Add(CheckKnown(at + ".section", row.section, drawing.sections, &storage::DrawingSectionRow::section, "sections"))
      .Add(CheckKnown(at + ".reference_section", row.reference_section, drawing.sections,
                      &storage::DrawingSectionRow::section, "sections"))
      .Add(CheckKnown(at + ".region", row.region, drawing.regions, &storage::DrawingRegionRow::region, "regions"));
  if (any && !row.hole.empty() && row.hole_group.empty())
    refusals.Add(Refuse(at + ".hole_group", "", "the group of hole " + row.hole));
  if (!row.to_hole.empty() && row.to_hole == row.hole)
    refusals.Add(Refuse(at + ".to_hole", row.to_hole, "another hole than `hole`"));
  if (!row.reference_section.empty() && row.reference_section == row.section)
    refusals.Add(Refuse(at + ".reference_section", row.reference_section, "another section than `section`"));
  if (quantity == "THROAT" && drawing.neighbour_offset_in_part_mm.empty())
    refusals.Add(Refuse("drawing.neighbour", "", "where the neighbour stands, for a THROAT (" + at + ")"));
  if ((quantity == "BOW_X" || quantity == "BOW_Y") && drawing.sections.size() < 3)
    refusals.Add(Refuse("drawing.sections", std::to_string(drawing.sections.size()) + " sections",
                        "at least 3, for a " + quantity + " (" + at + ")"));
  return refusals.status();
}

absl::Status CheckFigures(const std::string& at, const QuantityRule& rule, const CharacteristicRow& row) {
  const double greatest = rule.greatest > 0 ? rule.greatest : GreatestIn(row.unit);
  const bool from_zero = rule.figures == Figures::kNeverNegative || rule.figures == Figures::kUpperAlone;
  runtime::Refusals refusals;
  for (const auto& [field, figure] : {std::pair(".nominal", &row.nominal), std::pair(".lower_limit", &row.lower_limit),
                                      std::pair(".upper_limit", &row.upper_limit)})
    if (*figure && !(**figure >= (from_zero ? 0 : -greatest) && **figure <= greatest))
      refusals.Add(Refuse(at + field, **figure,
                          (from_zero ? "0" : NumberText(-greatest)) + " to " + NumberText(greatest) + " " + row.unit +
                              ", of " + row.quantity));
  if (!row.lower_limit && !row.upper_limit) refusals.Add(Refuse(at + ".upper_limit", "", "a lower or an upper limit"));
  if (row.lower_limit && row.upper_limit && !(*row.lower_limit < *row.upper_limit))
    refusals.Add(Refuse(at + ".lower_limit", *row.lower_limit, "below upper_limit, " + NumberText(*row.upper_limit)));
  const bool has_nominal = rule.figures == Figures::kOfValue || rule.figures == Figures::kNeverNegative;
  if (row.nominal && !has_nominal)
    refusals.Add(Refuse(at + ".nominal", *row.nominal, "none, for " + row.quantity + ": the CAD is the nominal"));
  if (rule.figures == Figures::kUpperAlone && row.lower_limit)
    refusals.Add(Refuse(at + ".lower_limit", *row.lower_limit, "none, for " + row.quantity + ": 0 is best"));
  if (from_zero && row.upper_limit && *row.upper_limit == 0)
    refusals.Add(Refuse(at + ".upper_limit", 0, "more than 0, of " + row.quantity));
  return refusals.status();
}

absl::Status CheckZone(const std::string& at, const QuantityRule& rule, const CharacteristicRow& row) {
  static const std::vector<const char*> kRound = {"DIAMETER", "RADIUS"}, kWide = {"WIDTH", "HALF_WIDTH", "BORDERS"};
  if (rule.zone == Zone::kNone)
    return row.zone.empty() ? absl::OkStatus() : Refuse(at + ".zone", row.zone, "none, for " + row.quantity);
  const std::vector<const char*>& known = rule.zone == Zone::kRound ? kRound : kWide;
  if (!Has(known, row.zone))
    return Refuse(at + ".zone", row.zone, OneOf(known) + ", for " + row.quantity + ": half or whole is not guessed");
  runtime::Refusals refusals;
  if (row.zone == "BORDERS") {
    if (!row.lower_limit) refusals.Add(Refuse(at + ".lower_limit", "", "the zone's lower border"));
    if (!row.upper_limit) refusals.Add(Refuse(at + ".upper_limit", "", "the zone's upper border"));
    return refusals.status();
  }
  if (row.lower_limit && rule.figures != Figures::kUpperAlone)
    refusals.Add(Refuse(at + ".lower_limit", *row.lower_limit, "none with zone " + row.zone + ", which has one size"));
  if (!row.upper_limit || (*row.upper_limit <= 0 && rule.figures != Figures::kUpperAlone))
    refusals.Add(row.upper_limit ? Refuse(at + ".upper_limit", *row.upper_limit, "more than 0: the zone's size")
                                 : Refuse(at + ".upper_limit", "", "the zone's size"));
  return refusals.status();
}

absl::Status CheckDatums(const std::string& at, const QuantityRule& rule, const DrawingRow& drawing,
                         const CharacteristicRow& row) {
  const Wanted wanted = rule.datums == Datums::kNeeded   ? Wanted::kNeeded
                        : rule.datums == Datums::kEither ? Wanted::kAllowed
                                                         : Wanted::kRefused;
  return runtime::Refusals()
      .Add(CheckNamed(at + ".datum_system", row.datum_system, wanted, row.quantity, "a datum system of the drawing"))
      .Add(CheckKnown(at + ".datum_system", row.datum_system, drawing.datum_systems,
                      &storage::DatumSystemRow::datum_system, "datum systems"))
      .status();
}

// What follows from the quantity.
absl::Status CheckByRule(const std::string& at, const DrawingRow& drawing, const CharacteristicRow& row) {
  const QuantityRule& rule = RuleOf(row.quantity);
  runtime::Refusals refusals;
  if (!rule.algorithms.empty() && !Has(rule.algorithms, row.algorithm))
    refusals.Add(Refuse(at + ".algorithm", row.algorithm, OneOf(rule.algorithms) + ", for " + row.quantity));
  if (rule.algorithms.empty() && !row.algorithm.empty())
    refusals.Add(Refuse(at + ".algorithm", row.algorithm, "none, for " + row.quantity));
  if (!row.unit.empty() && !Has(rule.units, row.unit))
    refusals.Add(Refuse(at + ".unit", row.unit, OneOf(rule.units) + ", for " + row.quantity));
  const bool displacement = row.quantity.rfind("HOLE_DISPLACEMENT", 0) == 0;
  if (displacement != !row.along_in_part.empty())
    refusals.Add(Refuse(at + ".along_in_part", displacement ? "" : "a direction",
                        displacement ? "the direction that it is told along" : "none, for " + row.quantity));
  if (row.least_coverage && rule.place != Place::kSurface)
    refusals.Add(Refuse(at + ".least_coverage", *row.least_coverage, "none, for " + row.quantity));
  refusals.Add(CheckPlace(at, rule, drawing, row))
      .Add(CheckZone(at, rule, row))
      .Add(CheckDatums(at, rule, drawing, row));
  if (Has(rule.units, row.unit)) refusals.Add(CheckFigures(at, rule, row));
  return refusals.status();
}

absl::Status ReadTexts(const std::string& at, const v1::Characteristic& in, CharacteristicRow* row) {
  row->name = in.name();
  row->requirement = in.requirement();
  row->reference_location = in.reference_location();
  row->designator = in.designator();
  row->hole_group = in.hole_group();
  row->hole = in.hole();
  row->to_hole = in.to_hole();
  row->section = in.section();
  row->reference_section = in.reference_section();
  row->region = in.region();
  row->datum_system = in.datum_system();
  row->gauge = in.gauge();
  row->designed_tooling = in.designed_tooling();
  return runtime::Refusals()
      .Add(CheckSaid(at + ".name", row->name))
      .Add(CheckSaid(at + ".requirement", row->requirement))
      .Add(CheckSaid(at + ".reference_location", row->reference_location))
      .Add(CheckSaidOrEmpty(at + ".designator", row->designator))
      .Add(CheckSaidOrEmpty(at + ".gauge", row->gauge))
      .Add(CheckSaidOrEmpty(at + ".designed_tooling", row->designed_tooling))
      .status();
}

absl::Status ReadCharacteristic(const std::string& at, const v1::Characteristic& in, const DrawingRow& drawing,
                                CharacteristicRow* row) {
  runtime::Refusals refusals;
  refusals.Add(ReadTexts(at, in, row))
      .Add(runtime::ReadWord(at + ".characteristic_class", in.characteristic_class(), &row->characteristic_class))
      .Add(runtime::ReadWord(at + ".quantity", in.quantity(), &row->quantity))
      .Add(runtime::ReadWord(at + ".unit", in.unit(), &row->unit));
  if (in.algorithm() != 0) refusals.Add(runtime::ReadWord(at + ".algorithm", in.algorithm(), &row->algorithm));
  if (in.zone() != 0) refusals.Add(runtime::ReadWord(at + ".zone", in.zone(), &row->zone));
  if (in.has_nominal()) row->nominal = in.nominal();
  if (in.has_lower_limit()) row->lower_limit = in.lower_limit();
  if (in.has_upper_limit()) row->upper_limit = in.upper_limit();
  if (in.has_along_in_part()) refusals.Add(Read(at + ".along_in_part", true, in.along_in_part(), &row->along_in_part));
  if (in.has_least_coverage()) {
    row->least_coverage = in.least_coverage();
    refusals.Add(CheckRange(at + ".least_coverage", in.least_coverage(), 0, 1, "0 to 1"));
  }
  if (in.has_decision_rule())
    refusals.Add(runtime::ReadDecisionRule(at + ".decision_rule", in.decision_rule(), &row->decision_rule));
  if (!row->quantity.empty()) refusals.Add(CheckByRule(at, drawing, *row));
  return refusals.status();
}

}  // namespace

absl::Status ReadCharacteristics(const v1::Drawing& in, storage::DrawingRow* drawing) {
  if (in.characteristics().empty()) return Refuse("drawing.characteristics", "none", "at least one");
  runtime::Refusals refusals;
  std::set<std::string> balloons, imported;
  for (int i = 0; i < in.characteristics_size(); ++i) {
    const v1::Characteristic& one = in.characteristics(i);
    const std::string at = "drawing.characteristics[" + std::to_string(i) + "]";
    CharacteristicRow row;
    row.characteristic = one.characteristic();
    refusals.Add(CheckCalled(at + ".characteristic", one.characteristic(), &balloons))
        .Add(ReadCharacteristic(at, one, *drawing, &row));
    if (row.quantity == "MEASURED_ELSEWHERE" && !imported.insert(row.name).second)
      refusals.Add(Refuse(at + ".name", row.name, "another one: its import has it once"));
    drawing->characteristics.push_back(std::move(row));
  }
  return refusals.status();
}

}  // namespace sixpoint::plant
