// Content-addressed bytes, named by their SHA-256, in the store that the plant is configured with. Each row of the
// catalogue (table blobs) says who holds its bytes, so a plant that changed stores reads both.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <string_view>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

// Thread-safe.
class BlobStore {
 public:
  virtual ~BlobStore() = default;

  // The same bytes twice are one blob. They are durable at the latest when the transaction commits, and always before
  // the row that names them can be seen; until then no collector takes them. In the transaction of the row that refers to
  // them, before it. Ends by the transaction's deadline.
  virtual absl::StatusOr<std::string> Put(Transaction& transaction, std::string_view bytes) = 0;

  // Checked against the digest on every read. NOT_FOUND: never stored, or collected as unreferenced. DATA_LOSS: the bytes
  // are gone or changed. FAILED_PRECONDITION: deleted on purpose (reason POINTS_DELETED; the message says when and why), or held
  // by an object store that this process is not configured with (reason OBJECT_STORE_MISSING).
  absl::StatusOr<std::string> Get(Transaction& transaction, const std::string& sha256);

  // "postgresql" or "s3": where Put puts.
  virtual std::string name() const = 0;
  // Null where the plant has none.
  ObjectStore* objects() const { return objects_.get(); }

 protected:
  explicit BlobStore(std::unique_ptr<ObjectStore> objects) : objects_(std::move(objects)) {}

 private:
  const std::unique_ptr<ObjectStore> objects_;
};

// Bytes in table blobs. With `objects`, blobs of former times are still read from there.
std::unique_ptr<BlobStore> MakePostgresqlBlobStore(std::unique_ptr<ObjectStore> objects = nullptr);
// Bytes as objects; the catalogue in table blobs.
std::unique_ptr<BlobStore> MakeObjectBlobStore(std::unique_ptr<ObjectStore> objects);

// "sha256/ab/cd/<sha256>".
std::string ObjectKeyOf(const std::string& sha256);

}  // namespace sixpoint::storage
