// Rows of an aggregate's children, read for many of it by one statement.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// The rows of an aggregate by their ids.
template <typename Row>
class ParentRows {
 public:
  // The rows live longer, and stay where they are.
  ParentRows(std::vector<Row>* rows, std::string Row::*id) {
    for (Row& row : *rows) {
      ids_.push_back(row.*id);
      by_id_[row.*id] = &row;
    }
  }
  const std::vector<std::string>& ids() const { return ids_; }

  // add(parent, children, row) for each row of the statement, whose first column names its parent. DATA_LOSS: a row of none of
  // them; INTERNAL: a value that could not be read.
  template <typename AddChild>
  absl::Status Add(const absl::StatusOr<Rows>& children, const AddChild& add) const {
    if (!children.ok()) return children.status();
    for (int row = 0; row < children->count(); ++row) {
      const std::string id = children->Text(row, 0);
      if (absl::Status read = children->status(); !read.ok()) return read;
      const auto parent = by_id_.find(id);
      if (parent == by_id_.end())
        return absl::DataLossError("a stored row of " + id + ", want one of what was asked for");
      add(*parent->second, *children, row);
    }
    return children->status();
  }

 private:
  std::vector<std::string> ids_;
  std::map<std::string, Row*> by_id_;
};

}  // namespace sixpoint::storage
