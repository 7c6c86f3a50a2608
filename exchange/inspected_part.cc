#include "exchange/inspected_part.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <tuple>

#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

constexpr double kGreatest = 1e15;
constexpr const char* kPlainText = "UTF-8 without control characters";
using Kind = Characteristic::Kind;

// A field's name, made only where it is refused: of a thousand blades' values nearly none is.
struct FieldAt {
  std::string_view of;  // "values"
  std::size_t index;
  std::string operator()(std::string_view name) const {
    return std::string(of) + "[" + std::to_string(index) + "]." + std::string(name);
  }
};

void CheckText(const FieldAt& at, std::string_view name, const std::string& text, Refusals* refusals) {
  if (!IsPlainText(text)) refusals->Add(Refuse(at(name), text, kPlainText));
}

void CheckNumber(const FieldAt& at, std::string_view name, std::optional<double> number, Refusals* refusals) {
  if (number && !(std::abs(*number) < kGreatest))
    refusals->Add(Refuse(at(name), *number, "finite, and less than 1e15"));
}

void CheckCharacteristic(const FieldAt& at, const Characteristic& c, Refusals* refusals) {
  if (c.name.empty() || Trimmed(c.name) != c.name)
    refusals->Add(Refuse(at("name"), c.name, "a name without blanks before or after it"));
  CheckText(at, "name", c.name, refusals);
  const bool angle = c.kind == Kind::kInclination || c.kind == Kind::kAngle, ratio = c.kind == Kind::kRatio;
  const std::string_view wanted = angle ? "deg" : ratio ? "1" : "mm";
  if (c.unit != wanted && !(c.kind == Kind::kOther && c.unit == "deg"))
    refusals->Add(Refuse(at("unit"), c.unit, std::string(wanted)));
  CheckNumber(at, "nominal", c.nominal, refusals);
  CheckNumber(at, "lower", c.lower, refusals);
  CheckNumber(at, "upper", c.upper, refusals);
}

void CheckValue(const FieldAt& at, const Characteristic& c, const MeasuredValue& v, Refusals* refusals) {
  if (v.value.has_value() == (v.verdict == Verdict::kNotMeasured))
    refusals->Add(Refuse(at("verdict"), std::string(VerdictName(v.verdict)),
                         v.value ? "another, for there is a value" : "NOT_MEASURED, for there is no value"));
  if (!v.value && (v.expanded_uncertainty || v.worst_negative || v.worst_positive))
    refusals->Add(Refuse(at("value"), "none", "a value, for its uncertainty or deviations are told"));
  if (c.kind != Kind::kProfile && (v.worst_negative || v.worst_positive))
    refusals->Add(Refuse(at("worst_positive"), "a deviation", "none beside profiles"));
  if (c.kind != Kind::kProfile && !v.points.empty())
    refusals->Add(Refuse(at("points"), std::to_string(v.points.size()), "none beside profiles"));
  const auto is_wrong = [](double number) { return !(std::abs(number) < kGreatest); };
  for (const DeviationPoint& point : v.points)
    if (is_wrong(point.deviation_mm) || std::any_of(point.nominal_mm.begin(), point.nominal_mm.end(), is_wrong) ||
        std::any_of(point.normal.begin(), point.normal.end(), is_wrong)) {
      refusals->Add(Refuse(at("points"), point.deviation_mm, "finite numbers, less than 1e15"));
      break;
    }
  if (v.expanded_uncertainty && !(*v.expanded_uncertainty >= 0))
    refusals->Add(Refuse(at("expanded_uncertainty"), *v.expanded_uncertainty, ">= 0"));
  CheckNumber(at, "value", v.value, refusals);
  CheckNumber(at, "expanded_uncertainty", v.expanded_uncertainty, refusals);
  CheckNumber(at, "worst_negative", v.worst_negative, refusals);
  CheckNumber(at, "worst_positive", v.worst_positive, refusals);
  CheckText(at, "reason", v.reason, refusals);
}

}  // namespace

absl::Status Check(const InspectedPart& part) {
  Refusals refusals;
  const std::pair<const char*, const std::string*> texts[] = {{"result", &part.result},
                                                              {"serial", &part.serial},
                                                              {"part", &part.part},
                                                              {"machine", &part.machine},
                                                              {"sensor_model", &part.sensor_model},
                                                              {"sensor_serial_number", &part.sensor_serial_number},
                                                              {"work_order", &part.work_order},
                                                              {"operation", &part.operation},
                                                              {"requested_by", &part.requested_by},
                                                              {"software_version", &part.software_version},
                                                              {"decision_rule", &part.decision_rule},
                                                              {"method", &part.method},
                                                              {"registration", &part.registration}};
  const auto check_text = [&refusals](const char* field, const std::string& text) {
    if (!IsPlainText(text)) refusals.Add(Refuse(field, text, kPlainText));
  };
  for (const auto& [field, text] : texts) check_text(field, *text);
  for (const std::string& text : part.calibrations) check_text("calibrations", text);
  for (const std::string& text : part.scans) check_text("scans", text);
  if (part.values.size() != part.characteristics.size()) {
    refusals.Add(Refuse("values", std::to_string(part.values.size()),
                        "as many as characteristics: " + std::to_string(part.characteristics.size())));
    return refusals.status();
  }
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < part.values.size(); ++i) {
    const FieldAt characteristic{"characteristics", i};
    CheckCharacteristic(characteristic, part.characteristics[i], &refusals);
    CheckValue({"values", i}, part.characteristics[i], part.values[i], &refusals);
    if (!names.insert(part.characteristics[i].name).second)
      refusals.Add(Refuse(characteristic("name"), part.characteristics[i].name, "each name once"));
  }
  return refusals.status();
}

bool SameCharacteristics(const InspectedPart& one, const InspectedPart& other) {
  const auto same = [](const Characteristic& a, const Characteristic& b) {
    return std::tie(a.name, a.kind, a.unit, a.nominal, a.lower, a.upper) ==
           std::tie(b.name, b.kind, b.unit, b.nominal, b.lower, b.upper);
  };
  return one.part == other.part && one.part_revision == other.part_revision &&
         std::equal(one.characteristics.begin(), one.characteristics.end(), other.characteristics.begin(),
                    other.characteristics.end(), same);
}

Verdict WorstOf(const std::vector<MeasuredValue>& values) {
  if (values.empty()) return Verdict::kNotMeasured;
  for (const Verdict worst : {Verdict::kNotConform, Verdict::kNotMeasured, Verdict::kUndecidable})
    for (const MeasuredValue& value : values)
      if (value.verdict == worst) return worst;
  return Verdict::kConform;
}

}  // namespace sixpoint::exchange
