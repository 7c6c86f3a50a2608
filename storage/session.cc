#include "storage/session.h"

#include <libpq-fe.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "storage/blobs.h"

namespace sixpoint::storage {
namespace {

// statement_timeout may not be 0, which means none.
std::string TimeoutUntil(Deadline deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return "SET LOCAL statement_timeout = " + std::to_string(std::max<std::int64_t>(left.count(), 0) + 1);
}

// The texts of a service are some hundred; those that are made for their call, or are long, are read each time.
constexpr std::size_t kMostPrepared = 256, kLongestPrepared_bytes = 16384;

// A filter that may be left out, ($1 = '' OR part_id = $1), wants a plan for what is asked: PostgreSQL makes one for all of a prepared
// statement's values once five of them cost as much, and keeps it for those that would have an index.
bool IsWorthPreparing(const std::string& sql) {
  return sql.size() <= kLongestPrepared_bytes && sql.find(" OR ") == std::string::npos;
}

// A prepared statement whose table has other columns since (0A000), or that somebody discarded (26000): another session does.
bool IsForgotten(const absl::Status& status) {
  const std::string sqlstate = SqlstateOf(status);
  return sqlstate == "0A000" || sqlstate == "26000";
}

}  // namespace

absl::StatusOr<std::unique_ptr<Session>> Session::Open(const std::string& conninfo, Deadline deadline) {
  absl::StatusOr<Connection> connection = Connect(conninfo, deadline);
  if (!connection.ok()) return connection.status();
  return std::unique_ptr<Session>(new Session(*std::move(connection)));
}

absl::Status Session::Settle(Deadline deadline) {
  if (!is_rolling_back_) return absl::OkStatus();
  const absl::StatusOr<Result> ended = Answer(connection_.get(), deadline);
  is_rolling_back_ = false;
  return ended.status();
}

absl::StatusOr<Result> Session::Run(const std::string& sql, const WireParams& params, Deadline deadline) {
  if (absl::Status settled = Settle(deadline); !settled.ok()) return settled;
  std::vector<Message> messages;
  const std::string timeout = has_begun_ ? "" : TimeoutUntil(deadline);
  if (!has_begun_) {
    messages.push_back({Message::Kind::kRun, "BEGIN"});
    messages.push_back({Message::Kind::kRun, timeout.c_str()});
  }
  const auto known = names_.find(sql);
  const bool is_known = known != names_.end();
  const bool prepares = !is_known && names_.size() < kMostPrepared && IsWorthPreparing(sql);
  // The same name never stands for another text, whoever shares the server's session.
  const std::string name = is_known ? known->second : prepares ? "s" + Sha256Hex(sql).substr(0, 32) : "";
  if (prepares) messages.push_back({Message::Kind::kPrepare, sql.c_str(), name.c_str()});
  const auto kind = is_known || prepares ? Message::Kind::kRunPrepared : Message::Kind::kRun;
  messages.push_back({kind, sql.c_str(), name.c_str(), &params});
  std::size_t done = 0;
  absl::StatusOr<Result> result = Pipeline(connection_.get(), messages, deadline, &done);
  // From here on the server may be in the transaction, whatever became of the statement.
  has_begun_ = has_begun_ || done > 0;
  if (prepares && done + 1 >= messages.size()) names_.emplace(sql, name);
  if (is_known && IsForgotten(result.status())) {
    is_spoiled_ = true;
    return absl::UnavailableError(std::string(result.status().message()));
  }
  return result;
}

absl::Status Session::Commit(Deadline deadline) {
  if (!has_begun_) return absl::OkStatus();
  const absl::StatusOr<Result> result = Query(connection_.get(), "COMMIT", nullptr, deadline);
  if (!result.ok()) return result.status();
  has_begun_ = false;
  // COMMIT of a transaction in which a statement failed succeeds, and says ROLLBACK.
  if (std::strcmp(PQcmdStatus(result->get()), "COMMIT") == 0) return absl::OkStatus();
  return absl::FailedPreconditionError("database: an earlier statement failed, so the transaction was rolled back");
}

bool Session::Abandon() {
  has_begun_ = false;
  if (!IsUsable()) return false;
  if (is_rolling_back_ || PQtransactionStatus(connection_.get()) == PQTRANS_IDLE) return true;
  is_rolling_back_ = PQsendQuery(connection_.get(), "ROLLBACK") == 1 && PQflush(connection_.get()) == 0;
  return is_rolling_back_;
}

}  // namespace sixpoint::storage
