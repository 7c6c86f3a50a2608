// What a report tells of, fetched and checked: one blade's results and all that they rest on.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/clients/blade_peers.h"
#include "services/inspection/report_of.h"
#include "services/runtime/call.h"
#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"
#include "storage/measurements.h"
#include "storage/sections.h"

namespace sixpoint::inspection {

// assessments/{uuid}, by its name. ASSESSMENT_NOT_FOUND: none of that name.
using FindAssessment = std::function<absl::StatusOr<v1::Assessment>(const std::string& name, storage::Deadline)>;
FindAssessment AssessmentsOf(
    std::shared_ptr<const storage::ResultReader<storage::AssessmentRow, storage::AssessmentFilter>> reader);

struct ReportSources {
  std::shared_ptr<storage::InspectionStore> inspections;
  std::shared_ptr<storage::DeviationStore> deviations;
  std::shared_ptr<storage::SectionStore> sections;
  std::shared_ptr<storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>> measurements;
  FindAssessment assessment;
};

using ResultNames = std::vector<std::string>;

// Pure: 1 to 64 results, each once and of a kind that can be told; an assessment alone.
absl::Status CheckResults(const ResultNames& results);

// Of names that CheckResults let pass. Refused: results of different blades, or measured against different revisions of a part. NOT_FOUND with a
// reason: what is not recorded.
absl::StatusOr<ReportInputs> FetchReport(const ReportSources& sources, const clients::BladePeers& peers,
                                         const ResultNames& results, const runtime::Caller& caller);

}  // namespace sixpoint::inspection
