#include "storage/scan_store.h"

#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "storage/one_read.h"
#include "storage/retention.h"

namespace sixpoint::storage {
namespace {

class PostgresScans final : public ScanStore {
 public:
  PostgresScans(Database* database, BlobStore* blobs) : database_(database), blobs_(blobs) {}

  absl::StatusOr<std::optional<ScanRow>> Find(const std::string& scan_id, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindScan(t, scan_id); });
  }
  absl::StatusOr<std::vector<ScanRow>> List(const ScanFilter& filter, std::int64_t before_sequence, int limit,
                                            Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ListScans(t, filter, before_sequence, limit); });
  }
  absl::Status RequirePoints(const std::string& scan_id, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::RequirePoints(t, scan_id); });
  }
  absl::StatusOr<std::vector<ScanBlockRow>> Blocks(const std::string& scan_id, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return BlocksOfScan(t, scan_id); });
  }
  absl::StatusOr<std::optional<std::string>> BlobOf(const std::string& scan_id, const std::string& blob_sha256,
                                                    Deadline deadline) const override {
    bool is_its = true;
    absl::StatusOr<std::string> bytes =
        blobs_->Get(*database_, blob_sha256, deadline, [&](Transaction& t) -> absl::Status {
          const absl::StatusOr<std::optional<std::string>> key = KeyOf(t, scan_id);
          if (!key.ok()) return key.status();
          const absl::StatusOr<bool> has =
              key->has_value() ? ScanHasBlob(t, **key, blob_sha256) : absl::StatusOr<bool>(false);
          if (!has.ok()) return has.status();
          if (*has) return absl::OkStatus();
          if (absl::Status kept = storage::RequirePoints(t, scan_id); !kept.ok()) return kept;
          is_its = false;
          return absl::NotFoundError("another scan's, or none");
        });
    if (!is_its) return std::nullopt;
    if (!bytes.ok()) return bytes.status();
    return *std::move(bytes);
  }
  absl::StatusOr<std::string> Payload(const std::string& blob_sha256, Deadline deadline) const override {
    return blobs_->Get(*database_, blob_sha256, deadline);
  }

  absl::StatusOr<std::optional<std::string>> FirstHidden(const Reader& reader, const std::vector<std::string>& names,
                                                         Unrecorded unrecorded, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return storage::FirstHidden(t, reader, names, unrecorded); });
  }

  absl::StatusOr<KnownScan> Join(const ScanUploadRow& upload,
                                 const std::function<absl::StatusOr<bool>(const ScanUploadRow& known)>& goes_on,
                                 Deadline deadline) override {
    absl::StatusOr<Transaction> transaction = database_->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    KnownScan known;
    if (absl::Status locked = LockScanId(*transaction, upload.scan_id); !locked.ok()) return locked;
    absl::StatusOr<std::optional<ScanRow>> stored = FindScan(*transaction, upload.scan_id);
    if (!stored.ok()) return stored.status();
    known.complete = *std::move(stored);
    if (known.complete) return known;
    absl::StatusOr<std::optional<ScanUploadRow>> begun = FindUpload(*transaction, upload.scan_id);
    if (!begun.ok()) return begun.status();
    if (begun->has_value()) {
      const absl::StatusOr<bool> same = goes_on(**begun);
      if (!same.ok()) return same.status();
      known.upload = **std::move(begun);
      if (*same) return known;
      if (absl::Status ended = EndUpload(*transaction, upload.scan_id); !ended.ok()) return ended;
    }
    known.upload = Begun(upload);
    absl::Status status = BeginUpload(*transaction, upload);
    if (status.ok()) status = transaction->Commit();
    if (!status.ok()) return status;
    return known;
  }

  absl::StatusOr<bool> AddBlock(const ScanUploadRow& after, ScanBlockRow block, std::string_view payload,
                                std::string_view evidence, Deadline deadline) override {
    std::vector<StagedBlob> staged;
    for (const std::string_view bytes : {payload, evidence}) {
      if (bytes.empty()) continue;
      absl::StatusOr<StagedBlob> blob = blobs_->Stage(*database_, bytes, deadline);
      if (!blob.ok()) return blob.status();
      staged.push_back(*std::move(blob));
    }
    absl::StatusOr<Transaction> transaction = database_->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    for (const StagedBlob& blob : staged)
      if (absl::Status put = blobs_->Put(*transaction, blob); !put.ok()) return put;
    block.blob_sha256 = staged.front().sha256;
    if (!evidence.empty()) block.evidence_sha256 = staged.back().sha256;
    const absl::StatusOr<bool> added = AddUploadBlock(*transaction, after, block);
    if (!added.ok() || !*added) return added;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return true;
  }
  absl::StatusOr<std::vector<ScanBlockRow>> UploadedBlocks(const std::string& scan_id,
                                                           Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return BlocksOfUpload(t, scan_id); });
  }

  absl::StatusOr<std::optional<CompletedScan>> Complete(
      const std::string& scan_id,
      const std::function<absl::StatusOr<MadeScan>(const ScanUploadRow&, const std::vector<ScanBlockRow>&)>& make,
      Deadline deadline) override {
    absl::StatusOr<Transaction> transaction = database_->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    if (absl::Status locked = LockScanId(*transaction, scan_id); !locked.ok()) return locked;
    absl::StatusOr<std::optional<ScanRow>> stored = FindScan(*transaction, scan_id);
    if (!stored.ok()) return stored.status();
    if (stored->has_value()) return CompletedScan{**std::move(stored), true};
    const absl::StatusOr<std::optional<ScanUploadRow>> upload = FindUpload(*transaction, scan_id);
    if (!upload.ok()) return upload.status();
    if (!upload->has_value()) return std::nullopt;
    const absl::StatusOr<std::vector<ScanBlockRow>> blocks = BlocksOfUpload(*transaction, scan_id);
    if (!blocks.ok()) return blocks.status();
    absl::StatusOr<MadeScan> made = make(**upload, *blocks);
    if (!made.ok()) return made.status();
    if (absl::Status ended = EndUpload(*transaction, scan_id); !ended.ok()) return ended;
    const absl::StatusOr<Recorded> recorded = InsertScan(*transaction, made->row, *blocks, made->entry);
    if (!recorded.ok()) return recorded.status();
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    made->row.recorded = *recorded;
    return CompletedScan{std::move(made->row), false};
  }

 private:
  // Asked for with every blob of a scan: of the last thousands it is known.
  absl::StatusOr<std::optional<std::string>> KeyOf(Transaction& t, const std::string& scan_id) const {
    {
      const std::lock_guard<std::mutex> lock(keys_mutex_);
      if (const auto found = keys_.find(scan_id); found != keys_.end()) return found->second;
    }
    absl::StatusOr<std::optional<std::string>> key = ScanKeyOf(t, scan_id);
    if (!key.ok() || !key->has_value()) return key;
    const std::lock_guard<std::mutex> lock(keys_mutex_);
    if (keys_.size() >= kMostKeys) keys_.clear();
    keys_.emplace(scan_id, **key);
    return key;
  }
  static constexpr std::size_t kMostKeys = 4096;

  Database* const database_;
  BlobStore* const blobs_;
  mutable std::mutex keys_mutex_;
  mutable std::map<std::string, std::string> keys_;  // by scan_id
};

}  // namespace

ScanUploadRow Begun(const ScanUploadRow& upload) {
  ScanUploadRow begun;
  begun.scan_id = upload.scan_id;
  begun.header = upload.header;
  begun.machine_revision = upload.machine_revision;
  begun.artefact_revision = upload.artefact_revision;
  return begun;
}

std::shared_ptr<ScanStore> ScansIn(Database* database, BlobStore* blobs) {
  return std::make_shared<PostgresScans>(database, blobs);
}

}  // namespace sixpoint::storage
