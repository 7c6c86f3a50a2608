// Judges recorded results of a blade by its drawing (docs/methods/assessment.md): pure.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "services/inspection/characteristic_values.h"
#include "storage/assessments.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

struct AssessmentInputs {
  plant::v1::Drawing drawing;
  plant::v1::Part part;  // of the revision that the results were measured against
  v1::AssessmentStage stage = v1::ASSESSMENT_STAGE_UNSPECIFIED;
  std::vector<AssessedResult> results;
  // Before machining, of each of the maps, by its place in `results`.
  std::map<int, storage::DeviationPatchesRow> patches;
};

// Which of the results, by its place, was judged for a finding; it stays so for all that is told of it.
struct Assessed {
  std::string verdict, fate, fate_reason;  // as AssessmentRow has them
  std::vector<storage::CharacteristicFindingRow> findings;
  std::vector<storage::LimitConflictRow> conflicts;
};

// INVALID_ARGUMENT: nothing of the drawing is due. CANCELLED: keep_going said so.
absl::StatusOr<Assessed> Assess(const AssessmentInputs& inputs, const std::function<bool()>& keep_going);

}  // namespace sixpoint::inspection
