// A stored scan and its points, block by block.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "storage/scan_store.h"

namespace sixpoint::ingest {

struct StoredScan {
  storage::ScanRow row;
  std::vector<storage::ScanBlockRow> blocks;
};

// NOT_FOUND with reason SCAN_NOT_FOUND.
absl::StatusOr<storage::ScanRow> FindScanByName(const storage::ScanReader& scans, const std::string& name,
                                                storage::Deadline deadline);
// FAILED_PRECONDITION with reason POINTS_DELETED where retention took its points.
absl::StatusOr<StoredScan> ReadScan(const storage::ScanReader& scans, const std::string& name,
                                    storage::Deadline deadline);

// The bytes of one block, checked against their digest. DATA_LOSS with reason SCAN_DAMAGED.
absl::StatusOr<std::string> ReadBlock(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                      storage::Deadline deadline);
// The same as the machine sent it, of a scan sent as Draco: evidence, not to be decoded here.
absl::StatusOr<std::string> ReadSentBlock(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                          storage::Deadline deadline);
// The bytes of one of its blobs, whichever block it is of: what is decoded, or what was sent. NOT_FOUND with reason SCAN_NOT_FOUND or
// BLOB_NOT_FOUND.
absl::StatusOr<std::string> ReadBlobOf(const storage::ScanReader& scans, const std::string& name,
                                       const std::string& sha256, storage::Deadline deadline);
// Decoded here: our own encoder wrote it, and its digest was checked now.
absl::StatusOr<metrology::Points> ReadPoints(const storage::ScanReader& scans, const StoredScan& scan,
                                             std::size_t index, storage::Deadline deadline);

// Profiles [first, first + count) of a scan.
struct ProfileRange {
  int first = 0;
  int count = 0;
};
bool Overlaps(const storage::ScanBlockRow& block, const ProfileRange& range);
// Those of the block's points that lie in the range.
metrology::Points PointsIn(const metrology::Points& points_mm, const storage::ScanBlockRow& block,
                           const ProfileRange& range, double profile_pitch_mm);

}  // namespace sixpoint::ingest
