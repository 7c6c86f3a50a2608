// An AssessmentStore in memory; held to the real one by tests/storage/result_store_test.cc.
#pragma once

#include "storage/assessments.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeAssessments final : public FakeResults<storage::AssessmentRow, storage::AssessmentFilter> {
 public:
  using Row = storage::AssessmentRow;
  FakeAssessments()
      : FakeResults(&Row::assessment_id, [](const Row& row, const storage::AssessmentFilter& filter) {
          // A filter's calibration matches none: what an assessment rests on is its results'.
          return IsAsked(filter.blade_serial, row.blade_serial) && IsAsked(filter.machine_id, row.machine_id) &&
                 IsAsked(filter.part_id, row.part_id) && filter.calibration_id.empty() &&
                 storage::Contains(filter.recorded, row.recorded.recorded_at) && IsAsked(filter.verdict, row.verdict) &&
                 IsAsked(filter.drawing_id, row.drawing_id) &&
                 (filter.drawing_revision == 0 || filter.drawing_revision == row.drawing_revision);
        }) {}
};

}  // namespace sixpoint::testing
