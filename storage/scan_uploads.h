// Scans on their way in: what was acknowledged of them, until they are complete.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/scans.h"

namespace sixpoint::storage {

struct ScanUploadRow {
  std::string scan_id;
  std::string header;  // as accepted; bytes that storage does not read
  int machine_revision = 0;
  std::optional<int> artefact_revision;
  // Everything below is what the acknowledged blocks add up to.
  int next_block = 0;
  std::int64_t point_count = 0;
  int profile_count = 0;
  std::int64_t stored_bytes = 0;
  double proven_error_um = 0;
  std::int64_t open_profile_points = 0;
  double open_profile_x_mm = 0;
};

absl::StatusOr<std::optional<ScanUploadRow>> FindUpload(Transaction& transaction, const std::string& scan_id);
// ALREADY_EXISTS where there is one: call LockScanId and FindUpload first.
absl::Status BeginUpload(Transaction& transaction, const ScanUploadRow& upload);

// The next block and what the upload adds up to with it (after.next_block = the block's index + 1). The blob is stored
// already. False, and nothing changed, where another stream has been quicker or the upload is gone.
absl::StatusOr<bool> AddUploadBlock(Transaction& transaction, const ScanUploadRow& after, const ScanBlockRow& block);

absl::StatusOr<std::vector<ScanBlockRow>> BlocksOfUpload(Transaction& transaction, const std::string& scan_id);

// Complete, refused or forgotten: its blobs stay for whoever refers to them.
absl::Status EndUpload(Transaction& transaction, const std::string& scan_id);
// Uploads that nobody touched since then; how many.
absl::StatusOr<int> ForgetUploads(Transaction& transaction, Instant untouched_since);

}  // namespace sixpoint::storage
