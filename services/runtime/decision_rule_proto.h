// Decision rules of the contract: checked, and as rows keep them.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/runtime/stored_enum.h"
#include "sixpoint/plant/v1/drawing.pb.h"
#include "storage/decision_rules.h"

namespace sixpoint::runtime {

// Refuses a kind that is none, an edition or a factor that the kind has not, or lacks.
absl::Status ReadDecisionRule(const std::string& field, const plant::v1::DecisionRule& in,
                              storage::DecisionRuleRow* out);
// words: whose they are; they tell of a kind that this release does not know.
void ToProto(const storage::DecisionRuleRow& row, StoredWords* words, plant::v1::DecisionRule* to);

}  // namespace sixpoint::runtime
