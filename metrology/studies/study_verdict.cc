#include "metrology/studies/study_verdict.h"

#include <cmath>

namespace sixpoint::metrology {

StudyVerdict JudgeAgainst(double limit, double figure, double standard_uncertainty) {
  if (limit == 0) return StudyVerdict::kReported;
  const double expanded = 2 * standard_uncertainty;
  if (std::abs(figure) + expanded <= limit) return StudyVerdict::kAccepted;
  if (std::abs(figure) - expanded > limit) return StudyVerdict::kRejected;
  return StudyVerdict::kUndecidable;
}

}  // namespace sixpoint::metrology
