// What ingest keeps of scans, apart from where: scans with their blocks, and uploads on their way to be one. PostgreSQL's with a
// blob store and the tests' fake of them pass the same suite (tests/storage/scan_store_test.cc). Thread-safe. No call holds a
// connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/blob_store.h"
#include "storage/clearances.h"
#include "storage/record.h"
#include "storage/result_store.h"
#include "storage/scan_uploads.h"
#include "storage/scans.h"

namespace sixpoint::storage {

class ScanReader : public ResultReader<ScanRow, ScanFilter> {
 public:
  // As the function of this name in storage/retention.h.
  virtual absl::Status RequirePoints(const std::string& scan_id, Deadline deadline) const = 0;
  // In scan order; of a scan whose points were deleted, too.
  virtual absl::StatusOr<std::vector<ScanBlockRow>> Blocks(const std::string& scan_id, Deadline deadline) const = 0;
  // The bytes of a block, checked against their digest: as BlobStore::Get.
  virtual absl::StatusOr<std::string> Payload(const std::string& blob_sha256, Deadline deadline) const = 0;
  // The same of a blob that holds points of that scan, decoded or as they were sent; none: no such blob is of it. As RequirePoints too. One
  // look, however many blocks it has. blob_sha256: 64 lower-case hexadecimal digits.
  virtual absl::StatusOr<std::optional<std::string>> BlobOf(const std::string& scan_id, const std::string& blob_sha256,
                                                            Deadline deadline) const = 0;
};

// What is known under a scan's id.
struct KnownScan {
  std::optional<ScanRow> complete;
  ScanUploadRow upload;  // where it is not complete: what was acknowledged
};

// The upload before its first block.
ScanUploadRow Begun(const ScanUploadRow& upload);

struct CompletedScan {
  ScanRow scan;
  bool was_complete = false;  // before: nothing was done
};

// A scan that was made of its upload, with its journal entry.
struct MadeScan {
  ScanRow row;
  RecordEntry entry;
};

class UploadStore {
 public:
  virtual ~UploadStore() = default;
  // Finds the scan, or its upload, or begins it. Of an upload that is there goes_on(known) says whether it is gone on with; false:
  // it is begun anew.
  virtual absl::StatusOr<KnownScan> Join(const ScanUploadRow& upload,
                                         const std::function<absl::StatusOr<bool>(const ScanUploadRow& known)>& goes_on,
                                         Deadline deadline) = 0;
  // The next block with the bytes that readers decode, and those sent where they are other ones and stay (empty: none), and what the upload adds up to with it (after.next_block = the block's index + 1). False, and
  // nothing changed, where another stream has been quicker or the upload is gone.
  virtual absl::StatusOr<bool> AddBlock(const ScanUploadRow& after, ScanBlockRow block, std::string_view payload,
                                        std::string_view evidence, Deadline deadline) = 0;
  virtual absl::StatusOr<std::vector<ScanBlockRow>> UploadedBlocks(const std::string& scan_id,
                                                                   Deadline deadline) const = 0;
  // Makes the scan of its upload, which ends, and appends to the journal. Nothing where there is neither scan nor upload.
  virtual absl::StatusOr<std::optional<CompletedScan>> Complete(
      const std::string& scan_id,
      const std::function<absl::StatusOr<MadeScan>(const ScanUploadRow&, const std::vector<ScanBlockRow>&)>& make,
      Deadline deadline) = 0;
};

class ScanStore : public ScanReader, public UploadStore, public ClearanceReader {};

// In PostgreSQL, the bytes in `blobs`; both live longer.
std::shared_ptr<ScanStore> ScansIn(Database* database, BlobStore* blobs);

}  // namespace sixpoint::storage
