#include "services/ingest/store_keeper.h"

#include "services/runtime/log.h"
#include "services/runtime/server.h"
#include "storage/blob_check.h"
#include "storage/blob_collector.h"
#include "storage/months.h"
#include "storage/retention.h"
#include "storage/scan_uploads.h"

namespace sixpoint::ingest {
namespace {

using runtime::Log;
using runtime::LogLevel;

// A plant that has just started has other things to do.
constexpr std::chrono::seconds kFirstTidy{60};
constexpr std::chrono::seconds kPause{5};  // between looks at the clock
constexpr std::chrono::hours kLongestTidy{6};
constexpr std::chrono::minutes kAgain{1};
constexpr std::chrono::hours kBetweenMonths{6};  // looks whether there are enough ahead
// The check is left so often to keep its place and look for other work.
constexpr std::chrono::seconds kCheckSlice{30};
constexpr std::chrono::seconds kPatience{30};
constexpr char kRequestedBy[] = "services/ingest";

storage::Deadline In(std::chrono::seconds patience) { return std::chrono::steady_clock::now() + patience; }

void LogFailure(const char* what, const absl::Status& status) {
  if (!status.ok()) Log(LogLevel::kWarning, std::string(what) + ": " + std::string(status.message()));
}

}  // namespace

StoreKeeper::StoreKeeper(const StoreKeeperOptions& options, const std::string& conninfo,
                         std::shared_ptr<storage::BlobStore> store)
    : options_(options),
      database_(storage::Database::Open(conninfo, 1)),
      store_(std::move(store)),
      next_tidy_(std::chrono::steady_clock::now() + std::min<std::chrono::seconds>(kFirstTidy, options.every)),
      thread_([this] { Run(); }) {}

StoreKeeper::~StoreKeeper() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  thread_.join();
}

bool StoreKeeper::KeepGoing() {
  std::lock_guard lock(mutex_);
  return !stopping_;
}

// The schema may still be on its way while the plant starts.
bool StoreKeeper::Ready() {
  const absl::StatusOr<int> version = database_->SchemaVersion(In(std::chrono::seconds(5)));
  return version.ok() && *version >= runtime::NewestMigration();
}

void StoreKeeper::Run() {
  while (KeepGoing()) {
    if (Ready()) {
      if (std::chrono::steady_clock::now() >= next_months_) KeepMonths();
      if (options_.every.count() > 0 && std::chrono::steady_clock::now() >= next_tidy_) {
        Tidy();
        next_tidy_ = std::chrono::steady_clock::now() + options_.every;
      }
      if (options_.check_rate_mb_s > 0) CheckSome();
    }
    std::unique_lock lock(mutex_);
    stopped_.wait_for(lock, std::min<std::chrono::seconds>(kPause, std::max(options_.every, std::chrono::seconds(1))),
                      [this] { return stopping_; });
  }
}

void StoreKeeper::KeepMonths() {
  next_months_ = std::chrono::steady_clock::now() + kAgain;  // where the database is away, or a writer in the way
  const absl::StatusOr<int> made = storage::MakeMonths(*database_, storage::kMonthsAhead, In(kPatience));
  LogFailure("months ahead", made.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(In(kPatience));
  if (!transaction.ok()) return LogFailure("old requests", transaction.status());
  const absl::StatusOr<int> forgotten = storage::ForgetRequests(*transaction);
  const absl::Status kept = forgotten.ok() ? transaction->Commit() : forgotten.status();
  LogFailure("old requests", kept);
  if (!made.ok() || !kept.ok()) return;
  next_months_ = std::chrono::steady_clock::now() + kBetweenMonths;
  if (*made + *forgotten > 0)
    Log(LogLevel::kInfo, "kept by months",
        {{"made", static_cast<long>(*made)}, {"forgotten", static_cast<long>(*forgotten)}});
}

void StoreKeeper::Tidy() {
  storage::RetentionOptions retention;
  retention.software_version = runtime::SoftwareVersion();
  retention.requested_by = kRequestedBy;
  retention.keep_going = [this] { return KeepGoing(); };
  const auto applied = storage::ApplyRetention(database_.get(), store_->objects(), retention, In(kLongestTidy));
  LogFailure("retention", applied.status());
  if (applied.ok() && applied->scan_count > 0) {
    Log(LogLevel::kInfo, "retention: points deleted",
        {{"scans", static_cast<long>(applied->scan_count)}, {"freed_bytes", static_cast<long>(applied->freed_bytes)}});
  }
  LogFailure("unfinished uploads", ForgetUnfinished());
  LogFailure("use of the store", AddUpUse());
  storage::CollectOptions collection;
  collection.grace = collection.object_grace = options_.grace;
  // Which part is told by the clock: all in their turn, also where the service is restarted each day.
  collection.part =
      static_cast<int>(std::chrono::system_clock::now().time_since_epoch() / options_.every % storage::kCollectParts);
  collection.keep_going = retention.keep_going;
  const auto collected = storage::CollectGarbage(database_.get(), store_->objects(), collection, In(kLongestTidy));
  LogFailure("collection", collected.status());
  if (collected.ok() && collected->blob_count + collected->object_count > 0) {
    Log(LogLevel::kInfo, "collected what nothing refers to",
        {{"blobs", static_cast<long>(collected->blob_count)},
         {"blob_bytes", static_cast<long>(collected->blob_bytes)},
         {"objects", static_cast<long>(collected->object_count)}});
  }
}

// Before the collection, which takes the bytes that only they referred to.
absl::Status StoreKeeper::ForgetUnfinished() {
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(In(kPatience));
  if (!transaction.ok()) return transaction.status();
  const absl::StatusOr<int> forgotten =
      storage::ForgetUploads(*transaction, std::chrono::system_clock::now() - options_.unfinished_upload_patience);
  if (!forgotten.ok()) return forgotten.status();
  if (*forgotten > 0) {
    Log(LogLevel::kWarning, "forgot uploads that nobody went on with", {{"uploads", static_cast<long>(*forgotten)}});
  }
  return transaction->Commit();
}

absl::Status StoreKeeper::AddUpUse() {
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(In(kPatience));
  if (!transaction.ok()) return transaction.status();
  if (absl::Status added = storage::AddUpStoreUse(*transaction); !added.ok()) return added;
  return transaction->Commit();
}

void StoreKeeper::CheckSome() {
  storage::CheckState state;
  {
    absl::StatusOr<storage::Transaction> transaction = database_->Begin(In(kPatience));
    if (!transaction.ok()) return LogFailure("check of the store", transaction.status());
    const absl::StatusOr<storage::CheckState> read = storage::ReadCheckState(*transaction);
    if (!read.ok()) return LogFailure("check of the store", read.status());
    state = *read;
  }
  const bool between = state.progress.after_sha256.empty() && state.finished_at &&
                       std::chrono::system_clock::now() < *state.finished_at + options_.between_checks;
  if (between) return;
  const auto until = std::chrono::steady_clock::now() + kCheckSlice;
  bool left = false;
  storage::CheckOptions check;
  check.rate_mb_s = options_.check_rate_mb_s;
  check.keep_going = [&] { return !(left = left || !KeepGoing() || std::chrono::steady_clock::now() > until); };
  check.on_progress = [&](const storage::CheckProgress& progress) { state.progress = progress; };
  check.on_damage = [](const storage::BlobDamage& damage) {
    Log(LogLevel::kError, "damaged blob",
        {{"sha256", damage.sha256}, {"store", damage.store}, {"what", damage.what}, {"detail", damage.detail}});
  };
  const absl::Status checked =
      storage::CheckBlobs(database_.get(), store_->objects(), check, state.progress, In(kCheckSlice + kPatience));
  LogFailure("check of the store", checked);
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(In(kPatience));
  if (!transaction.ok()) return LogFailure("check of the store", transaction.status());
  absl::Status kept = checked.ok() && !left ? storage::KeepCheckFinished(*transaction)
                                            : storage::KeepCheckProgress(*transaction, state.progress);
  if (kept.ok()) kept = transaction->Commit();
  LogFailure("check of the store", kept);
}

}  // namespace sixpoint::ingest
