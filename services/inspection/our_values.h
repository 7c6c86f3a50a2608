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
  // Of these blades, by any revision of the drawing, the newest assessment first; what was not measured is left out. The blades are seen by who
  // asks.
  virtual absl::StatusOr<std::vector<OurValue>> Of(const std::string& drawing_id,
                                                   const std::vector<std::string>& blade_serials,
                                                   storage::Deadline deadline) const = 0;
};

// Findings of assessments whose value is this plant's own.
std::shared_ptr<const OurValues> OurValuesOf(std::shared_ptr<const storage::AssessmentStore> store);

}  // namespace sixpoint::inspection
