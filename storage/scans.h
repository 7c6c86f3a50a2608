// Scans and their blocks.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"
#include "storage/record.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

struct ScanRow {
  std::string scan_id;
  std::string machine_id;
  int machine_revision = 0;
  std::optional<std::string> artefact_id;  // either this, with its revision ...
  int artefact_revision = 0;
  std::optional<std::string> blade_serial;  // ... or this
  std::string kind;                         // artefact, arm, airfoil, local, pins
  std::array<double, 3> v0_mm{};
  double a_deg = 0;
  double b_deg = 0;
  double profile_pitch_mm = 0;
  int columns_per_profile = 0;
  std::int64_t point_count = 0;
  std::string encoding;  // as sent: draco, xyz_f64, raw_profiles
  double raw_step_um = 0;
  std::string arm_series, clamping;  // empty: not known
  std::optional<double> subject_temperature_c, scales_temperature_c;
  std::string sensor_serial_number;  // empty: not stated
  std::string travel;                // FORWARD, BACKWARD; empty: not known
  std::string station;               // of the blade's part; empty: it has none
  std::string cloud;                 // PROFILES, SNAPSHOT; empty: not stated, of profiles
  std::string length_unit;           // of a snapshot as it was sent: MILLIMETRE, METRE, INCH; empty: not stated
  double sender_error_um = 0;
  double error_bound_um = 0;
  std::optional<Instant> measured_at;
  int block_count = 0;
  std::int64_t stored_bytes = 0;
  std::string stored_encoding;  // draco, range_image
  int profile_count = 0;        // of the whole scan; 0: none were counted, or it is a snapshot
  std::string stored_sha256;    // Sha256OfDigests of the blocks
  std::string sent_sha256;      // the same of what was sent
  double proven_error_um = 0;
  Recorded recorded;  // set by InsertScan
};

struct ScanBlockRow {
  int point_count = 0;
  std::string blob_sha256;
  int first_profile = 0;
  int profile_count = 0;
  std::string sent_sha256;
  std::string evidence_sha256;  // of what was sent, where it is kept beside what is read; empty: it is not
};

// Until the transaction ends, uploads of the same id wait here for each other.
absl::Status LockScanId(Transaction& transaction, const std::string& scan_id);

absl::StatusOr<std::optional<ScanRow>> FindScan(Transaction& transaction, const std::string& scan_id);
// In scan order.
absl::StatusOr<std::vector<ScanBlockRow>> BlocksOfScan(Transaction& transaction, const std::string& scan_id);
// By which its blocks are known: a scan's for ever. None where there is no such scan.
absl::StatusOr<std::optional<std::string>> ScanKeyOf(Transaction& transaction, const std::string& scan_id);
// Of a scan whose points are there. digest: 64 lower-case hexadecimal digits.
absl::StatusOr<bool> ScanHasBlob(Transaction& transaction, const std::string& scan_key, const std::string& sha256);
// Columns block_index, point_count, blob_sha256, first_profile, profile_count, sent_sha256, evidence_sha256. DATA_LOSS where one is missing.
absl::StatusOr<std::vector<ScanBlockRow>> ReadBlocks(const Rows& rows, const std::string& scan_id);

// Journal entry, scan and blocks, whose blobs are stored already. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertScan(Transaction& transaction, const ScanRow& scan,
                                    const std::vector<ScanBlockRow>& blocks, const RecordEntry& entry);

// Empty filters match all. Newest first, from below `before_sequence` (0: from the newest).
struct ScanFilter {
  std::string machine_id;
  std::string artefact_id;
  std::string blade_serial;
  std::string kind;
  std::string part_id;  // of the blade
  TimeSpan recorded;
  Reader reader;  // what he may not see is not listed
};
absl::StatusOr<std::vector<ScanRow>> ListScans(Transaction& transaction, const ScanFilter& filter,
                                               std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
