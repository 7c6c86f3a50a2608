// One libpq connection whose every wait ends at a deadline. Private to storage.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "storage/database.h"

struct pg_conn;

namespace sixpoint::storage {

struct CloseConnection {
  void operator()(pg_conn* connection) const;
};
using Connection = std::unique_ptr<pg_conn, CloseConnection>;

struct ClearResult {
  void operator()(pg_result* result) const;
};
using Result = std::unique_ptr<pg_result, ClearResult>;

// The one map from SQLSTATE to a status. An empty SQLSTATE is a connection that broke.
absl::Status StatusOfSqlstate(const std::string& sqlstate, const std::string& message);
// Of such a status; empty of any other.
std::string SqlstateOf(const absl::Status& status);

// UNAVAILABLE when the server cannot be reached; DEADLINE_EXCEEDED when it does not answer. The session speaks UTC, ISO
// dates, UTF-8 and shortest exact doubles, whatever the server's own settings are.
absl::StatusOr<Connection> Connect(const std::string& conninfo, Deadline deadline);

// Parameters as libpq takes them; empty for the simple protocol, which allows several statements.
struct WireParams {
  std::vector<const char*> values;
  std::vector<int> lengths;
  std::vector<int> formats;
  int result_format = 0;  // 1: binary
};

// The last result of the text. When it returns DEADLINE_EXCEEDED or UNAVAILABLE the connection may be out of step: see
// IsUsable.
absl::StatusOr<Result> Query(pg_conn* connection, const std::string& sql, const WireParams* params, Deadline deadline);

// The answer to what was sent: the last result.
absl::StatusOr<Result> Answer(pg_conn* connection, Deadline deadline);

// One of several that are sent together.
struct Message {
  enum class Kind { kRun, kPrepare, kRunPrepared };
  Kind kind;
  const char* sql;             // of one statement; unused where it is prepared already
  const char* name = nullptr;  // of the prepared statement
  const WireParams* params = nullptr;
};
// In one round trip, each only where those before it went well: the last one's result. done: how many went well.
absl::StatusOr<Result> Pipeline(pg_conn* connection, const std::vector<Message>& messages, Deadline deadline,
                                std::size_t* done);

// False for a connection that broke, that still waits for an answer or was left within a pipeline.
bool IsUsable(pg_conn* connection);

}  // namespace sixpoint::storage
