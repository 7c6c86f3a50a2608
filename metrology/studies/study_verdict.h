// A study's figure against its limit.
#pragma once

namespace sixpoint::metrology {

enum class StudyVerdict { kAccepted, kRejected, kUndecidable, kReported };

// Whether a figure is at most its limit, with its expanded uncertainty (k = 2) on its side; 0: no limit was stated.
StudyVerdict JudgeAgainst(double limit, double figure, double standard_uncertainty);

}  // namespace sixpoint::metrology
