// A real S3 server for tests (tests/support/object_store_server: Ceph's radosgw), one a test process, ended with it.
#pragma once

#include <string>

#include "storage/s3_config.h"

namespace sixpoint::testing {

// Empty once it serves; else why it cannot be, for GTEST_SKIP.
const std::string& WhyNoObjectStore();
// Of the server's bucket; only where it serves.
storage::S3Config ObjectStoreConfig();

}  // namespace sixpoint::testing
