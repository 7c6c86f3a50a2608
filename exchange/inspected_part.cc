#include "exchange/inspected_part.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "exchange/text.h"
#include "exchange/verdicts.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {
namespace {

constexpr double kGreatest = 1e15;
using Kind = Characteristic::Kind;

absl::Status CheckText(const std::string& field, const std::string& text) {
  return IsPlainText(text) ? absl::OkStatus() : Refuse(field, text, "UTF-8 without control characters");
}

absl::Status CheckNumber(const std::string& field, std::optional<double> number) {
  if (!number || std::abs(*number) < kGreatest) return absl::OkStatus();
  return Refuse(field, *number, "finite, and less than 1e15");
}

absl::Status CheckCharacteristic(const std::string& at, const Characteristic& c) {
  Refusals refusals;
  if (c.name.empty() || Trimmed(c.name) != c.name)
    refusals.Add(Refuse(at + "name", c.name, "a name without blanks before or after it"));
  refusals.Add(CheckText(at + "name", c.name));
  const bool angle = c.kind == Kind::kInclination || c.kind == Kind::kAngle, ratio = c.kind == Kind::kRatio;
  const std::string wanted = angle ? "deg" : ratio ? "1" : "mm";
  if (c.unit != wanted && !(c.kind == Kind::kOther && c.unit == "deg"))
    refusals.Add(Refuse(at + "unit", c.unit, wanted));
  refusals.Add(CheckNumber(at + "nominal", c.nominal));
  refusals.Add(CheckNumber(at + "lower", c.lower)).Add(CheckNumber(at + "upper", c.upper));
  return refusals.status();
}

absl::Status CheckValue(const std::string& at, const Characteristic& c, const MeasuredValue& v) {
  Refusals refusals;
  if (v.value.has_value() == (v.verdict == Verdict::kNotMeasured))
    refusals.Add(Refuse(at + "verdict", std::string(VerdictName(v.verdict)),
                        v.value ? "another, for there is a value" : "NOT_MEASURED, for there is no value"));
  if (!v.value && (v.expanded_uncertainty || v.worst_negative || v.worst_positive))
    refusals.Add(Refuse(at + "value", "none", "a value, for its uncertainty or deviations are told"));
  if (c.kind != Kind::kProfile && (v.worst_negative || v.worst_positive))
    refusals.Add(Refuse(at + "worst_positive", "a deviation", "none beside profiles"));
  if (v.expanded_uncertainty && !(*v.expanded_uncertainty >= 0))
    refusals.Add(Refuse(at + "expanded_uncertainty", *v.expanded_uncertainty, ">= 0"));
  refusals.Add(CheckNumber(at + "value", v.value))
      .Add(CheckNumber(at + "expanded_uncertainty", v.expanded_uncertainty));
  refusals.Add(CheckNumber(at + "worst_negative", v.worst_negative));
  refusals.Add(CheckNumber(at + "worst_positive", v.worst_positive));
  refusals.Add(CheckText(at + "reason", v.reason));
  return refusals.status();
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
  for (const auto& [field, text] : texts) refusals.Add(CheckText(field, *text));
  for (const std::string& text : part.calibrations) refusals.Add(CheckText("calibrations", text));
  for (const std::string& text : part.scans) refusals.Add(CheckText("scans", text));
  if (part.values.size() != part.characteristics.size()) {
    refusals.Add(Refuse("values", std::to_string(part.values.size()),
                        "as many as characteristics: " + std::to_string(part.characteristics.size())));
    return refusals.status();
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < part.values.size(); ++i) {
    const std::string index = "[" + std::to_string(i) + "].";
    refusals.Add(CheckCharacteristic("characteristics" + index, part.characteristics[i]));
    refusals.Add(CheckValue("values" + index, part.characteristics[i], part.values[i]));
    if (!names.insert(part.characteristics[i].name).second)
      refusals.Add(Refuse("characteristics" + index + "name", part.characteristics[i].name, "each name once"));
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
