#include "services/ingest/stored_scan.h"

#include "metrology/cloud/draco_codec.h"
#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::ingest {
namespace {

absl::Status Damaged(const std::string& name, const absl::Status& status, const std::string& where = "") {
  return runtime::Failure(errors::v1::SCAN_DAMAGED, name + where + ": " + std::string(status.message()),
                          {{"resource", name}});
}
absl::Status Damaged(const StoredScan& scan, std::size_t index, const absl::Status& status) {
  return Damaged(runtime::NameOf("scans", scan.row.scan_id), status, " block[" + std::to_string(index) + "]");
}

absl::StatusOr<std::string> ReadBlob(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                     const std::string& sha256, storage::Deadline deadline) {
  absl::StatusOr<std::string> bytes = scans.Payload(sha256, deadline);
  if (absl::IsNotFound(bytes.status()) || absl::IsDataLoss(bytes.status())) return Damaged(scan, index, bytes.status());
  return bytes;
}

}  // namespace

absl::StatusOr<storage::ScanRow> FindScanByName(const storage::ScanReader& scans, const std::string& name,
                                                storage::Deadline deadline) {
  const absl::StatusOr<std::string> scan_id = runtime::IdOf("name", "scans", name);
  if (!scan_id.ok()) return scan_id.status();
  absl::StatusOr<std::optional<storage::ScanRow>> row = scans.Find(*scan_id, deadline);
  if (!row.ok()) return row.status();
  if (!row->has_value()) {
    return runtime::Failure(errors::v1::SCAN_NOT_FOUND, "name: " + name + ", want a stored scan", {{"resource", name}});
  }
  return **std::move(row);
}

absl::StatusOr<StoredScan> ReadScan(const storage::ScanReader& scans, const std::string& name,
                                    storage::Deadline deadline) {
  absl::StatusOr<storage::ScanRow> row = FindScanByName(scans, name, deadline);
  if (!row.ok()) return row.status();
  // Also where another scan keeps some of its blocks alive.
  if (absl::Status kept = scans.RequirePoints(row->scan_id, deadline); !kept.ok()) return kept;
  absl::StatusOr<std::vector<storage::ScanBlockRow>> blocks = scans.Blocks(row->scan_id, deadline);
  if (!blocks.ok()) return blocks.status();
  return StoredScan{*std::move(row), *std::move(blocks)};
}

absl::StatusOr<std::string> ReadBlock(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                      storage::Deadline deadline) {
  return ReadBlob(scans, scan, index, scan.blocks[index].blob_sha256, deadline);
}

absl::StatusOr<std::string> ReadSentBlock(const storage::ScanReader& scans, const StoredScan& scan, std::size_t index,
                                          storage::Deadline deadline) {
  const storage::ScanBlockRow& block = scan.blocks[index];
  return ReadBlob(scans, scan, index, block.evidence_sha256.empty() ? block.blob_sha256 : block.evidence_sha256,
                  deadline);
}

absl::StatusOr<std::string> ReadBlobOf(const storage::ScanReader& scans, const std::string& name,
                                       const std::string& sha256, storage::Deadline deadline) {
  const absl::StatusOr<std::string> scan_id = runtime::IdOf("name", "scans", name);
  if (!scan_id.ok()) return scan_id.status();
  const bool is_digest = sha256.size() == 64 && sha256.find_first_not_of("0123456789abcdef") == std::string::npos;
  absl::StatusOr<std::optional<std::string>> bytes = std::nullopt;
  if (is_digest) bytes = scans.BlobOf(*scan_id, sha256, deadline);
  if (absl::IsNotFound(bytes.status()) || absl::IsDataLoss(bytes.status())) return Damaged(name, bytes.status());
  if (!bytes.ok()) return bytes.status();
  if (bytes->has_value()) return **std::move(bytes);
  if (const auto scan = FindScanByName(scans, name, deadline); !scan.ok()) return scan.status();
  return runtime::Failure(errors::v1::BLOB_NOT_FOUND,
                          "sha256: " + Tame(sha256, 80) + ", want that of a blob of " + name, {{"resource", name}});
}

absl::StatusOr<metrology::Points> ReadPoints(const storage::ScanReader& scans, const StoredScan& scan,
                                             std::size_t index, storage::Deadline deadline) {
  const absl::StatusOr<std::string> bytes = ReadBlock(scans, scan, index, deadline);
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<metrology::Points> points_mm = metrology::DecodeBlock(*bytes, scan.blocks[index].point_count);
  if (!points_mm.ok()) return Damaged(scan, index, points_mm.status());
  return points_mm;
}

bool Overlaps(const storage::ScanBlockRow& block, const ProfileRange& range) {
  return block.first_profile < range.first + range.count && range.first < block.first_profile + block.profile_count;
}

metrology::Points PointsIn(const metrology::Points& points_mm, const storage::ScanBlockRow& block,
                           const ProfileRange& range, double profile_pitch_mm) {
  metrology::Points inside_mm;
  int profile = block.first_profile;
  double profile_x_mm = points_mm.empty() ? 0 : points_mm.front().x();
  for (const Eigen::Vector3d& p : points_mm) {
    // As block_statistics counts them.
    if (p.x() - profile_x_mm >= 0.5 * profile_pitch_mm) {
      ++profile;
      profile_x_mm = p.x();
    }
    if (profile >= range.first && profile < range.first + range.count) inside_mm.push_back(p);
  }
  return inside_mm;
}

}  // namespace sixpoint::ingest
