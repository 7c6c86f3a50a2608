// Assessments as people read them.
#pragma once

#include <string>

#include "cli/table.h"
#include "sixpoint/inspection/v1/assessment.pb.h"

namespace sixpoint::cli {

// The verdict and what becomes of a blank, then groups, then each characteristic, the worst beside its limits.
std::string AssessmentText(const inspection::v1::Assessment& assessment);
// A row of a list.
Cells AssessmentCells(const inspection::v1::Assessment& assessment);
std::string AssessmentPlanText(const inspection::v1::AssessmentPlan& plan);

}  // namespace sixpoint::cli
