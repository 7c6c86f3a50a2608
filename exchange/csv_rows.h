// Rows of CSV (RFC 4180), and the apostrophes before what a spreadsheet would take for a formula.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sixpoint::exchange {

// A spreadsheet would take it for a formula, or it begins with an apostrophe.
bool IsGuarded(std::string_view text);
// Without the apostrophe before such a text.
std::string Unguarded(const std::string& cell);

// An empty cell has none. INVALID_ARGUMENT with what was wanted: it is no number.
absl::Status ReadNumber(const char* column, const std::string& cell, const char* wanted, std::optional<double>* number);

// The cells of the next row, with quotes as they stand in them taken off; it takes the row off the file.
absl::StatusOr<std::vector<std::string>> NextCsvRow(std::string_view* file, std::size_t most_cells);

}  // namespace sixpoint::exchange
