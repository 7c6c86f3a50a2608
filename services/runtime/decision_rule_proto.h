// Decision rules of the contract: checked, and as rows keep them.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "sixpoint/plant/v1/drawing.pb.h"
#include "storage/decision_rules.h"

namespace sixpoint::runtime {

// Refuses a kind that is none, an edition or a factor that the kind has not, or lacks.
absl::Status ReadDecisionRule(const std::string& field, const plant::v1::DecisionRule& in,
                              storage::DecisionRuleRow* out);
void ToProto(const storage::DecisionRuleRow& row, plant::v1::DecisionRule* to);

}  // namespace sixpoint::runtime
