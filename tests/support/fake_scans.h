// A ScanStore and a RetentionStore in memory, about the same scans: what ingest's handlers are tested on without PostgreSQL. Held
// to the real ones by tests/storage/scan_store_test.cc.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "storage/retention_store.h"
#include "storage/scan_store.h"
#include "tests/support/fake_clearances.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

class FakeScans final : public storage::ScanStore, public storage::RetentionStore {
 public:
  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure);
  std::vector<storage::JournalEntry> entries() const;

  absl::StatusOr<std::optional<storage::ScanRow>> Find(const std::string& scan_id, storage::Deadline) const override;
  // A filter's part matches none: blades are the plant's.
  absl::StatusOr<std::vector<storage::ScanRow>> List(const storage::ScanFilter& filter, std::int64_t before_sequence,
                                                     int limit, storage::Deadline) const override;
  absl::Status RequirePoints(const std::string& scan_id, storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::ScanBlockRow>> Blocks(const std::string& scan_id,
                                                            storage::Deadline) const override;
  absl::StatusOr<std::optional<std::string>> BlobOf(const std::string& scan_id, const std::string& blob_sha256,
                                                    storage::Deadline deadline) const override;
  absl::StatusOr<std::string> Payload(const std::string& blob_sha256, storage::Deadline) const override;

  FakeClearances clearances;
  absl::StatusOr<std::optional<std::string>> FirstHidden(const storage::Reader& reader,
                                                         const std::vector<std::string>& names,
                                                         storage::Unrecorded unrecorded,
                                                         storage::Deadline deadline) const override {
    return clearances.FirstHidden(reader, names, unrecorded, deadline);
  }

  absl::StatusOr<storage::KnownScan> Join(
      const storage::ScanUploadRow& upload,
      const std::function<absl::StatusOr<bool>(const storage::ScanUploadRow& known)>& goes_on,
      storage::Deadline) override;
  absl::StatusOr<bool> AddBlock(const storage::ScanUploadRow& after, storage::ScanBlockRow block,
                                std::string_view payload, std::string_view evidence, storage::Deadline) override;
  absl::StatusOr<std::vector<storage::ScanBlockRow>> UploadedBlocks(const std::string& scan_id,
                                                                    storage::Deadline) const override;
  absl::StatusOr<std::optional<storage::CompletedScan>> Complete(
      const std::string& scan_id,
      const std::function<absl::StatusOr<storage::MadeScan>(const storage::ScanUploadRow&,
                                                            const std::vector<storage::ScanBlockRow>&)>& make,
      storage::Deadline) override;

  absl::StatusOr<std::optional<storage::ScanDeletion>> FindDeletion(const std::string& scan_id,
                                                                    storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::RetentionPolicy>> ListPolicies(const storage::PolicyPage& page,
                                                                     storage::Deadline) const override;
  absl::StatusOr<storage::DeletedPoints> DeletePoints(const storage::DeletionOrder& order, storage::Deadline) override;
  absl::StatusOr<std::optional<storage::RetentionPolicy>> FindRecorded(const storage::RecordedRequest& request,
                                                                       storage::Deadline) const override;
  absl::StatusOr<storage::RetentionPolicy> Record(const storage::RecordedRequest& request,
                                                  storage::RetentionPolicy policy, const storage::RecordEntry& entry,
                                                  storage::Deadline) override;
  absl::StatusOr<storage::RetentionDone> Apply(const storage::RetentionOptions& options, storage::Deadline) override;

 private:
  struct Stored {
    storage::ScanRow row;
    std::vector<storage::ScanBlockRow> blocks;
  };
  struct Upload {
    storage::ScanUploadRow row;
    std::vector<storage::ScanBlockRow> blocks;
  };
  const Stored* Known(const std::string& scan_id) const;
  std::optional<storage::RetentionPolicy> Policy(const std::string& name) const;
  // Whether a scan whose points are kept, or an upload, has the blob.
  bool IsNeeded(const std::string& blob_sha256) const;
  absl::StatusOr<storage::DeletedPoints> Delete(const storage::DeletionOrder& order);

  FakeRecord record_;
  std::vector<Stored> scans_;  // as recorded
  std::map<std::string, Upload> uploads_;
  std::map<std::string, std::string> payloads_;  // by digest
  std::set<std::string> deleted_payloads_;
  std::map<std::string, storage::ScanDeletion> deletions_;
  std::map<std::string, std::vector<storage::RetentionPolicy>> policies_;  // by kind, from the first revision
};

// Finds nothing to do, or what is set here.
struct FakeBlobKeeping final : storage::BlobKeeping {
  std::vector<storage::BlobDamage> damages;  // that every check finds
  std::function<void()> during_check;        // where one takes its time
  storage::Collected collected;
  storage::BlobStatus status;
  std::vector<storage::MonthUse> months;
  std::string owner;  // of the bucket
  absl::Status failure;

  absl::Status Check(const storage::CheckOptions& options, const storage::CheckProgress& from,
                     storage::Deadline) override;
  absl::StatusOr<storage::Collected> Collect(const storage::CollectOptions&, storage::Deadline) override;
  absl::StatusOr<storage::BlobStatus> Status(int damage_limit, storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::MonthUse>> Months(storage::Deadline) const override;
  absl::StatusOr<int> MakeMonths(int months_ahead, storage::Deadline) override;
  absl::StatusOr<std::string> AdoptBucket(storage::Deadline) override;
};

}  // namespace sixpoint::testing
