// A transaction of the benchmark's own, which ends the program where the database does not answer as it must.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "storage/database.h"

namespace sixpoint::bench {

template <typename Value>
Value Must(absl::StatusOr<Value> value) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "bench ground: %s\n", value.status().ToString().c_str());
  std::exit(1);
}

inline storage::Transaction Begin(storage::Database* database) {
  return Must(database->Begin(std::chrono::steady_clock::now() + std::chrono::minutes(2)));
}

inline void Commit(storage::Transaction* transaction) {
  if (const absl::Status committed = transaction->Commit(); !committed.ok()) Must(absl::StatusOr<int>(committed));
}

}  // namespace sixpoint::bench
