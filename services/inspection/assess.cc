#include "services/inspection/assess.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "refusal/message_text.h"
#include "services/inspection/blank_cure.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;

constexpr std::size_t kLongestReason = 1000, kLongestFateReason = 2000;
constexpr std::size_t kMostFindings = 20'000;

// Of several values the one that is farthest beyond its limits, or nearest to one.
const ValueWithUncertainty& WorstOf(const std::vector<ValueWithUncertainty>& values,
                                    const CharacteristicLimits& limits) {
  const auto beyond = [&](const ValueWithUncertainty& one) {
    const double none = -std::numeric_limits<double>::infinity();
    return std::max(limits.upper ? one.value - *limits.upper : none, limits.lower ? *limits.lower - one.value : none);
  };
  return *std::max_element(values.begin(), values.end(),
                           [&](const auto& one, const auto& other) { return beyond(one) < beyond(other); });
}

metrology::Verdict JudgeAll(const FoundValue& found, const CharacteristicLimits& limits,
                            const metrology::DecisionRule& rule, double more) {
  auto worst = metrology::Verdict::kConform;
  for (const ValueWithUncertainty& one : found.values) {
    const bool decidable = one.expanded_uncertainty || rule.guard_factor == 0;
    worst = metrology::Worst(worst, decidable ? metrology::Judge(one.value, one.expanded_uncertainty.value_or(0) + more,
                                                                 {limits.lower, limits.upper}, rule)
                                              : metrology::Verdict::kUndecidable);
  }
  return worst;
}

// What nobody bounds is added to the uncertainty as it is, and kept off as far as that, or as the rule wants.
bool StaysSo(const FoundValue& found, const CharacteristicLimits& limits, const metrology::DecisionRule& rule,
             metrology::Verdict verdict) {
  const metrology::DecisionRule at_least{metrology::DecisionRule::Kind::kGuardBand, std::max(1.0, rule.guard_factor)};
  return JudgeAll(found, limits, at_least, found.open_by) == verdict;
}

// Of a surface that was not seen as far as was wanted, what was seen of it is no value of the tolerance.
bool IsMeasured(const FoundValue& found) { return !found.values.empty() && found.verdict != v1::VERDICT_NOT_MEASURED; }

void Judge(const FoundValue& found, const CharacteristicLimits& limits, const plant::v1::DecisionRule& rule,
           storage::CharacteristicFindingRow* row) {
  const ValueWithUncertainty& worst = WorstOf(found.values, limits);
  row->value = worst.value;
  row->expanded_uncertainty = worst.expanded_uncertainty;
  if (found.verdict) {
    row->verdict = runtime::WordOf(*found.verdict);
    row->reason = found.reason;
    return;
  }
  const metrology::Verdict verdict = JudgeAll(found, limits, KernelRuleOf(rule), 0);
  row->verdict = TextOf(verdict);
  if (verdict == metrology::Verdict::kUndecidable && !worst.expanded_uncertainty)
    row->reason = "its instrument states no uncertainty, which the decision rule asks for";
  else if (verdict == metrology::Verdict::kUndecidable)
    row->reason = Rounded(worst.value) + " with U " + Rounded(*worst.expanded_uncertainty) +
                  " is so near to a limit that the decision rule leaves it open";
  if (found.open_by > 0 && verdict != metrology::Verdict::kUndecidable &&
      !StaysSo(found, limits, KernelRuleOf(rule), verdict)) {
    row->verdict = TextOf(metrology::Verdict::kUndecidable);
    row->reason = found.open_reason;
  }
}

std::string MethodWord(registration::v1::Method method) { return runtime::WordOf(method); }

class Assessor {
 public:
  explicit Assessor(const AssessmentInputs& inputs) : inputs_(inputs) {}

  storage::CharacteristicFindingRow FindingOf(const Characteristic& characteristic, const Feature& feature) const {
    storage::CharacteristicFindingRow row = Drawn(characteristic, feature);
    const CharacteristicLimits limits{row.lower_limit, row.upper_limit};
    const plant::v1::DatumSystem* const system = DatumSystemOf(inputs_.drawing, characteristic.datum_system());
    const auto fit = system == nullptr ? absl::StatusOr<DatumFit>(DatumFit()) : FitOf(inputs_.drawing, *system);
    std::string not_measured = WantedFor(characteristic, fit);
    for (std::size_t i = 0; i < inputs_.results.size(); ++i) {
      const AssessedResult& result = inputs_.results[i];
      const auto found = ValueIn(result, inputs_.drawing, characteristic, feature, inputs_.part);
      if (!found) continue;
      // Another instrument's value is judged where the drawing asks for none of ours; else it stands beside.
      const bool elsewhere = KindOf(characteristic.quantity()) == ResultKind::kElsewhere;
      const bool fits = elsewhere || (result.method() != registration::v1::METHOD_UNSPECIFIED &&
                                      (system == nullptr || (fit.ok() && IsOf(result, *fit))));
      if (fits && !row.result_index) {
        row.result_index = static_cast<int>(i);
        row.method = MethodWord(result.method());
        if (!row.nominal) row.nominal = found->nominal;
        if (IsMeasured(*found)) Judge(*found, limits, RuleOf(inputs_.drawing, characteristic), &row);
        not_measured = found->reason;
      } else if (IsMeasured(*found)) {
        const ValueWithUncertainty& worst = WorstOf(found->values, limits);
        row.others.push_back(
            {static_cast<int>(i), MethodWord(result.method()), worst.value, worst.expanded_uncertainty});
      }
    }
    if (!row.value) row.reason = not_measured;
    row.reason = Tame(row.reason, kLongestReason);
    return row;
  }

 private:
  storage::CharacteristicFindingRow Drawn(const Characteristic& characteristic, const Feature& feature) const {
    storage::CharacteristicFindingRow row;
    row.characteristic = characteristic.characteristic();
    row.feature = feature.feature;
    for (const std::string* place : {&characteristic.hole_group(), &characteristic.section(), &characteristic.region()})
      if (row.place.empty()) row.place = *place;
    row.name = characteristic.name();
    row.characteristic_class = runtime::WordOf(characteristic.characteristic_class());
    row.quantity = runtime::WordOf(characteristic.quantity());
    row.unit = runtime::WordOf(characteristic.unit());
    if (characteristic.has_nominal()) row.nominal = characteristic.nominal();
    const CharacteristicLimits limits = LimitsOf(characteristic);
    row.lower_limit = limits.lower;
    row.upper_limit = limits.upper;
    row.verdict = TextOf(metrology::Verdict::kNotMeasured);
    const plant::v1::DecisionRule& rule = RuleOf(inputs_.drawing, characteristic);
    row.rule.kind = runtime::WordOf(rule.kind());
    row.rule.edition = rule.edition();
    if (rule.has_guard_factor()) row.rule.guard_factor = rule.guard_factor();
    return row;
  }

  static std::string WantedFor(const Characteristic& characteristic, const absl::StatusOr<DatumFit>& fit) {
    if (!fit.ok()) return std::string(fit.status().message());
    std::string wanted;
    switch (KindOf(characteristic.quantity())) {
      case ResultKind::kInspection:
        wanted = "an inspection";
        break;
      case ResultKind::kDeviationMap:
        wanted = "a deviation map with this profile tolerance";
        break;
      case ResultKind::kSections:
        wanted = "a measurement of this section";
        break;
      case ResultKind::kElsewhere:
        return "none of the results has it: want a measurement by another instrument";
    }
    if (!characteristic.datum_system().empty())
      wanted += ", positioned by " + MethodWord(fit->method) + " (" + characteristic.datum_system() + ")";
    return "none of the results has it: want " + wanted;
  }

  const AssessmentInputs& inputs_;
};

metrology::Verdict WorstOfFindings(const std::vector<storage::CharacteristicFindingRow>& findings) {
  auto worst = metrology::Verdict::kConform;
  for (const storage::CharacteristicFindingRow& finding : findings)
    for (const auto verdict :
         {metrology::Verdict::kUndecidable, metrology::Verdict::kNotMeasured, metrology::Verdict::kNotConform})
      if (finding.verdict == TextOf(verdict)) worst = metrology::Worst(worst, verdict);
  return worst;
}

std::string Called(const storage::CharacteristicFindingRow& finding) {
  return finding.characteristic + " " + finding.name + (finding.feature.empty() ? "" : " at " + finding.feature);
}

std::string UnitText(const std::string& unit) {
  return unit == "MM" ? " mm" : unit == "UM" ? " um" : unit == "DEG" ? " deg" : "";
}

// What cannot be cured decides, then what is not known.
void SetFate(Assessed* assessed) {
  assessed->fate = "MACHINABLE";
  for (const storage::CharacteristicFindingRow& finding : assessed->findings) {
    if (finding.cure == "NONE") {
      assessed->fate = "DISCARD";
      assessed->fate_reason = Called(finding) + ": " + Rounded(*finding.value) + UnitText(finding.unit) +
                              " is out, and no rigid motion of the part brings it within its limits";
      break;
    }
    if (finding.verdict == "CONFORM" || finding.cure == "POSSIBLE" || assessed->fate == "UNDECIDED") continue;
    assessed->fate = "UNDECIDED";
    assessed->fate_reason =
        Called(finding) + ": " +
        (finding.reason.empty() ? "out, and nothing says whether a motion of the part cures it" : finding.reason);
  }
  assessed->fate_reason = Tame(assessed->fate_reason, kLongestFateReason);
}

}  // namespace

absl::StatusOr<Assessed> Assess(const AssessmentInputs& inputs, const std::function<bool()>& keep_going) {
  Assessed assessed;
  const Assessor assessor(inputs);
  for (const Characteristic& characteristic : inputs.drawing.characteristics()) {
    if (!IsDue(characteristic, inputs.stage)) continue;
    for (const Feature& feature : FeaturesOf(characteristic, inputs.part)) {
      if (!keep_going()) return absl::CancelledError("assessment: stopped by its caller");
      if (assessed.findings.size() == kMostFindings)
        return runtime::Refuse("drawing", "characteristics at more than 20000 places", "at most 20000");
      assessed.findings.push_back(assessor.FindingOf(characteristic, feature));
    }
  }
  if (assessed.findings.empty())
    return runtime::Refuse("drawing", inputs.drawing.name(),
                           "a drawing with a characteristic that is due at this stage");
  assessed.verdict = TextOf(WorstOfFindings(assessed.findings));
  if (inputs.stage != v1::ASSESSMENT_STAGE_BEFORE_MACHINING) return assessed;
  if (absl::Status cured = FindCures(inputs, keep_going, &assessed); !cured.ok()) return cured;
  SetFate(&assessed);
  return assessed;
}

}  // namespace sixpoint::inspection
