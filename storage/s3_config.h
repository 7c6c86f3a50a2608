// Where the S3-compatible object store is and who we are to it: a YAML file that only its owner may read, so that no secret
// shows on a command line.
//
//   endpoint: https://objects.plant.example:8443   # or http:// inside the plant; bucket in the path, not in the host
//   bucket: clouds                                 # of this plant alone: what it does not claim, it collects
//   region: us-east-1                              # optional
//   access_key: ...                                # or SIXPOINT_S3_ACCESS_KEY in the environment
//   secret_key: ...                                # or SIXPOINT_S3_SECRET_KEY
//   new_blobs: s3                                  # optional; postgresql: only read from here
//   ca_file: /etc/sixpoint/ca.pem                  # optional; else the system's
//   connect_timeout_s: 3                           # optional
//   request_timeout_s: 60                          # optional; the caller's deadline may be nearer
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <memory>
#include <string>

#include "storage/blob_store.h"

namespace sixpoint::storage {

struct S3Config {
  std::string endpoint;
  std::string bucket;
  std::string region = "us-east-1";
  std::string access_key;
  std::string secret_key;
  std::string new_blobs = "s3";
  std::string ca_file;
  std::chrono::milliseconds connect_timeout{3'000};
  std::chrono::milliseconds request_timeout{60'000};
};

// INVALID_ARGUMENT names the key, its value (never a secret) and what was wanted.
absl::StatusOr<S3Config> ReadS3Config(const std::string& path);

// "postgresql", or "s3://" and the path of the file above: s3:///etc/sixpoint/s3.yaml. `most_postgresql_bytes`: of new clouds there.
// Connects to nothing yet.
absl::StatusOr<std::unique_ptr<BlobStore>> OpenBlobStore(const std::string& configuration,
                                                         std::int64_t most_postgresql_bytes = kMostPostgresqlBytes);

}  // namespace sixpoint::storage
