#include "services/plant/ledger_sealer.h"

#include <absl/status/status.h>

#include <ctime>
#include <utility>

#include "services/runtime/log.h"
#include "services/runtime/server.h"

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

}  // namespace

LedgerSealer::LedgerSealer(LedgerSealerOptions options, std::shared_ptr<storage::LedgerStore> ledger,
                           std::optional<ledger::SigningKey> key)
    : options_(std::move(options)), ledger_(std::move(ledger)), key_(std::move(key)) {
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
  const absl::StatusOr<int> version = ledger_->SchemaVersion(Soon());
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
    const absl::StatusOr<storage::Sealed> some = ledger_->Seal(kBatch, Soon());
    if (!some.ok()) return some.status();
    more = some->more;
  }
  return absl::OkStatus();
}

// The tree must begin as it did when the last head was sent out.
absl::Status LedgerSealer::CheckAgainst(const ledger::Head& last, std::int64_t size, storage::Deadline deadline) {
  if (last.tree_size == 0) return absl::OkStatus();
  const std::string sent =
      "the head of " + std::to_string(last.tree_size) + " entries that was sent out at " + last.signed_at;
  if (size < last.tree_size)
    return absl::FailedPreconditionError("the database holds " + std::to_string(size) + " leaves, want those of " +
                                         sent + ": entries were cut off, or the database was set back");
  const absl::StatusOr<ledger::Hash> root = ledger_->Root(last.tree_size, deadline);
  if (!root.ok()) return root.status();
  if (*root == last.root) return absl::OkStatus();
  return absl::FailedPreconditionError("the leaves have another root than " + sent + ": they were rewritten");
}

absl::Status LedgerSealer::SignHead() {
  if (!key_) return absl::NotFoundError("no key, want --ledger-key");
  const storage::Deadline deadline = Soon();  // of all of it: who ends the process waits once
  const absl::StatusOr<storage::LedgerEnd> end = ledger_->End(deadline);
  if (!end.ok()) return end.status();
  absl::StatusOr<ledger::Head> last = ledger::Head();
  if (!options_.heads_file.empty()) last = ledger::LastHead(options_.heads_file);
  if (!last.ok()) return last.status();
  if (absl::Status agrees = CheckAgainst(*last, end->size, deadline); !agrees.ok()) return agrees;
  const absl::StatusOr<std::optional<storage::KeptHead>> newest = ledger_->NewestHead(deadline);
  if (!newest.ok()) return newest.status();
  // Where heads are sent out, those tell what is new: what the database says of it may be anything.
  const std::int64_t kept_size = newest->has_value() ? (*newest)->head.tree_size : 0;
  const bool is_new = end->size > (options_.heads_file.empty() ? kept_size : last->tree_size);
  if (!is_new && last->tree_size > kept_size) return ledger_->KeepHead({*last, key_->public_pem()}, deadline);
  if (!is_new) return absl::OkStatus();
  const absl::StatusOr<ledger::Hash> root = ledger_->Root(end->size, deadline);
  if (!root.ok()) return root.status();
  const absl::StatusOr<std::string> plant = ledger_->PlantId(deadline);
  if (!plant.ok()) return plant.status();
  ledger::Head head;
  head.plant_id = *plant;
  head.tree_size = end->size;
  head.root = *root;
  head.record_sequence = end->record_sequence;
  head.signed_at = NowText();
  const absl::StatusOr<ledger::Head> signed_head = key_->Sign(std::move(head));
  if (!signed_head.ok()) return signed_head.status();
  // Out first: what the database keeps is only what was sent.
  if (!options_.heads_file.empty())
    if (absl::Status sent = ledger::AppendHead(options_.heads_file, *signed_head); !sent.ok()) return sent;
  return ledger_->KeepHead({*signed_head, key_->public_pem()}, deadline);
}

}  // namespace sixpoint::plant
