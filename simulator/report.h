// What the demo shows at the end: tables for a person, JSON for a program.
#pragma once

#include <absl/status/status.h>

#include <nlohmann/json.hpp>
#include <string>

#include "simulator/blade_run.h"

namespace sixpoint::simulator {

// Why a finished run does not hold against the truth; empty when it does.
std::string Shortfall(const BladeRunResult& result);

// Nominal beside corrected A, B, X, Y, Z of every hole (the paper's Table 10).
std::string CorrectionTable(const BladeRunResult& result);
// Every hole, measured beside true.
std::string HoleTable(const BladeRunResult& result);
// One line a machine.
std::string SummaryTable(const std::vector<BladeRunResult>& results, const std::vector<absl::Status>& statuses);

nlohmann::json ToJson(const BladeRunResult& result, const absl::Status& status);

}  // namespace sixpoint::simulator
