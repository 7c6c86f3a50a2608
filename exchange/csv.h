// Results as CSV (RFC 4180): one row a characteristic, for spreadsheets and scripts. Columns: docs/exchange.md, csv. Numbers are the shortest
// text that reads back as the same number. A text that a spreadsheet would take for a formula (it begins with = + - @, tab or an end of line)
// has an apostrophe before it, and so has one that begins with an apostrophe.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>
#include <vector>

#include "exchange/inspected_part.h"

namespace sixpoint::exchange {

// The names of the columns, with its end of line.
std::string CsvHead();
// Rows with their ends of line; a part without characteristics has none. What Check refuses is written as it is.
std::string ToCsv(const InspectedPart& part);

inline constexpr std::size_t kMostCsvBytes = 64 << 20;
inline constexpr std::size_t kMostCsvRows = 1000000;

// What rows under that head tell: those that follow each other with one result, serial number and time are one part, its verdict the worst of
// them. INVALID_ARGUMENT names the row.
absl::StatusOr<std::vector<InspectedPart>> FromCsv(std::string_view file, std::size_t most_rows = kMostCsvRows);

}  // namespace sixpoint::exchange
