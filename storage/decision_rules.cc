#include "storage/decision_rules.h"

namespace sixpoint::storage {

void Add(const DecisionRuleRow& rule, Params* params) {
  params->OptionalText(rule.kind).OptionalText(rule.edition).OptionalReal(rule.guard_factor);
}

DecisionRuleRow DecisionRuleAt(const Rows& rows, int row, int column) {
  return {rows.OptionalText(row, column), rows.OptionalText(row, column + 1), rows.OptionalReal(row, column + 2)};
}

}  // namespace sixpoint::storage
