// Verdicts and the rules they follow, as rows keep them: the kernel's, and from there to the contract's and to what leaves as files.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "exchange/inspected_part.h"
#include "metrology/inspection/verdict.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/plant/v1/drawing.pb.h"

namespace sixpoint::inspection {

// CONFORM, NOT_CONFORM, UNDECIDABLE, NOT_MEASURED.
std::string TextOf(metrology::Verdict verdict);
// what: whose it is, as "inspection 018f...". DATA_LOSS: none of them.
absl::StatusOr<v1::Verdict> VerdictOf(const std::string& text, const std::string& what);
// Of a rule that was checked; without a kind ISO 14253-1 until 2013.
metrology::DecisionRule KernelRuleOf(const plant::v1::DecisionRule& rule);
// As files have them; none: not measured.
exchange::Verdict FileVerdictOf(v1::Verdict verdict);
// Of a list's filter, as rows keep it; empty: any.
absl::StatusOr<std::string> VerdictFilterOf(v1::Verdict verdict);

}  // namespace sixpoint::inspection
