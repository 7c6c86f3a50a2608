#include "storage/scan_uploads.h"

#include <utility>

namespace sixpoint::storage {
namespace {

constexpr char kSelectUpload[] =
    "SELECT header, machine_revision, artefact_revision, next_block, point_count, profile_count, stored_bytes, "
    "proven_error_um, open_profile_points, open_profile_x_mm FROM scan_uploads WHERE scan_id = $1";
constexpr char kInsertUpload[] =
    "INSERT INTO scan_uploads (scan_id, header, machine_revision, artefact_revision) VALUES ($1, $2, $3, $4)";
// One statement: the row of the upload is the lock, and the block goes in only where it is the next.
constexpr char kInsertUploadBlock[] =
    "WITH advanced AS (UPDATE scan_uploads SET next_block = $2::integer + 1, point_count = $3, profile_count = $4, "
    "stored_bytes = $5, proven_error_um = $6, open_profile_points = $7, open_profile_x_mm = $8, "
    "touched_at = clock_timestamp() WHERE scan_id = $1 AND next_block = $2::integer RETURNING scan_id) "
    "INSERT INTO scan_upload_blocks (scan_id, block_index, point_count, first_profile, profile_count, sent_sha256, "
    "blob_sha256, evidence_sha256) SELECT scan_id, $2::integer, $9::integer, $10::integer, $11::integer, $12::bytea, "
    "$13::bytea, decode(nullif($14::text, ''), 'hex') FROM advanced";
constexpr char kSelectUploadBlocks[] =
    "SELECT block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256 "
    "FROM scan_upload_blocks WHERE scan_id = $1 ORDER BY block_index";
constexpr char kDeleteUpload[] = "DELETE FROM scan_uploads WHERE scan_id = $1";
// The blocks as they are before they go with their uploads.
constexpr char kDeleteUntouched[] =
    "WITH gone AS (DELETE FROM scan_uploads WHERE touched_at < $1 RETURNING scan_id), "
    "loose AS (INSERT INTO loose_blobs (sha256) SELECT blob_sha256 FROM scan_upload_blocks "
    "WHERE scan_id IN (SELECT scan_id FROM gone) UNION SELECT evidence_sha256 FROM scan_upload_blocks "
    "WHERE scan_id IN (SELECT scan_id FROM gone) AND evidence_sha256 IS NOT NULL ON CONFLICT (sha256) DO NOTHING) "
    "SELECT count(*) FROM gone";

}  // namespace

absl::StatusOr<std::optional<ScanUploadRow>> FindUpload(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectUpload, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  ScanUploadRow upload;
  upload.scan_id = scan_id;
  upload.header = rows->Bytes(0, 0);
  upload.machine_revision = static_cast<int>(rows->Int(0, 1));
  if (!rows->IsNull(0, 2)) upload.artefact_revision = static_cast<int>(rows->Int(0, 2));
  upload.next_block = static_cast<int>(rows->Int(0, 3));
  upload.point_count = rows->Int(0, 4);
  upload.profile_count = static_cast<int>(rows->Int(0, 5));
  upload.stored_bytes = rows->Int(0, 6);
  upload.proven_error_um = rows->Real(0, 7);
  upload.open_profile_points = rows->Int(0, 8);
  upload.open_profile_x_mm = rows->Real(0, 9);
  return rows->Checked(std::move(upload));
}

absl::Status BeginUpload(Transaction& transaction, const ScanUploadRow& upload) {
  Params params;
  params.Text(upload.scan_id).Bytes(upload.header).Int(upload.machine_revision);
  params.OptionalInt(upload.artefact_revision);
  return transaction.Execute(kInsertUpload, params).status();
}

absl::StatusOr<bool> AddUploadBlock(Transaction& transaction, const ScanUploadRow& after, const ScanBlockRow& block) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kInsertUploadBlock, Params()
                                                                                .Text(after.scan_id)
                                                                                .Int(after.next_block - 1)
                                                                                .Int(after.point_count)
                                                                                .Int(after.profile_count)
                                                                                .Int(after.stored_bytes)
                                                                                .Real(after.proven_error_um)
                                                                                .Int(after.open_profile_points)
                                                                                .Real(after.open_profile_x_mm)
                                                                                .Int(block.point_count)
                                                                                .Int(block.first_profile)
                                                                                .Int(block.profile_count)
                                                                                .Digest(block.sent_sha256)
                                                                                .Digest(block.blob_sha256)
                                                                                .Text(block.evidence_sha256));
  if (!rows.ok()) return rows.status();
  return rows->affected() == 1;
}

absl::StatusOr<std::vector<ScanBlockRow>> BlocksOfUpload(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectUploadBlocks, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  return ReadBlocks(*rows, scan_id);
}

absl::Status EndUpload(Transaction& transaction, const std::string& scan_id) {
  return transaction.Execute(kDeleteUpload, Params().Text(scan_id)).status();
}

absl::StatusOr<int> ForgetUploads(Transaction& transaction, Instant untouched_since) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kDeleteUntouched, Params().Time(untouched_since));
  if (!rows.ok()) return rows.status();
  return rows->Checked(static_cast<int>(rows->Int(0, 0)));
}

}  // namespace sixpoint::storage
