#include "services/runtime/decision_rule_proto.h"

#include <set>

#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr double kGreatestGuardFactor = 3;

}  // namespace

absl::Status ReadDecisionRule(const std::string& field, const plant::v1::DecisionRule& in,
                              storage::DecisionRuleRow* out) {
  Refusals refusals;
  refusals.Add(ReadWord(field + ".kind", in.kind(), &out->kind));
  out->edition = in.edition();
  if (in.has_guard_factor()) out->guard_factor = in.guard_factor();
  if (out->kind.empty()) return refusals.status();
  const bool by_standard = out->kind == "ISO_14253_1", by_factor = out->kind == "GUARD_FACTOR";
  const std::set<std::string> editions = {"1998", "2013", "2017"};
  if (by_standard ? editions.count(in.edition()) == 0 : !in.edition().empty())
    refusals.Add(
        Refuse(field + ".edition", in.edition(), by_standard ? "1998, 2013 or 2017" : "none, for " + out->kind));
  if (by_factor && !in.has_guard_factor())
    refusals.Add(Refuse(field + ".guard_factor", "", "> 0 and <= 3, of the expanded uncertainty"));
  if (by_factor && in.has_guard_factor() && !(in.guard_factor() > 0 && in.guard_factor() <= kGreatestGuardFactor))
    refusals.Add(Refuse(field + ".guard_factor", in.guard_factor(), "> 0 and <= 3"));
  if (!by_factor && in.has_guard_factor())
    refusals.Add(Refuse(field + ".guard_factor", in.guard_factor(), "none, for " + out->kind));
  return refusals.status();
}

void ToProto(const storage::DecisionRuleRow& row, StoredWords* words, plant::v1::DecisionRule* to) {
  to->set_kind(words->Value<plant::v1::DecisionRuleKind>(row.kind));
  to->set_edition(row.edition);
  if (row.guard_factor) to->set_guard_factor(*row.guard_factor);
}

}  // namespace sixpoint::runtime
