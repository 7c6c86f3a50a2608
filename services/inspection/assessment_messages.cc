#include "services/inspection/assessment_messages.h"

#include <algorithm>
#include <string>

#include "services/inspection/stored_verdict.h"
#include "services/runtime/decision_rule_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using runtime::StoredEnum;

// Of rows that name results by their place.
class Results {
 public:
  explicit Results(const storage::AssessmentRow& row) : row_(row), what_("assessment " + row.assessment_id) {}

  const std::string& what() const { return what_; }
  absl::StatusOr<std::string> Name(int index) const {
    if (index >= 0 && static_cast<std::size_t>(index) < row_.results.size())
      return row_.results[static_cast<std::size_t>(index)];
    return absl::DataLossError(what_ + ": a value of result " + std::to_string(index) + ", want one that is kept");
  }
  // Sets result and method; a result of another instrument has none.
  template <typename Message>
  absl::Status SetResult(int index, const std::string& method, Message* out) const {
    const auto name = Name(index);
    if (!name.ok()) return name.status();
    out->set_result(*name);
    if (method.empty()) return absl::OkStatus();
    const auto value = StoredEnum<registration::v1::Method>(method, what_);
    if (value.ok()) out->set_method(*value);
    return value.status();
  }

 private:
  const storage::AssessmentRow& row_;
  const std::string what_;
};

absl::Status SetWords(const storage::CharacteristicFindingRow& row, const std::string& what,
                      v1::CharacteristicFinding* out) {
  const auto of_class = StoredEnum<plant::v1::CharacteristicClass>(row.characteristic_class, what);
  if (!of_class.ok()) return of_class.status();
  out->set_characteristic_class(*of_class);
  const auto quantity = StoredEnum<plant::v1::CharacteristicQuantity>(row.quantity, what);
  if (!quantity.ok()) return quantity.status();
  out->set_quantity(*quantity);
  const auto unit = StoredEnum<plant::v1::CharacteristicUnit>(row.unit, what);
  if (!unit.ok()) return unit.status();
  out->set_unit(*unit);
  const auto verdict = VerdictOf(row.verdict, what);
  if (!verdict.ok()) return verdict.status();
  out->set_verdict(*verdict);
  if (row.cure.empty()) return absl::OkStatus();
  const auto cure = StoredEnum<v1::Cure>(row.cure, what);
  if (cure.ok()) out->set_cure(*cure);
  return cure.status();
}

absl::Status Fill(const storage::CharacteristicFindingRow& row, const Results& results,
                  v1::CharacteristicFinding* out) {
  out->set_characteristic(row.characteristic);
  out->set_feature(row.feature);
  out->set_name(row.name);
  if (absl::Status set = SetWords(row, results.what(), out); !set.ok()) return set;
  if (row.nominal) out->set_nominal(*row.nominal);
  if (row.lower_limit) out->set_lower_limit(*row.lower_limit);
  if (row.upper_limit) out->set_upper_limit(*row.upper_limit);
  if (row.value) out->set_value(*row.value);
  if (row.expanded_uncertainty) out->set_expanded_uncertainty(*row.expanded_uncertainty);
  runtime::StoredWords words(results.what());
  runtime::ToProto(row.rule, &words, out->mutable_decision_rule());
  if (!words.status().ok()) return words.status();
  out->set_reason(row.reason);
  if (row.result_index)
    if (absl::Status set = results.SetResult(*row.result_index, row.method, out); !set.ok()) return set;
  for (const storage::OtherValueRow& other_row : row.others) {
    v1::OtherValue& other = *out->add_others();
    if (absl::Status set = results.SetResult(other_row.result_index, other_row.method, &other); !set.ok()) return set;
    other.set_value(other_row.value);
    if (other_row.expanded_uncertainty) other.set_expanded_uncertainty(*other_row.expanded_uncertainty);
  }
  return absl::OkStatus();
}

// The worst first, as the contract orders them.
int Severity(v1::Verdict verdict) {
  switch (verdict) {
    case v1::VERDICT_NOT_CONFORM:
      return 3;
    case v1::VERDICT_NOT_MEASURED:
      return 2;
    case v1::VERDICT_UNDECIDABLE:
      return 1;
    default:
      return 0;
  }
}

void AddToGroup(const std::string& place, v1::Verdict verdict, v1::Assessment* assessment) {
  const std::string name = place.empty() ? "part" : place;
  auto& groups = *assessment->mutable_groups();
  auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& one) { return one.group() == name; });
  if (group == groups.end()) {
    groups.Add()->set_group(name);
    group = groups.end() - 1;
    group->set_verdict(v1::VERDICT_CONFORM);
  }
  if (Severity(verdict) > Severity(group->verdict())) group->set_verdict(verdict);
  group->set_finding_count(group->finding_count() + 1);
  group->set_conform_count(group->conform_count() + (verdict == v1::VERDICT_CONFORM ? 1 : 0));
}

absl::Status SetConflicts(const storage::AssessmentRow& row, const Results& results, v1::Assessment* assessment) {
  for (const storage::LimitConflictRow& conflict_row : row.conflicts) {
    v1::LimitConflict& conflict = *assessment->add_conflicts();
    const auto name = results.Name(conflict_row.result_index);
    if (!name.ok()) return name.status();
    conflict.set_characteristic(conflict_row.characteristic);
    conflict.set_result(*name);
    conflict.mutable_patch()->set_patch(conflict_row.patch);
    conflict.mutable_patch()->set_mean_um(conflict_row.mean_um);
    conflict.mutable_patch()->set_expanded_uncertainty_um(conflict_row.expanded_uncertainty_um);
    runtime::SetPoint(conflict_row.centre_in_part_mm, conflict.mutable_patch()->mutable_centre_in_part_mm());
    conflict.set_above(conflict_row.above);
    conflict.set_share(conflict_row.share);
  }
  return absl::OkStatus();
}

absl::Status SetVerdicts(const storage::AssessmentRow& row, const std::string& what, v1::Assessment* assessment) {
  const auto stage = StoredEnum<v1::AssessmentStage>(row.stage, what);
  if (!stage.ok()) return stage.status();
  assessment->set_stage(*stage);
  const auto verdict = VerdictOf(row.verdict, what);
  if (!verdict.ok()) return verdict.status();
  assessment->set_verdict(*verdict);
  assessment->set_fate_reason(row.fate_reason);
  if (row.fate.empty()) return absl::OkStatus();
  const auto fate = StoredEnum<v1::BlankFate>(row.fate, what);
  if (fate.ok()) assessment->set_fate(*fate);
  return fate.status();
}

}  // namespace

absl::StatusOr<v1::Assessment> ToProto(const storage::AssessmentRow& row) {
  v1::Assessment assessment;
  const Results results(row);
  assessment.set_name(runtime::NameOf("assessments", row.assessment_id));
  assessment.set_blade(runtime::NameOf("blades", row.blade_serial));
  assessment.set_drawing(runtime::RevisedName("drawings", row.drawing_id, row.drawing_revision));
  for (const std::string& result : row.results) assessment.add_results(result);
  if (absl::Status set = SetVerdicts(row, results.what(), &assessment); !set.ok()) return set;
  for (const storage::CharacteristicFindingRow& finding : row.findings) {
    v1::CharacteristicFinding* const out = assessment.add_findings();
    if (absl::Status set = Fill(finding, results, out); !set.ok()) return set;
    AddToGroup(finding.place, out->verdict(), &assessment);
  }
  if (absl::Status set = SetConflicts(row, results, &assessment); !set.ok()) return set;
  assessment.set_part(runtime::NameOf("parts", row.part_id));
  assessment.set_part_revision(row.part_revision);
  assessment.set_requested_by(row.requested_by);
  assessment.set_software_version(row.software_version);
  assessment.set_computed_on(row.computed_on);
  runtime::ToProto(row.recorded.recorded_at, assessment.mutable_recorded_at());
  assessment.set_record_sequence(row.recorded.sequence);
  assessment.set_work_order(row.work_order);
  assessment.set_operation(row.operation);
  return assessment;
}

void LeaveBasic(v1::Assessment* assessment) {
  assessment->clear_findings();
  assessment->clear_conflicts();
}

}  // namespace sixpoint::inspection
