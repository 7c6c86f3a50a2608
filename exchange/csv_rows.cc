#include "exchange/csv_rows.h"

#include "exchange/text.h"
#include "refusal/refusal.h"

namespace sixpoint::exchange {

bool IsGuarded(std::string_view text) {
  constexpr std::string_view kFormula = "=+-@\t\r\n'";
  return !text.empty() && kFormula.find(text.front()) != std::string_view::npos;
}

std::string Unguarded(const std::string& cell) {
  return cell.size() > 1 && cell.front() == '\'' && IsGuarded(std::string_view(cell).substr(1)) ? cell.substr(1) : cell;
}

absl::Status ReadNumber(const char* column, const std::string& cell, const char* wanted,
                        std::optional<double>* number) {
  if (cell.empty()) return absl::OkStatus();
  *number = NumberOf(cell);
  return *number ? absl::OkStatus() : Refuse(column, cell, wanted);
}

absl::StatusOr<std::vector<std::string>> NextCsvRow(std::string_view* file, std::size_t most_cells) {
  std::vector<std::string> cells(1);
  std::size_t i = 0;
  bool quoted = false;
  for (; i < file->size(); ++i) {
    const char c = (*file)[i];
    if (quoted) {
      if (c != '"') {
        cells.back() += c;
      } else if (i + 1 < file->size() && (*file)[i + 1] == '"') {
        cells.back() += '"';
        ++i;
      } else {
        quoted = false;
        if (i + 1 < file->size() && std::string_view(",\r\n").find((*file)[i + 1]) == std::string_view::npos)
          return Refuse("cell", cells.back(), "a comma or an end of line after a quote");
      }
    } else if (c == '"' && cells.back().empty()) {
      quoted = true;
    } else if (c == ',') {
      if (cells.size() == most_cells) return Refuse("cells", "more", std::to_string(most_cells) + " of them");
      cells.emplace_back();
    } else if (c == '\n') {
      ++i;
      break;
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  if (quoted) return Refuse("cell", cells.back(), "a quote that ends");
  file->remove_prefix(i);
  return cells;
}

}  // namespace sixpoint::exchange
