// An object store that speaks S3 (Ceph, MinIO, AWS): libcurl with Signature V4, the bucket in the path.
#pragma once

#include <memory>

#include "storage/object_store.h"
#include "storage/s3_config.h"

namespace sixpoint::storage {

// What fails by itself (no connection, 5xx) is tried a few times with growing pauses, within the caller's deadline.
std::unique_ptr<ObjectStore> MakeS3ObjectStore(S3Config config);

}  // namespace sixpoint::storage
