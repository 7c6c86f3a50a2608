#include "storage/database.h"

#include <absl/strings/cord.h>
#include <openssl/rand.h>

#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "storage/session.h"

namespace sixpoint::storage {
namespace {

// statement_timeout may not be beyond its type.
constexpr std::int64_t kLongestTimeout_ms = 24 * 3600 * 1000;

absl::Status DeadlineOver() { return absl::DeadlineExceededError("database: the deadline is over"); }

std::int64_t MillisecondsUntil(Deadline deadline) {
  const Deadline now = std::chrono::steady_clock::now();
  if (deadline <= now) return 0;
  // Deadline::max() less now would overflow in nothing here, but its milliseconds are beyond the server's type.
  return std::min<std::int64_t>(std::chrono::ceil<std::chrono::milliseconds>(deadline - now).count(),
                                kLongestTimeout_ms);
}

// Leaves room for the grace of a wait: a deadline of "never" must not overflow when it is added to.
Deadline Bounded(Deadline deadline) {
  return std::min(deadline, std::chrono::steady_clock::now() + std::chrono::milliseconds(kLongestTimeout_ms));
}

}  // namespace

absl::Status WithReason(absl::Status status, const char* reason) {
  status.SetPayload(kReasonPayload, absl::Cord(reason));
  return status;
}

struct Database::Pool {
  std::string conninfo;
  int size = 0;
  std::mutex mutex;
  std::condition_variable freed;
  std::vector<std::unique_ptr<Session>> idle;
  int in_use_count = 0;  // handed out, or being connected
  std::optional<Deadline> answered;
  OnWait on_wait;
  void NoteAnswer(const Session& session);
};

// After a question: a session that still waits, or broke, heard nothing.
void Database::Pool::NoteAnswer(const Session& session) {
  if (!session.IsUsable()) return;
  const std::lock_guard lock(mutex);
  answered = std::chrono::steady_clock::now();
}

std::unique_ptr<Database> Database::Open(std::string conninfo, int pool_size) {
  auto pool = std::make_unique<Pool>();
  pool->conninfo = std::move(conninfo);
  pool->size = std::max(1, pool_size);
  return std::unique_ptr<Database>(new Database(std::move(pool)));
}

Database::Database(std::unique_ptr<Pool> pool) : pool_(std::move(pool)) {}
Database::~Database() = default;

absl::StatusOr<Transaction> Database::Begin(Deadline deadline) {
  deadline = Bounded(deadline);
  std::unique_ptr<Session> session;
  const Deadline asked = std::chrono::steady_clock::now();
  {
    std::unique_lock lock(pool_->mutex);
    const bool got_one = pool_->freed.wait_until(lock, deadline, [this] { return pool_->in_use_count < pool_->size; });
    if (pool_->on_wait) pool_->on_wait(std::chrono::steady_clock::now() - asked, got_one);
    if (!got_one) {
      return absl::ResourceExhaustedError("database: all " + std::to_string(pool_->size) +
                                          " connections are in use, want a free one before the deadline");
    }
    ++pool_->in_use_count;
    if (!pool_->idle.empty()) {
      session = std::move(pool_->idle.back());
      pool_->idle.pop_back();
    }
  }
  absl::Status failure;
  if (MillisecondsUntil(deadline) == 0) {
    failure = DeadlineOver();
  } else if (session == nullptr) {
    absl::StatusOr<std::unique_ptr<Session>> fresh = Connected(deadline);
    failure = fresh.status();
    if (fresh.ok()) session = *std::move(fresh);
  }
  if (failure.ok()) return Transaction(this, std::move(session), deadline);
  Return(std::move(session));
  return failure;
}

absl::StatusOr<std::unique_ptr<Session>> Database::Connected(Deadline deadline) {
  absl::StatusOr<std::unique_ptr<Session>> fresh = Session::Open(pool_->conninfo, deadline);
  if (fresh.ok()) pool_->NoteAnswer(**fresh);
  return fresh;
}

Database::Use Database::use() const {
  const std::lock_guard lock(pool_->mutex);
  return {pool_->size, pool_->in_use_count, pool_->answered};
}

void Database::Watch(OnWait on_wait) {
  const std::lock_guard lock(pool_->mutex);
  pool_->on_wait = std::move(on_wait);
}

void Database::DropIdle() {
  std::vector<std::unique_ptr<Session>> stale;  // closed without the lock
  const std::lock_guard lock(pool_->mutex);
  stale.swap(pool_->idle);
}

void Database::Return(std::unique_ptr<Session> session) {
  const bool is_kept = session != nullptr && session->Abandon();
  {
    std::lock_guard lock(pool_->mutex);
    --pool_->in_use_count;
    if (is_kept) pool_->idle.push_back(std::move(session));
  }
  pool_->freed.notify_one();
}

absl::StatusOr<int> Database::SchemaVersion(Deadline deadline) {
  absl::StatusOr<Transaction> transaction = Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> known = transaction->Execute("SELECT to_regclass('schema_migrations') IS NOT NULL");
  if (!known.ok()) return known.status();
  const bool migrated = known->Bool(0, 0);
  if (absl::Status read = known->status(); !read.ok()) return read;
  if (!migrated) return 0;
  const absl::StatusOr<Rows> rows = transaction->Execute("SELECT coalesce(max(version), 0) FROM schema_migrations");
  if (!rows.ok()) return rows.status();
  return rows->Checked(static_cast<int>(rows->Int(0, 0)));
}

absl::Status Database::RequireDurable(Deadline deadline) {
  absl::StatusOr<Transaction> transaction = Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> off = transaction->Execute(
      "SELECT name FROM pg_settings WHERE name IN ('fsync', 'full_page_writes', 'synchronous_commit') "
      "AND setting = 'off' ORDER BY name LIMIT 1");
  if (!off.ok()) return off.status();
  if (off->count() == 0) return off->status();
  return absl::FailedPreconditionError(off->Text(0, 0) + ": off, want on: a database that loses nothing it has kept");
}

absl::Status Database::RequireLeastRights(Deadline deadline) {
  absl::StatusOr<Transaction> transaction = Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<Rows> role = transaction->Execute(
      "SELECT current_user, r.rolsuper, pg_has_role(current_user, c.relowner, 'MEMBER') FROM pg_roles r, pg_class c "
      "WHERE r.rolname = current_user AND c.oid = 'record_entries'::regclass");
  if (!role.ok()) return role.status();
  const std::string name = role->Text(0, 0);
  const bool superuser = role->Bool(0, 1), owner = role->Bool(0, 2);
  if (absl::Status read = role->status(); !read.ok()) return read;
  if (!superuser && !owner) return absl::OkStatus();
  return absl::FailedPreconditionError(
      "database role: " + name + (superuser ? ", a superuser" : ", owns the record") +
      ", want the service's own, sixpoint_plant for instance, which can change nothing");
}

Transaction::Transaction(Database* database, std::unique_ptr<Session> session, Deadline deadline)
    : database_(database), session_(std::move(session)), deadline_(deadline) {}

Transaction::Transaction(Transaction&&) noexcept = default;

Transaction::~Transaction() {
  if (session_ != nullptr) database_->Return(std::move(session_));
}

absl::StatusOr<Instant> NowOf(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute("SELECT clock_timestamp()");
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Time(0, 0));
}

absl::StatusOr<Rows> Transaction::Execute(std::string_view sql, const Params& params) { return Run(sql, params, 0); }

absl::StatusOr<Rows> Transaction::ExecuteBinary(std::string_view sql, const Params& params) {
  return Run(sql, params, 1);
}

absl::StatusOr<Rows> Transaction::Run(std::string_view sql, const Params& params, int result_format) {
  if (session_ == nullptr) return absl::FailedPreconditionError("database: the transaction has ended");
  if (MillisecondsUntil(deadline_) == 0) return DeadlineOver();
  WireParams wire;
  wire.result_format = result_format;
  for (const Params::Value& value : params.values_) {
    // A text parameter ends at its first NUL: storing the rest silently away is not an option.
    if (value.bytes && !value.binary && value.bytes->find('\0') != std::string::npos) {
      return absl::InvalidArgumentError("database: a text holds a NUL byte, want none");
    }
    wire.values.push_back(value.bytes ? value.bytes->data() : nullptr);
    wire.lengths.push_back(value.bytes ? static_cast<int>(value.bytes->size()) : 0);
    wire.formats.push_back(value.binary ? 1 : 0);
  }
  const std::string text(sql);
  const bool is_first = !session_->has_begun();
  absl::StatusOr<Result> result = session_->Run(text, wire, deadline_);
  // The server went away while this session was idle, so the others are stale too; the transaction, which did nothing yet, goes on
  // with a new one.
  if (is_first && absl::IsUnavailable(result.status()) && !session_->IsUsable() && MillisecondsUntil(deadline_) > 0) {
    database_->DropIdle();
    absl::StatusOr<std::unique_ptr<Session>> fresh = database_->Connected(deadline_);
    if (!fresh.ok()) return fresh.status();
    session_ = *std::move(fresh);
    result = session_->Run(text, wire, deadline_);
  }
  database_->pool_->NoteAnswer(*session_);
  if (!result.ok()) return result.status();
  return Rows(result->release());
}

absl::Status Transaction::Commit() {
  if (session_ == nullptr) return absl::FailedPreconditionError("database: the transaction has ended");
  if (MillisecondsUntil(deadline_) == 0) return DeadlineOver();
  absl::Status committed = session_->Commit(deadline_);
  database_->pool_->NoteAnswer(*session_);
  if (committed.ok()) database_->Return(std::move(session_));
  return committed;
}

bool IsUuid(std::string_view text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const char c = text[i];
    if (dash ? c != '-' : !((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'))) return false;
  }
  return true;
}

// RFC 9562 section 5.7; rand_a holds the fraction of the millisecond, so that ids made in turn sort in turn.
std::string NewUuid() {
  unsigned char bytes[16];
  if (RAND_bytes(bytes, sizeof bytes) != 1) std::abort();  // an id that is not random would collide silently
  const auto now_us =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const std::uint64_t now_ms = static_cast<std::uint64_t>(now_us) / 1000;
  for (int i = 0; i < 6; ++i) bytes[i] = static_cast<unsigned char>(now_ms >> (40 - 8 * i));
  const auto fraction = static_cast<unsigned>(now_us % 1000) * 4096 / 1000;
  bytes[6] = static_cast<unsigned char>(0x70 | fraction >> 8);
  bytes[7] = static_cast<unsigned char>(fraction);
  bytes[8] = static_cast<unsigned char>((bytes[8] & 0x3f) | 0x80);
  std::string text;
  for (int i = 0; i < 16; ++i) {
    char pair[3];
    std::snprintf(pair, sizeof pair, "%02x", bytes[i]);
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += pair;
  }
  return text;
}

}  // namespace sixpoint::storage
