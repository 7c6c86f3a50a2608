#include "services/plant/ledger_sealer.h"

#include <absl/status/status.h>

#include <ctime>
#include <utility>

#include "services/runtime/log.h"
#include "services/runtime/server.h"
#include "storage/ledger.h"

namespace sixpoint::plant {
namespace {

using runtime::Log;
using runtime::LogLevel;

constexpr std::int64_t kBatch = 1000;  // entries of a transaction
constexpr std::chrono::seconds kSealPatience{30};

storage::Deadline Soon() { return std::chrono::steady_clock::now() + kSealPatience; }

std::string NowText() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  char text[32] = "";
  if (gmtime_r(&now, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

// Work in a transaction of the ledger's.
template <typename Work>
absl::Status InLedger(storage::Database& database, const Work& work) {
  absl::StatusOr<storage::Transaction> transaction = database.Begin(Soon());
  if (!transaction.ok()) return transaction.status();
  absl::Status done = storage::BeginLedger(*transaction);
  if (done.ok()) done = work(*transaction);
  return done.ok() ? transaction->Commit() : done;
}

}  // namespace

LedgerSealer::LedgerSealer(LedgerSealerOptions options, const std::string& conninfo,
                           std::optional<ledger::SigningKey> key)
    : options_(std::move(options)), database_(storage::Database::Open(conninfo, 1)), key_(std::move(key)) {
  if (options_.every.count() > 0) thread_ = std::thread([this] { Run(); });
}

LedgerSealer::~LedgerSealer() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool LedgerSealer::KeepGoing() {
  std::lock_guard lock(mutex_);
  return !stopping_;
}

// A newer schema may keep rows of an entry where this release does not look: the new one seals them.
bool LedgerSealer::Ready() {
  const absl::StatusOr<int> version = database_->SchemaVersion(Soon());
  return version.ok() && *version == runtime::NewestMigration();
}

void LedgerSealer::Run() {
  while (KeepGoing()) {
    if (Ready()) {
      absl::Status done = SealAll();
      if (done.ok() && key_ && std::chrono::steady_clock::now() >= next_head_) {
        done = SignHead();
        next_head_ = std::chrono::steady_clock::now() + options_.head_every;
      }
      // Once, not every few seconds: it does not go away by itself.
      const std::string failure = done.ok() || absl::IsNotFound(done) ? "" : std::string(done.message());
      if (failure != last_failure_ && !failure.empty()) Log(LogLevel::kError, "ledger: " + failure);
      last_failure_ = failure;
    }
    std::unique_lock lock(mutex_);
    stopped_.wait_for(lock, options_.every, [this] { return stopping_; });
  }
}

absl::Status LedgerSealer::SealAll() {
  for (bool more = true; more && KeepGoing();) {
    const absl::Status sealed = InLedger(*database_, [&](storage::Transaction& transaction) {
      const absl::StatusOr<storage::Sealed> some = storage::SealEntries(transaction, kBatch);
      more = some.ok() && some->more;
      return some.status();
    });
    if (!sealed.ok()) return sealed;
  }
  return absl::OkStatus();
}

// The tree must begin as it did when the last head was sent out.
absl::Status LedgerSealer::CheckAgainst(storage::Transaction& transaction, const ledger::Head& last,
                                        std::int64_t size) {
  if (last.tree_size == 0) return absl::OkStatus();
  const std::string sent =
      "the head of " + std::to_string(last.tree_size) + " entries that was sent out at " + last.signed_at;
  if (size < last.tree_size)
    return absl::FailedPreconditionError("the database holds " + std::to_string(size) + " leaves, want those of " +
                                         sent + ": entries were cut off, or the database was set back");
  const absl::StatusOr<ledger::Hash> root = storage::RootOf(transaction, {0, last.tree_size});
  if (!root.ok()) return root.status();
  if (*root == last.root) return absl::OkStatus();
  return absl::FailedPreconditionError("the leaves have another root than " + sent + ": they were rewritten");
}

absl::Status LedgerSealer::SignHead() {
  if (!key_) return absl::NotFoundError("no key, want --ledger-key");
  storage::KeptHead kept;
  bool is_new = false;
  const absl::Status told = InLedger(*database_, [&](storage::Transaction& transaction) -> absl::Status {
    const absl::StatusOr<storage::LedgerEnd> end = storage::ReadLedgerEnd(transaction);
    if (!end.ok()) return end.status();
    absl::StatusOr<ledger::Head> last = ledger::Head();
    if (!options_.heads_file.empty()) last = ledger::LastHead(options_.heads_file);
    if (!last.ok()) return last.status();
    if (absl::Status agrees = CheckAgainst(transaction, *last, end->size); !agrees.ok()) return agrees;
    const absl::StatusOr<std::optional<storage::KeptHead>> newest = storage::NewestHead(transaction);
    if (!newest.ok()) return newest.status();
    // Where heads are sent out, those tell what is new: what the database says of it may be anything.
    const std::int64_t kept_size = newest->has_value() ? (*newest)->head.tree_size : 0;
    is_new = end->size > (options_.heads_file.empty() ? kept_size : last->tree_size);
    if (!is_new && last->tree_size > kept_size) return storage::KeepHead(transaction, {*last, key_->public_pem()});
    if (!is_new) return absl::OkStatus();
    const absl::StatusOr<ledger::Hash> root = storage::RootOf(transaction, {0, end->size});
    if (!root.ok()) return root.status();
    const absl::StatusOr<std::string> plant = storage::PlantId(transaction);
    if (!plant.ok()) return plant.status();
    kept.head.plant_id = *plant;
    kept.head.tree_size = end->size;
    kept.head.root = *root;
    kept.head.record_sequence = end->record_sequence;
    return absl::OkStatus();
  });
  if (!told.ok() || !is_new) return told;
  kept.head.signed_at = NowText();
  absl::StatusOr<ledger::Head> signed_head = key_->Sign(kept.head);
  if (!signed_head.ok()) return signed_head.status();
  kept.head = *std::move(signed_head);
  kept.public_key = key_->public_pem();
  // Out first: what the database keeps is only what was sent.
  if (!options_.heads_file.empty())
    if (absl::Status sent = ledger::AppendHead(options_.heads_file, kept.head); !sent.ok()) return sent;
  return InLedger(*database_, [&](storage::Transaction& transaction) { return storage::KeepHead(transaction, kept); });
}

}  // namespace sixpoint::plant
