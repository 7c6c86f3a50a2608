// What a machine's control holds beside a program, as it was stated: columns of whatever keeps that with a program or its template.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct WorkOffsetRow {
  std::string code;                // "G54"
  std::array<double, 5> offset{};  // machine less program: X, Y, Z in mm, the two rotary axes in deg
};

struct ToolLengthRow {
  int number = 0;
  double length_mm = 0;
};

// Columns: codes, values; both NULL where there are none.
inline void Add(const std::vector<WorkOffsetRow>& work_offsets, Params* params) {
  std::vector<std::string> codes;
  std::vector<double> values;
  for (const WorkOffsetRow& one : work_offsets) {
    codes.push_back(one.code);
    values.insert(values.end(), one.offset.begin(), one.offset.end());
  }
  codes.empty() ? params->Null().Null() : params->Texts(codes).Reals(values);
}
// The database holds five values for each code.
inline std::vector<WorkOffsetRow> WorkOffsetsAt(const Rows& rows, int row, int column) {
  std::vector<WorkOffsetRow> work_offsets;
  if (rows.IsNull(row, column)) return work_offsets;
  const std::vector<std::string> codes = rows.Texts(row, column);
  const std::vector<double> values = rows.Reals(row, column + 1);
  for (std::size_t i = 0; i < codes.size() && 5 * i + 5 <= values.size(); ++i) {
    WorkOffsetRow& out = work_offsets.emplace_back();
    out.code = codes[i];
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(5 * i), 5, out.offset.begin());
  }
  return work_offsets;
}

// Columns: numbers ($n::integer[]), lengths; both NULL where there are none.
inline void Add(const std::vector<ToolLengthRow>& tool_lengths, Params* params) {
  std::vector<double> numbers, lengths_mm;
  for (const ToolLengthRow& tool : tool_lengths) {
    numbers.push_back(tool.number);
    lengths_mm.push_back(tool.length_mm);
  }
  numbers.empty() ? params->Null().Null() : params->Reals(numbers).Reals(lengths_mm);
}
// The database holds as many of the one as of the other.
inline std::vector<ToolLengthRow> ToolLengthsAt(const Rows& rows, int row, int column) {
  std::vector<ToolLengthRow> tool_lengths;
  if (rows.IsNull(row, column)) return tool_lengths;
  const std::vector<double> numbers = rows.Reals(row, column), lengths_mm = rows.Reals(row, column + 1);
  for (std::size_t i = 0; i < numbers.size() && i < lengths_mm.size(); ++i)
    tool_lengths.push_back({static_cast<int>(numbers[i]), lengths_mm[i]});
  return tool_lengths;
}

}  // namespace sixpoint::storage
