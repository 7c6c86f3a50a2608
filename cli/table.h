// A table as text: columns as wide as their widest cell, numbers to the right.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::cli {

using Cells = std::vector<std::string>;

class Table {
 public:
  // Columns whose header starts with '>' are aligned to the right.
  explicit Table(std::vector<std::string> headers);
  // As many cells as there are headers; missing ones are empty.
  void AddRow(Cells cells);
  bool empty() const { return rows_.empty(); }
  std::string ToText() const;

 private:
  std::vector<std::string> headers_;
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace sixpoint::cli
