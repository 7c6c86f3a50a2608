#include "services/inspection/stored_verdict.h"

#include "exchange/verdicts.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/stored_enum.h"

namespace sixpoint::inspection {

std::string TextOf(metrology::Verdict verdict) {
  switch (verdict) {
    case metrology::Verdict::kConform:
      return "CONFORM";
    case metrology::Verdict::kNotConform:
      return "NOT_CONFORM";
    case metrology::Verdict::kUndecidable:
      return "UNDECIDABLE";
    case metrology::Verdict::kNotMeasured:
      break;
  }
  return "NOT_MEASURED";
}

absl::StatusOr<v1::Verdict> VerdictOf(const std::string& text, const std::string& what) {
  return runtime::StoredEnum<v1::Verdict>(text, what);
}

metrology::DecisionRule KernelRuleOf(const plant::v1::DecisionRule& rule) {
  using metrology::DecisionRule;
  if (rule.kind() == plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE) return {DecisionRule::Kind::kGuardBand, 0};
  if (rule.kind() == plant::v1::DECISION_RULE_KIND_GUARD_FACTOR)
    return {DecisionRule::Kind::kGuardBand, rule.guard_factor()};
  return rule.edition() == "2017" ? DecisionRule::Probability() : DecisionRule();
}

exchange::Verdict FileVerdictOf(v1::Verdict verdict) {
  return exchange::VerdictNamed(runtime::WordOf(verdict)).value_or(exchange::Verdict::kNotMeasured);
}

absl::StatusOr<std::string> VerdictFilterOf(v1::Verdict verdict) {
  if (!v1::Verdict_IsValid(verdict)) return runtime::Refuse("verdict", std::to_string(verdict), "a verdict, or none");
  return runtime::WordOf(verdict);
}

}  // namespace sixpoint::inspection
