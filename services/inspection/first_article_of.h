// A first article's forms (AS9102) of an assessment, its drawing, and what only people know: pure.
#pragma once

#include <absl/status/statusor.h>

#include "report/first_article.h"
#include "sixpoint/inspection/v1/assessment.pb.h"
#include "sixpoint/inspection/v1/report.pb.h"

namespace sixpoint::inspection {

// What needs no record to be refused: a partial one without its reason, names given twice.
absl::Status CheckFields(const v1::FirstArticleFields& fields);

// drawing: that it names. A characteristic of the drawing that the assessment says nothing of is there as not measured. INVALID_ARGUMENT as
// CheckFields, and where the fields name a requirement or a characteristic that the drawing does not have.
absl::StatusOr<report::FirstArticle> FirstArticleOf(const v1::Assessment& assessment, const plant::v1::Drawing& drawing,
                                                    const v1::FirstArticleFields& fields);

}  // namespace sixpoint::inspection
