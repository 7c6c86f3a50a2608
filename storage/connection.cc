#include "storage/connection.h"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>

#include "storage/reasons.h"

namespace sixpoint::storage {
namespace {

// What schema and statements are written and tested for.
constexpr int kOldestServer = 150000;

constexpr char kSqlstatePayload[] = "sixpoint.sqlstate";

// How long after the deadline the server's own statement_timeout may still answer, before the connection is given up.
constexpr std::chrono::milliseconds kGrace{300};

// statement_timeout ends with our deadline; a server that gives up so much earlier had its clock set, for its timeouts go by the
// clock of the day.
constexpr std::chrono::milliseconds kEarly{250};

// client_connection_check_interval: a statement whose client is gone stops by itself. idle_in_transaction_session_timeout: a
// service that is frozen while it holds a lock (the journal's) keeps it no longer. jit: a page of a list looks dear enough to be compiled, which
// then takes longer than the page. search_path first, by a statement that nothing can stand in for: whoever may alter a role or a
// database would put a schema of his before the built-in functions.
constexpr char kSession[] =
    "SET search_path = public, pg_temp; SET timezone = 'UTC'; SET datestyle = 'ISO, YMD'; SET extra_float_digits = 1; "
    "SET bytea_output = 'hex'; "
    "SET client_encoding = 'UTF8'; SET client_min_messages = 'warning'; SET standard_conforming_strings = on; "
    "SET client_connection_check_interval = '2s'; SET idle_in_transaction_session_timeout = '8s'; "
    "SET jit = off";

absl::Status WaitForSocket(int socket, short events, Deadline deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
    if (left <= 0) return absl::DeadlineExceededError("database: no answer before the deadline");
    pollfd waiting{socket, events, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::min<long>(left, 60'000)));
    if (ready > 0) return absl::OkStatus();
    if (ready < 0 && errno != EINTR) return absl::UnavailableError("database: the connection cannot be waited for");
  }
}

// libpq's messages end in a newline and may have several lines.
std::string OneLine(const char* message) {
  std::string text = message == nullptr ? "" : message;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

absl::Status BrokenConnection(pg_conn* connection) { return StatusOfSqlstate("", OneLine(PQerrorMessage(connection))); }

absl::Status StatusOfFailure(const pg_result* result) {
  const char* sqlstate = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  std::string message = OneLine(PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY));
  const char* field = PQresultErrorField(result, PG_DIAG_CONSTRAINT_NAME);
  const std::string constraint = field == nullptr ? "" : field;
  if (!constraint.empty()) message += " (" + constraint + ")";
  const absl::Status status = StatusOfSqlstate(sqlstate == nullptr ? "" : sqlstate, message);
  // Raised by our own triggers: a calibration was withdrawn while a result was made with it, a program is not to leave.
  if (constraint == "calibration_withdrawn") return WithReason(status, kCalibrationWithdrawn);
  return constraint == "program_not_released" ? WithReason(status, kProgramNotReleased) : status;
}

absl::Status Flush(pg_conn* connection, Deadline deadline) {
  for (;;) {
    const int flushed = PQflush(connection);
    if (flushed == 0) return absl::OkStatus();
    if (flushed < 0) return BrokenConnection(connection);
    // Readable too: a server that answers before it has read everything would otherwise block us for ever.
    const absl::Status ready = WaitForSocket(PQsocket(connection), POLLIN | POLLOUT, deadline);
    if (!ready.ok()) return ready;
    if (PQconsumeInput(connection) == 0) return BrokenConnection(connection);
  }
}

int Send(pg_conn* connection, const Message& message) {
  if (message.kind == Message::Kind::kPrepare) return PQsendPrepare(connection, message.name, message.sql, 0, nullptr);
  const WireParams none, &params = message.params == nullptr ? none : *message.params;
  const int count = static_cast<int>(params.values.size());
  if (message.kind == Message::Kind::kRunPrepared)
    return PQsendQueryPrepared(connection, message.name, count, params.values.data(), params.lengths.data(),
                               params.formats.data(), params.result_format);
  return PQsendQueryParams(connection, message.sql, count, nullptr, params.values.data(), params.lengths.data(),
                           params.formats.data(), params.result_format);
}

// Null: there is none left.
absl::StatusOr<Result> NextResult(pg_conn* connection, Deadline give_up) {
  while (PQisBusy(connection) != 0) {
    if (absl::Status ready = WaitForSocket(PQsocket(connection), POLLIN, give_up); !ready.ok()) return ready;
    if (PQconsumeInput(connection) == 0) return BrokenConnection(connection);
  }
  return Result(PQgetResult(connection));
}

absl::Status StatusOf(const pg_result* result) {
  switch (PQresultStatus(result)) {
    case PGRES_COMMAND_OK:
    case PGRES_TUPLES_OK:
    case PGRES_EMPTY_QUERY:
      return absl::OkStatus();
    case PGRES_COPY_IN:
    case PGRES_COPY_OUT:
    case PGRES_COPY_BOTH:
      std::abort();  // COPY is not a statement of ours
    default:
      return StatusOfFailure(result);
  }
}

absl::Status Timely(absl::Status failure, Deadline deadline) {
  if (!absl::IsDeadlineExceeded(failure) || std::chrono::steady_clock::now() + kEarly >= deadline) return failure;
  return absl::UnavailableError(std::string(failure.message()) + ", long before the deadline: its clock was set");
}

absl::Status Classified(const std::string& sqlstate, const std::string& text) {
  const std::string state_class = sqlstate.substr(0, 2);
  if (sqlstate.empty() || state_class == "08") return absl::UnavailableError(text);
  if (sqlstate == "57014") return absl::DeadlineExceededError(text);  // query_canceled: our statement_timeout
  if (sqlstate == "57P01" || sqlstate == "57P02" || sqlstate == "57P03") return absl::UnavailableError(text);
  if (sqlstate == "25P03") return absl::UnavailableError(text);                         // we were idle for too long
  if (sqlstate == "55P03" || sqlstate == "25006") return absl::UnavailableError(text);  // lock timeout; a standby
  if (sqlstate == "23505") return absl::AlreadyExistsError(text);
  // A serialization failure or a deadlock: the same transaction, begun again, may well go through.
  if (state_class == "40") return WithReason(absl::AbortedError(text), kTransactionConflict);
  if (sqlstate == "XX001" || sqlstate == "XX002") return WithReason(absl::DataLossError(text), kDatabaseDamaged);
  if (state_class == "23") return absl::FailedPreconditionError(text);
  if (state_class == "53" || sqlstate == "54000") return absl::ResourceExhaustedError(text);
  if (state_class == "22") return absl::InvalidArgumentError(text);
  return absl::InternalError(text);
}

}  // namespace

void CloseConnection::operator()(pg_conn* connection) const { PQfinish(connection); }
void ClearResult::operator()(pg_result* result) const { PQclear(result); }

absl::Status StatusOfSqlstate(const std::string& sqlstate, const std::string& message) {
  absl::Status status = Classified(sqlstate, "database: " + message + (sqlstate.empty() ? "" : " [" + sqlstate + "]"));
  status.SetPayload(kSqlstatePayload, absl::Cord(sqlstate));
  return status;
}

std::string SqlstateOf(const absl::Status& status) {
  return std::string(status.GetPayload(kSqlstatePayload).value_or(absl::Cord()));
}

absl::StatusOr<Connection> Connect(const std::string& conninfo, Deadline deadline) {
  // What libpq says of a text that it cannot read repeats parts of it, and a password may be one.
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> readable(
      PQconninfoParse(conninfo.c_str(), nullptr), &PQconninfoFree);
  const bool is_a_name = conninfo.find('=') == std::string::npos && conninfo.find("://") == std::string::npos;
  if (readable == nullptr && !is_a_name)
    return absl::UnavailableError("database: --database: not readable, want a connection string as libpq takes it");
  // What conninfo says comes after, and wins. A server that went away without a word is noticed while an answer is waited for.
  const char* keywords[] = {"keepalives_idle",
                            "keepalives_interval",
                            "keepalives_count",
                            "tcp_user_timeout",
                            "dbname",
                            "fallback_application_name",
                            nullptr};
  const char* values[] = {"10", "5", "3", "20000", conninfo.c_str(), "sixpoint", nullptr};
  Connection connection(PQconnectStartParams(keywords, values, /*expand_dbname=*/1));
  if (connection == nullptr) return absl::ResourceExhaustedError("database: no memory for a connection");
  // The server's notices are for its own log: libpq would print them between our log lines.
  PQsetNoticeReceiver(
      connection.get(), [](void*, const PGresult*) {}, nullptr);
  PostgresPollingStatusType polling = PGRES_POLLING_WRITING;
  while (polling != PGRES_POLLING_OK) {
    if (polling == PGRES_POLLING_FAILED || PQstatus(connection.get()) == CONNECTION_BAD) {
      return absl::UnavailableError("database: not reachable: " + OneLine(PQerrorMessage(connection.get())));
    }
    const absl::Status ready =
        WaitForSocket(PQsocket(connection.get()), polling == PGRES_POLLING_READING ? POLLIN : POLLOUT, deadline);
    if (!ready.ok()) return ready;
    polling = PQconnectPoll(connection.get());
  }
  if (const int version = PQserverVersion(connection.get()); version < kOldestServer)
    return absl::FailedPreconditionError("PostgreSQL: version " + std::to_string(version / 10000) + "." +
                                         std::to_string(version % 10000) + ", want 15 or newer");
  if (PQsetnonblocking(connection.get(), 1) != 0) return BrokenConnection(connection.get());
  const absl::StatusOr<Result> session = Query(connection.get(), kSession, nullptr, deadline);
  if (!session.ok()) return session.status();
  return connection;
}

absl::StatusOr<Result> Query(pg_conn* connection, const std::string& sql, const WireParams* params, Deadline deadline) {
  const int sent = params == nullptr ? PQsendQuery(connection, sql.c_str())
                                     : Send(connection, {Message::Kind::kRun, sql.c_str(), nullptr, params});
  if (sent == 0) return BrokenConnection(connection);
  return Answer(connection, deadline);
}

absl::StatusOr<Result> Answer(pg_conn* connection, Deadline deadline) {
  const Deadline give_up = deadline + kGrace;
  if (absl::Status flushed = Flush(connection, give_up); !flushed.ok()) return flushed;
  absl::Status failure;
  Result last;
  for (;;) {
    absl::StatusOr<Result> result = NextResult(connection, give_up);
    if (!result.ok()) return result.status();
    if (*result == nullptr) break;
    if (absl::Status judged = StatusOf(result->get()); failure.ok()) failure = std::move(judged);
    last = *std::move(result);
  }
  if (!failure.ok()) return Timely(std::move(failure), deadline);
  if (last == nullptr) return BrokenConnection(connection);
  return last;
}

absl::StatusOr<Result> Pipeline(pg_conn* connection, const std::vector<Message>& messages, Deadline deadline,
                                std::size_t* done) {
  *done = 0;
  const Deadline give_up = deadline + kGrace;
  if (PQenterPipelineMode(connection) == 0) return BrokenConnection(connection);
  for (const Message& message : messages)
    if (Send(connection, message) == 0) return BrokenConnection(connection);
  if (PQpipelineSync(connection) == 0) return BrokenConnection(connection);
  if (absl::Status flushed = Flush(connection, give_up); !flushed.ok()) return flushed;
  absl::Status failure;
  Result last;
  for (bool is_over = false; !is_over;) {
    absl::StatusOr<Result> result = NextResult(connection, give_up);
    if (!result.ok()) return result.status();
    if (*result == nullptr) {  // between two of them, or of a connection that is gone
      if (PQstatus(connection) == CONNECTION_OK) continue;
      return failure.ok() ? BrokenConnection(connection) : failure;
    }
    const ExecStatusType kind = PQresultStatus(result->get());
    is_over = kind == PGRES_PIPELINE_SYNC;
    if (is_over || kind == PGRES_PIPELINE_ABORTED) continue;
    absl::Status judged = StatusOf(result->get());
    *done += judged.ok();
    if (failure.ok()) failure = std::move(judged);
    last = *std::move(result);
  }
  if (PQexitPipelineMode(connection) == 0) return BrokenConnection(connection);
  if (!failure.ok()) return Timely(std::move(failure), deadline);
  return last;
}

bool IsUsable(pg_conn* connection) {
  return PQstatus(connection) == CONNECTION_OK && PQpipelineStatus(connection) == PQ_PIPELINE_OFF &&
         PQtransactionStatus(connection) != PQTRANS_ACTIVE && PQtransactionStatus(connection) != PQTRANS_UNKNOWN;
}

}  // namespace sixpoint::storage
