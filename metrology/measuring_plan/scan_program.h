// A measuring plan as a program in G and M code, and its proof by the reader that follows machining programs (metrology/correction/nc_reader.h): writer
// and proof share no code.
//
// Coordinates are the joints' own, not a tool's tip: mm and degrees, absolute, four decimals; no work offset may be in force (G53 goes by rapid alone on
// some controls, and so cannot say it of a sweep). Pure.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/kinematics/joint_chain.h"
#include "metrology/measuring_plan/measuring_plan.h"

namespace sixpoint::metrology {

struct ScanProgramOptions {
  double feed_mm_per_min = 1800;     // of a sweep: 30 mm/s
  int output = 1;                    // on (M62) from the start of a sweep to its end (M63)
  std::vector<std::string> remarks;  // each a comment of its own at the begin
};

// Of each sweep: above its start by rapid, with the angles turned before where they change; down to the start; the output on; by feed to its end; the
// output off; up again. The scan's V0 stands in a comment. INVALID_ARGUMENT with field, value and wanted: options; linear joints that are not called X, Y
// and Z (held ones beside), rotary ones by more than a letter.
absl::StatusOr<std::string> WriteScanProgram(const MeasuringPlan& plan, const JointChain& chain,
                                             const ScanProgramOptions& options);

// INVALID_ARGUMENT, naming the line, unless the program goes the plan's way and no other: each place within a unit of the fourth decimal, in order, sweeps
// alone by feed and with the output on at their start.
absl::Status ProveScanProgram(const std::string& program, const MeasuringPlan& plan, const JointChain& chain,
                              const ScanProgramOptions& options);

}  // namespace sixpoint::metrology
