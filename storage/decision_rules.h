// A decision rule, as whatever is judged by one keeps it.
#pragma once

#include <optional>
#include <string>

#include "storage/database.h"

namespace sixpoint::storage {

struct DecisionRuleRow {
  std::string kind;  // ISO_14253_1, SIMPLE_ACCEPTANCE, GUARD_FACTOR; empty: none of its own
  std::string edition;
  std::optional<double> guard_factor;
};

// Columns of a rule: kind, edition, factor.
void Add(const DecisionRuleRow& rule, Params* params);
DecisionRuleRow DecisionRuleAt(const Rows& rows, int row, int column);

}  // namespace sixpoint::storage
