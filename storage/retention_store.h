// What the keeping of clouds asks for, apart from where they are: how long points stay, and how the blobs fare. PostgreSQL's and
// the tests' fake of the first pass the same suite (tests/storage/scan_store_test.cc). Thread-safe. No call holds a connection
// after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/blob_check.h"
#include "storage/blob_collector.h"
#include "storage/blob_store.h"
#include "storage/months.h"
#include "storage/result_store.h"
#include "storage/retention.h"

namespace sixpoint::storage {

// As the functions of storage/retention.h.
class RetentionReader {
 public:
  virtual ~RetentionReader() = default;
  virtual absl::StatusOr<std::optional<ScanDeletion>> FindDeletion(const std::string& scan_id,
                                                                   Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<RetentionPolicy>> ListPolicies(const PolicyPage& page,
                                                                    Deadline deadline) const = 0;
};

// Record makes the next revision of a policy and fills in its number, and the entry's kind and name.
class RetentionStore : public RetentionReader, public ResultWriter<RetentionPolicy> {
 public:
  // NOT_FOUND: no such scan.
  virtual absl::StatusOr<DeletedPoints> DeletePoints(const DeletionOrder& order, Deadline deadline) = 0;
  virtual absl::StatusOr<RetentionDone> Apply(const RetentionOptions& options, Deadline deadline) = 0;
};

struct BlobStatus {
  CheckState check;
  std::vector<StoreUse> uses;
  std::vector<BlobDamage> damages;  // newest first, as many as were asked for
  std::string store;                // where new blobs go: BlobStore::name
};

// As the functions of storage/blob_check.h and storage/blob_collector.h.
class BlobKeeping {
 public:
  virtual ~BlobKeeping() = default;
  virtual absl::Status Check(const CheckOptions& options, const CheckProgress& from, Deadline deadline) = 0;
  virtual absl::StatusOr<Collected> Collect(const CollectOptions& options, Deadline deadline) = 0;
  virtual absl::StatusOr<BlobStatus> Status(int damage_limit, Deadline deadline) const = 0;
  // As the functions of storage/months.h.
  virtual absl::StatusOr<std::vector<MonthUse>> Months(Deadline deadline) const = 0;
  virtual absl::StatusOr<int> MakeMonths(int months_ahead, Deadline deadline) = 0;
  // As the function of storage/bucket_owner.h; FAILED_PRECONDITION where there is no object store.
  virtual absl::StatusOr<std::string> AdoptBucket(Deadline deadline) = 0;
};

// In PostgreSQL, which lives longer, and that store's.
std::shared_ptr<RetentionStore> RetentionIn(Database* database, std::shared_ptr<BlobStore> blobs);
std::shared_ptr<BlobKeeping> BlobKeepingIn(Database* database, std::shared_ptr<BlobStore> blobs);

}  // namespace sixpoint::storage
