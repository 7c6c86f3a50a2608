// Assessments: a blade against a revision of its drawing, characteristic by characteristic.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/decision_rules.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// Of a characteristic's value by a result that is not the one judged.
struct OtherValueRow {
  int result_index = 0;  // in AssessmentRow::results
  std::string method;    // empty: not positioned by this plant
  double value = 0;
  std::optional<double> expanded_uncertainty;
};

// Words are those of the contract, without the names of their enums.
struct CharacteristicFindingRow {
  std::string characteristic, feature,
      place;  // place: a hole group, section or region; empty: the whole surface, or elsewhere
  std::string name, characteristic_class, quantity, unit;
  std::optional<double> nominal, lower_limit, upper_limit;  // in `unit`, as all numbers
  std::optional<double> value, expanded_uncertainty;        // none: not measured
  std::string verdict;
  DecisionRuleRow rule;
  std::string reason;               // empty exactly of CONFORM and NOT_CONFORM
  std::optional<int> result_index;  // in AssessmentRow::results; none: none has it
  std::string method;               // empty: not positioned by this plant
  std::string cure;                 // POSSIBLE, NONE, UNKNOWN; empty: not asked
  std::vector<OtherValueRow> others;
};

struct LimitConflictRow {
  std::string characteristic;
  int result_index = 0;
  int patch = 0;
  double mean_um = 0, expanded_uncertainty_um = 0;
  std::array<double, 3> centre_in_part_mm{};
  bool above = false;
  double share = 0;
};

struct AssessmentRow {
  std::string assessment_id;
  std::string blade_serial;
  std::string machine_id;  // empty: of none
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string drawing_id;
  int drawing_revision = 0;
  std::string stage;  // BEFORE_MACHINING, MACHINED
  std::string verdict;
  std::string fate;  // MACHINABLE, DISCARD, UNDECIDED; empty: machined
  std::string fate_reason;
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;                 // set when it is recorded
  std::vector<std::string> results;  // names: inspections/{uuid}, ...
  std::vector<CharacteristicFindingRow> findings;
  std::vector<LimitConflictRow> conflicts;
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

struct AssessmentFilter : ResultFilter {
  std::string verdict;       // empty: any
  std::string drawing_id;    // empty: any
  int drawing_revision = 0;  // 0: any
};

using AssessmentStore = ResultStore<AssessmentRow, AssessmentFilter>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<AssessmentStore> AssessmentsIn(Database* database);

// The same in a transaction of the caller's: journal entry, assessment and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertAssessment(Transaction& transaction, const AssessmentRow& assessment,
                                          const RecordEntry& entry);

}  // namespace sixpoint::storage
