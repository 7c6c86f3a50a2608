// Lists of numbers in columns that may be NULL: an empty list is NULL, and NULL an empty list.
#pragma once

#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

inline void AddOptionalReals(const std::vector<double>& values, Params* params) {
  values.empty() ? params->Null() : params->Reals(values);
}
inline std::vector<double> OptionalRealsAt(const Rows& rows, int row, int column) {
  return rows.IsNull(row, column) ? std::vector<double>() : rows.Reals(row, column);
}

}  // namespace sixpoint::storage
