// Content-addressed bytes, named by their SHA-256, in the store that the plant is configured with. Each row of the
// catalogue (table blobs) says who holds its bytes, so a plant that changed stores reads both.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

// Bytes on their way in: an object that holds them is there, the row that claims it is not.
struct StagedBlob {
  std::string sha256;
  std::string_view bytes;  // outlive it
  std::string object_id;   // empty: the row will hold them
};

// Clouds that one PostgreSQL server still bears, with its backups (docs/sizing.md); a table ends at 32 TB.
inline constexpr std::int64_t kMostPostgresqlBytes = 2'000'000'000'000;

// Thread-safe.
class BlobStore {
 public:
  virtual ~BlobStore() = default;

  // With no transaction open: an object store is another process, and may be slow. What is staged and never put is the collector's,
  // after its grace. FAILED_PRECONDITION: the bucket is another plant's. RESOURCE_EXHAUSTED: PostgreSQL holds as much as it may.
  virtual absl::StatusOr<StagedBlob> Stage(Database& database, std::string_view bytes, Deadline deadline) = 0;
  // In the transaction of the row that refers to them, before it. The same bytes twice are one blob, which no collector takes before
  // the transaction ends.
  absl::Status Put(Transaction& transaction, const StagedBlob& blob);

  // Checked against the digest on every read; holds no connection while it waits for an object store. NOT_FOUND: never stored, or
  // collected as unreferenced. DATA_LOSS: the bytes are gone or changed. FAILED_PRECONDITION: deleted on purpose (reason
  // POINTS_DELETED; the message says when and why), or held by an object store that this process is not configured with (reason
  // OBJECT_STORE_MISSING).
  // may: asked before, in the same transaction; what it refuses is the answer.
  absl::StatusOr<std::string> Get(Database& database, const std::string& sha256, Deadline deadline,
                                  const std::function<absl::Status(Transaction&)>& may = nullptr) const;

  // "postgresql" or "s3": where new bytes go.
  virtual std::string name() const = 0;
  // Null where the plant has none.
  ObjectStore* objects() const { return objects_.get(); }

 protected:
  explicit BlobStore(std::unique_ptr<ObjectStore> objects) : objects_(std::move(objects)) {}

 private:
  const std::unique_ptr<ObjectStore> objects_;
};

// Bytes in table blobs, so many of them at most. With `objects`, blobs of former times are still read from there.
std::unique_ptr<BlobStore> MakePostgresqlBlobStore(std::unique_ptr<ObjectStore> objects = nullptr,
                                                   std::int64_t most_bytes = kMostPostgresqlBytes);
// Bytes as objects; the catalogue in table blobs.
std::unique_ptr<BlobStore> MakeObjectBlobStore(std::unique_ptr<ObjectStore> objects);

// "sha256/ab/cd/<sha256>/<object_id>". An id is put once and never again: whoever deletes an object that nothing claims needs no lock
// against whoever puts the same bytes.
std::string ObjectKeyOf(const std::string& sha256, const std::string& object_id);

}  // namespace sixpoint::storage
