// Objects by key in a bucket elsewhere. Knows nothing of the catalogue: storage/blob_store.h does.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// Thread-safe. Every call ends by its deadline. Statuses: UNAVAILABLE (away, or failing by itself; reason OBJECT_STORE_AWAY),
// DEADLINE_EXCEEDED, FAILED_PRECONDITION (reason OBJECT_STORE_REFUSED: credentials; BUCKET_MISSING), RESOURCE_EXHAUSTED
// (full), INTERNAL (an answer that is none of these).
class ObjectStore {
 public:
  virtual ~ObjectStore() = default;
  // Durable and read back by its length once it returns OK. `sha256` is that of the bytes: the server checks it.
  virtual absl::Status Put(const std::string& key, std::string_view bytes, const std::string& sha256,
                           Deadline deadline) = 0;
  // NOT_FOUND; DATA_LOSS where the object is longer than that.
  virtual absl::StatusOr<std::string> Get(const std::string& key, std::int64_t greatest_bytes, Deadline deadline) = 0;
  // NOT_FOUND where there is none.
  virtual absl::StatusOr<std::int64_t> SizeOf(const std::string& key, Deadline deadline) = 0;
  // OK where there is none.
  virtual absl::Status Delete(const std::string& key, Deadline deadline) = 0;

  struct Listed {
    std::string key;
    std::int64_t size_bytes = 0;
    Instant modified_at;  // the object store's clock
  };
  struct ListPage {
    std::vector<Listed> objects;
    std::string next;  // empty at the end
  };
  // In the order of keys, up to 1000 at a time; `next` of the page before goes on from there.
  virtual absl::StatusOr<ListPage> List(const std::string& prefix, const std::string& next, Deadline deadline) = 0;
};

}  // namespace sixpoint::storage
