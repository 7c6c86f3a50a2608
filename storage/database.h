// PostgreSQL by libpq: a bounded pool and transactions that roll back unless committed.
//
// SQL lives beside its aggregate (storage/scans.cc, ...) as named constants; values travel as $n parameters only.
// Statuses: UNAVAILABLE (no connection, server restarting), DEADLINE_EXCEEDED, ALREADY_EXISTS (unique violation),
// FAILED_PRECONDITION (foreign key, check, append-only), ABORTED (serialization failure, deadlock: begin again),
// DATA_LOSS (the server found its files damaged), RESOURCE_EXHAUSTED (pool or disk full), INVALID_ARGUMENT (a value the
// type cannot hold, a NUL byte in a text), else INTERNAL.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

struct pg_result;

namespace sixpoint::storage {

using Deadline = std::chrono::steady_clock::time_point;  // a clock that is set moves none
using Instant = std::chrono::system_clock::time_point;   // a timestamptz, microseconds kept

// A machine-readable reason (UPPER_SNAKE) travels with a status under this key; runtime puts it on the wire.
inline constexpr char kReasonPayload[] = "sixpoint.reason";
absl::Status WithReason(absl::Status status, const char* reason);  // one of storage/reasons.h

// Parameters of one statement, in the order $1, $2, ...
class Params {
 public:
  Params& Text(std::string_view value);
  Params& Int(std::int64_t value);
  Params& Real(double value);  // exact: shortest text that reads back to the same bits
  Params& Bool(bool value);
  Params& Time(Instant value);
  Params& Bytes(std::string_view value);
  Params& Reals(const std::vector<double>& values);                         // double precision[]
  Params& OptionalInt(std::optional<std::int64_t> value);                   // NULL where there is none
  Params& OptionalTime(std::optional<Instant> value);                       // NULL where there is none
  Params& OptionalReal(std::optional<double> value);                        // NULL where there is none
  Params& OptionalReals(const std::vector<std::optional<double>>& values);  // NULL where there is none
  Params& Texts(const std::vector<std::string>& values);                    // text[]
  Params& Digest(std::string_view hex);                                     // bytea, of lower-case hexadecimal
  Params& Digests(const std::vector<std::string>& hex);                     // bytea[]
  // uuid. A text that is none is an id that nothing has: the nil UUID.
  Params& Uuid(std::string_view id);
  Params& OptionalUuid(std::string_view id);                   // NULL where empty
  Params& OptionalText(std::string_view text);                 // NULL of an empty one
  Params& TextOrNull(const std::optional<std::string>& text);  // NULL where there is none; it may be empty
  Params& Uuids(const std::vector<std::string>& ids);
  Params& Json(std::string_view value) { return Text(value); }  // cast in the SQL: $n::jsonb
  Params& Null();

 private:
  friend class Transaction;
  struct Value {
    std::optional<std::string> bytes;
    bool binary = false;
  };
  std::vector<Value> values_;
};

// Numbers as PostgreSQL reads an array of them, for a list of arrays that are of other lengths: it has none. Empty for no numbers.
std::string ArrayText(const std::vector<double>& values);

// Rows of one result; column numbers start at 0. Reading what a column does not hold (NULL, another type) gives something
// that means nothing, and makes status() say so: a reader asks for it, or lets Checked ask, before a value leaves it.
class Rows {
 public:
  Rows() = default;
  explicit Rows(pg_result* result);
  int count() const;
  bool IsNull(int row, int column) const;
  std::string Text(int row, int column) const;
  std::int64_t Int(int row, int column) const;
  double Real(int row, int column) const;
  std::optional<double> OptionalReal(int row, int column) const;  // none of NULL
  std::string OptionalText(int row, int column) const;            // empty of NULL
  bool Bool(int row, int column) const;
  Instant Time(int row, int column) const;
  std::string Bytes(int row, int column) const;
  std::string Digest(int row, int column) const;  // of bytea, as lower-case hexadecimal
  std::vector<double> Reals(int row, int column) const;
  std::vector<std::string> Texts(int row, int column) const;
  int affected() const;

  // INTERNAL, of the first value that could not be read.
  absl::Status status() const;
  // What was made of the rows, if all that was read of them could be.
  template <typename T>
  absl::StatusOr<T> Checked(T made) const {
    if (absl::Status read = status(); !read.ok()) return read;
    return made;
  }

 private:
  struct State;
  bool Has(int row, int column) const;
  std::optional<std::string_view> Value(int row, int column, const char* wanted) const;
  void Unreadable(int row, int column, std::string_view found, const char* wanted) const;
  template <typename T, typename Parse>
  T Parsed(int row, int column, const char* wanted, Parse parse, T otherwise) const;
  std::shared_ptr<State> state_;
};

class Database;
class Session;

// Not committed = rolled back. Not thread-safe; one thread at a time.
class Transaction {
 public:
  Transaction(Transaction&&) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();
  // One statement. Ends at Begin's deadline even when the server is frozen or unreachable.
  absl::StatusOr<Rows> Execute(std::string_view sql, const Params& params = {});
  // The same with every column of the result in its binary form: for bytea, of which the text form is twice as long. Rows::Bytes
  // is the only way to read it.
  absl::StatusOr<Rows> ExecuteBinary(std::string_view sql, const Params& params = {});
  // As Begin was told.
  Deadline deadline() const { return deadline_; }
  // After a failed Commit nothing may be acknowledged: where the connection broke, the outcome is not known.
  absl::Status Commit();

 private:
  friend class Database;
  Transaction(Database* database, std::unique_ptr<Session> session, Deadline deadline);
  absl::StatusOr<Rows> Run(std::string_view sql, const Params& params, int result_format);
  Database* database_;
  std::unique_ptr<Session> session_;  // none: it has ended
  Deadline deadline_;
};

// The database's clock: the one by which validity and sessions count, whatever the clocks of the services say.
absl::StatusOr<Instant> NowOf(Transaction& transaction);

// Thread-safe.
class Database {
 public:
  // Connects lazily: a server that is still starting is not an error here.
  static std::unique_ptr<Database> Open(std::string conninfo, int pool_size);
  ~Database();
  // Waits for a free connection until the deadline, then RESOURCE_EXHAUSTED; statement_timeout is set from it. The server hears of
  // the transaction with its first statement.
  absl::StatusOr<Transaction> Begin(Deadline deadline);
  // Schema version as the migration runner left it, 0 where it never ran; used by readiness.
  absl::StatusOr<int> SchemaVersion(Deadline deadline);
  struct Use {
    int size = 0, in_use = 0;          // connections: at most, and now
    std::optional<Deadline> answered;  // when the server last answered, refusals too; none: never yet
  };
  Use use() const;
  // Told of each Begin how long it waited for a connection, and whether it got one. Once, before the first Begin.
  using OnWait = std::function<void(std::chrono::duration<double> waited, bool got_one)>;
  void Watch(OnWait on_wait);
  // FAILED_PRECONDITION names the setting by which the server may lose what it has committed.
  absl::Status RequireDurable(Deadline deadline);
  // FAILED_PRECONDITION names the role that we are, where it could change the record: a superuser, or a member of its owner.
  absl::Status RequireLeastRights(Deadline deadline);

 private:
  friend class Transaction;
  struct Pool;
  explicit Database(std::unique_ptr<Pool> pool);
  absl::StatusOr<std::unique_ptr<Session>> Connected(Deadline deadline);
  void DropIdle();
  // Null: a place becomes free, its session is gone.
  void Return(std::unique_ptr<Session> session);
  std::unique_ptr<Pool> pool_;
};

// A new UUIDv7 in text form: ids of results, ordered by time.
std::string NewUuid();
// Of any version, in lower case.
bool IsUuid(std::string_view text);

}  // namespace sixpoint::storage
