#include "storage/scans.h"

#include <utility>

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

constexpr char kLockScanId[] = "SELECT pg_advisory_xact_lock(hashtextextended('scans/' || $1, 0))";

#define SIXPOINT_SCAN_COLUMNS                                                                                     \
  "scan_id, machine_id, machine_revision, artefact_id, artefact_revision, blade_serial, kind, v0_x_mm, v0_y_mm, " \
  "v0_z_mm, a_deg, b_deg, profile_pitch_mm, columns_per_profile, point_count, encoding, sender_error_um, "        \
  "error_bound_um, measured_at, block_count, stored_bytes, stored_sha256, sent_sha256, proven_error_um, "         \
  "stored_encoding, profile_count, raw_step_um, arm_series, clamping, subject_temperature_c, "                    \
  "scales_temperature_c, sensor_serial_number, travel, station, cloud, length_unit"
constexpr char kInsertScan[] = "INSERT INTO scans (" SIXPOINT_SCAN_COLUMNS
                               ", scan_key) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, "
                               "$16, $17, $18, $19, $20, $21, $22, $23, $24, $25, $26, $27, $28, $29, $30, $31, "
                               "$32, $33, $34, $35, $36, $37)";
#define SIXPOINT_SELECT_SCANS     \
  "SELECT " SIXPOINT_SCAN_COLUMNS \
  ", record_sequence, recorded_at FROM scans JOIN recorded r ON r.record_id = scan_key WHERE "
constexpr char kSelectScan[] = SIXPOINT_SELECT_SCANS "scan_key = " SIXPOINT_SCAN_KEY("$1");
#define SIXPOINT_LIST_SCANS                                                                                       \
  SIXPOINT_SELECT_SCANS                                                                                           \
  "entry_kind = 'scan' AND ($1::bigint = 0 OR record_sequence < $1::bigint) AND ($2 = '' OR entry_machine = $2) " \
  "AND ($3 = '' OR artefact_id = $3) AND ($4 = '' OR entry_blade = $4) AND ($5 = '' OR kind = $5) "               \
  "AND ($6 = '' OR blade_serial IN (SELECT b.blade_serial FROM blades b WHERE b.part_id = $6)) "                  \
  "AND ($7::timestamptz IS NULL OR recorded_at >= $7) AND ($8::timestamptz IS NULL OR recorded_at < $8) "
// $9: the parts that are hidden.
constexpr char kListScans[] = SIXPOINT_LIST_SCANS
    "AND (cardinality($9::text[]) = 0 OR entry_blade IS NULL OR NOT EXISTS (SELECT 1 FROM blades b "
    "WHERE b.blade_serial = entry_blade AND b.part_id = ANY ($9::text[]))) ORDER BY record_sequence DESC LIMIT $10";
// $9: the blades that are seen. Their scans are found and then sorted, as SIXPOINT_NEWEST_FIRST says; those of artefacts stand in order.
constexpr char kListSeenScans[] =
    "(" SIXPOINT_LIST_SCANS
    "AND entry_blade = ANY ($9::text[]) ORDER BY record_sequence + 0 DESC LIMIT $10) UNION ALL "
    "(" SIXPOINT_LIST_SCANS
    "AND entry_blade IS NULL ORDER BY record_sequence DESC LIMIT $10) "
    "ORDER BY record_sequence DESC LIMIT $10";
#undef SIXPOINT_LIST_SCANS
#undef SIXPOINT_SELECT_SCANS
#undef SIXPOINT_SCAN_COLUMNS
constexpr char kInsertBlocks[] =
    "INSERT INTO scan_blocks (scan_key, block_index, point_count, blob_sha256, first_profile, profile_count, "
    "sent_sha256, evidence_sha256) SELECT $1::uuid, (position - 1)::integer, points::integer, blob, "
    "nullif(first, '')::integer, nullif(profiles, '')::integer, sent, decode(nullif(evidence, ''), 'hex') "
    "FROM unnest($2::text[], $3::bytea[], $4::text[], $5::text[], $6::bytea[], $7::text[]) WITH ORDINALITY "
    "AS block (points, blob, first, profiles, sent, evidence, position)";
constexpr char kSelectScanBlocks[] =
    "SELECT block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256 "
    "FROM scan_blocks WHERE scan_key = " SIXPOINT_SCAN_KEY("$1") " ORDER BY block_index";

ScanRow ReadScan(const Rows& rows, int row) {
  ScanRow scan;
  scan.scan_id = rows.Text(row, 0);
  scan.machine_id = rows.Text(row, 1);
  scan.machine_revision = static_cast<int>(rows.Int(row, 2));
  if (!rows.IsNull(row, 3)) {
    scan.artefact_id = rows.Text(row, 3);
    scan.artefact_revision = static_cast<int>(rows.Int(row, 4));
  }
  if (!rows.IsNull(row, 5)) scan.blade_serial = rows.Text(row, 5);
  scan.kind = rows.Text(row, 6);
  scan.v0_mm = {rows.Real(row, 7), rows.Real(row, 8), rows.Real(row, 9)};
  scan.a_deg = rows.Real(row, 10);
  scan.b_deg = rows.Real(row, 11);
  scan.profile_pitch_mm = rows.Real(row, 12);
  scan.columns_per_profile = static_cast<int>(rows.Int(row, 13));
  scan.point_count = rows.Int(row, 14);
  scan.encoding = rows.Text(row, 15);
  scan.sender_error_um = rows.Real(row, 16);
  scan.error_bound_um = rows.Real(row, 17);
  if (!rows.IsNull(row, 18)) scan.measured_at = rows.Time(row, 18);
  scan.block_count = static_cast<int>(rows.Int(row, 19));
  scan.stored_bytes = rows.Int(row, 20);
  scan.stored_sha256 = rows.Digest(row, 21);
  scan.sent_sha256 = rows.Digest(row, 22);
  scan.proven_error_um = rows.Real(row, 23);
  scan.stored_encoding = rows.Text(row, 24);
  if (!rows.IsNull(row, 25)) scan.profile_count = static_cast<int>(rows.Int(row, 25));
  scan.raw_step_um = rows.Real(row, 26);
  scan.arm_series = rows.OptionalText(row, 27);
  scan.clamping = rows.OptionalText(row, 28);
  scan.subject_temperature_c = rows.OptionalReal(row, 29);
  scan.scales_temperature_c = rows.OptionalReal(row, 30);
  scan.sensor_serial_number = rows.OptionalText(row, 31);
  scan.travel = rows.OptionalText(row, 32);
  scan.station = rows.OptionalText(row, 33);
  scan.cloud = rows.OptionalText(row, 34);
  scan.length_unit = rows.OptionalText(row, 35);
  scan.recorded = {rows.Int(row, 36), rows.Time(row, 37)};
  return scan;
}

Params ScanParams(const ScanRow& scan, const std::string& scan_key) {
  Params params;
  params.Text(scan.scan_id).Text(scan.machine_id).Int(scan.machine_revision);
  params.TextOrNull(scan.artefact_id);
  scan.artefact_id ? params.Int(scan.artefact_revision) : params.Null();
  params.TextOrNull(scan.blade_serial);
  params.Text(scan.kind).Real(scan.v0_mm[0]).Real(scan.v0_mm[1]).Real(scan.v0_mm[2]);
  params.Real(scan.a_deg).Real(scan.b_deg).Real(scan.profile_pitch_mm).Int(scan.columns_per_profile);
  params.Int(scan.point_count).Text(scan.encoding).Real(scan.sender_error_um).Real(scan.error_bound_um);
  params.OptionalTime(scan.measured_at);
  params.Int(scan.block_count).Int(scan.stored_bytes).Digest(scan.stored_sha256).Digest(scan.sent_sha256);
  params.Real(scan.proven_error_um).Text(scan.stored_encoding);
  scan.profile_count > 0 ? params.Int(scan.profile_count) : params.Null();
  params.Real(scan.raw_step_um);
  params.OptionalText(scan.arm_series).OptionalText(scan.clamping).OptionalReal(scan.subject_temperature_c);
  params.OptionalReal(scan.scales_temperature_c).OptionalText(scan.sensor_serial_number).OptionalText(scan.travel);
  params.OptionalText(scan.station).OptionalText(scan.cloud).OptionalText(scan.length_unit);
  params.Uuid(scan_key);
  return params;
}

}  // namespace

absl::Status LockScanId(Transaction& transaction, const std::string& scan_id) {
  return transaction.Execute(kLockScanId, Params().Text(scan_id)).status();
}

absl::StatusOr<std::optional<ScanRow>> FindScan(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectScan, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(ReadScan(*rows, 0));
}

absl::StatusOr<std::vector<ScanBlockRow>> ReadBlocks(const Rows& rows, const std::string& scan_id) {
  std::vector<ScanBlockRow> blocks;
  for (int row = 0; row < rows.count(); ++row) {
    if (rows.Int(row, 0) != row) return absl::DataLossError("scan " + scan_id + ": block " + std::to_string(row));
    ScanBlockRow& block = blocks.emplace_back();
    block.point_count = static_cast<int>(rows.Int(row, 1));
    block.blob_sha256 = rows.Digest(row, 2);
    if (!rows.IsNull(row, 3)) block.first_profile = static_cast<int>(rows.Int(row, 3));
    if (!rows.IsNull(row, 4)) block.profile_count = static_cast<int>(rows.Int(row, 4));
    if (!rows.IsNull(row, 5)) block.sent_sha256 = rows.Digest(row, 5);
    if (!rows.IsNull(row, 6)) block.evidence_sha256 = rows.Digest(row, 6);
  }
  return rows.Checked(std::move(blocks));
}

absl::StatusOr<std::vector<ScanBlockRow>> BlocksOfScan(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectScanBlocks, Params().Text(scan_id));
  if (!rows.ok()) return rows.status();
  return ReadBlocks(*rows, scan_id);
}

absl::StatusOr<std::optional<std::string>> ScanKeyOf(Transaction& transaction, const std::string& scan_id) {
  const absl::StatusOr<Rows> key = transaction.Execute("SELECT " SIXPOINT_SCAN_KEY("$1"), Params().Text(scan_id));
  if (!key.ok()) return key.status();
  if (key->IsNull(0, 0)) return std::nullopt;
  return key->Checked(std::optional<std::string>(key->Text(0, 0)));
}

// By the key itself: where it is known, one month is looked into and not all, which costs more than all else.
absl::StatusOr<bool> ScanHasBlob(Transaction& transaction, const std::string& scan_key, const std::string& sha256) {
  const absl::StatusOr<Rows> rows = transaction.Execute(
      "SELECT EXISTS (SELECT FROM scan_blocks WHERE scan_key = $1 AND $2 IN (blob_sha256, evidence_sha256)) "
      "AND NOT EXISTS (SELECT FROM scan_deletions WHERE scan_key = $1)",
      Params().Uuid(scan_key).Digest(sha256));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Bool(0, 0));
}

absl::StatusOr<Recorded> InsertScan(Transaction& transaction, const ScanRow& scan,
                                    const std::vector<ScanBlockRow>& blocks, const RecordEntry& entry) {
  const std::string scan_key = NewUuid();
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertScan, ScanParams(scan, scan_key));
  if (!inserted.ok()) return inserted.status();
  std::vector<std::string> point_counts, blobs, first_profiles, profile_counts, sent, evidence;
  for (const ScanBlockRow& block : blocks) {
    point_counts.push_back(std::to_string(block.point_count));
    blobs.push_back(block.blob_sha256);
    const bool has_profiles = block.profile_count > 0;  // a snapshot has none
    first_profiles.push_back(has_profiles ? std::to_string(block.first_profile) : "");
    profile_counts.push_back(has_profiles ? std::to_string(block.profile_count) : "");
    sent.push_back(block.sent_sha256);
    evidence.push_back(block.evidence_sha256);
  }
  const absl::StatusOr<Rows> stored = transaction.Execute(kInsertBlocks, Params()
                                                                             .Uuid(scan_key)
                                                                             .Texts(point_counts)
                                                                             .Digests(blobs)
                                                                             .Texts(first_profiles)
                                                                             .Texts(profile_counts)
                                                                             .Digests(sent)
                                                                             .Texts(evidence));
  if (!stored.ok()) return stored.status();
  return AppendRecord(transaction, scan_key, entry);
}

absl::StatusOr<std::vector<ScanRow>> ListScans(Transaction& transaction, const ScanFilter& filter,
                                               std::int64_t before_sequence, int limit) {
  Params params;
  params.Int(before_sequence).Text(filter.machine_id).Text(filter.artefact_id).Text(filter.blade_serial);
  params.Text(filter.kind).Text(filter.part_id);
  AddSpan(filter.recorded, &params);
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  params.Texts(sight->seen_blades ? *sight->seen_blades : sight->hidden_parts).Int(limit);
  return AllRows(transaction, sight->seen_blades ? kListSeenScans : kListScans, params, ReadScan);
}

}  // namespace sixpoint::storage
