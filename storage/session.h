// A connection as the pool keeps it: the transaction that it is in, and the statements that the server has read already. Private to
// storage.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <unordered_map>

#include "storage/connection.h"

namespace sixpoint::storage {

// One thread at a time. A transaction begins with its first statement, in one round trip with it.
class Session {
 public:
  static absl::StatusOr<std::unique_ptr<Session>> Open(const std::string& conninfo, Deadline deadline);

  // statement_timeout is set from the deadline of the transaction's first statement.
  absl::StatusOr<Result> Run(const std::string& sql, const WireParams& params, Deadline deadline);
  // OK without a word where no statement began it.
  absl::Status Commit(Deadline deadline);
  // Rolls back what was begun, without waiting for the server's word. False: the session is to be closed.
  bool Abandon();

  // Whether a statement of this transaction was sent: before that, another session may do as well.
  bool has_begun() const { return has_begun_; }
  // False of one that broke, still waits for an answer or knows statements that are no more.
  bool IsUsable() const { return !is_spoiled_ && (is_rolling_back_ || storage::IsUsable(connection_.get())); }

 private:
  explicit Session(Connection connection) : connection_(std::move(connection)) {}
  // Reads what the server says of the roll-back.
  absl::Status Settle(Deadline deadline);

  Connection connection_;
  std::unordered_map<std::string, std::string> names_;  // of prepared statements, by their text
  bool has_begun_ = false, is_rolling_back_ = false, is_spoiled_ = false;
};

}  // namespace sixpoint::storage
