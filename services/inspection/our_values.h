// Where our own values of a drawing's characteristics come from: the findings of assessments.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "services/inspection/paired_values.h"
#include "storage/assessments.h"
#include "storage/database.h"

namespace sixpoint::inspection {

// Thread-safe.
class OurValues {
 public:
  virtual ~OurValues() = default;
  // Of these blades, by that revision of the drawing, one each of a blade's characteristics and features, of the newest assessment that has
  // it. The blades are seen by who asks. INVALID_ARGUMENT: more than an answer holds.
  virtual absl::StatusOr<std::vector<OurValue>> Of(const std::string& drawing_id, int drawing_revision,
                                                   const std::vector<std::string>& blade_serials,
                                                   storage::Deadline deadline) const = 0;
};

// Findings of assessments whose value is this plant's own.
std::shared_ptr<const OurValues> OurValuesOf(std::shared_ptr<const storage::AssessmentStore> store);

}  // namespace sixpoint::inspection
