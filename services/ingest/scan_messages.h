// Scans between their messages and their rows.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "sixpoint/ingest/v1/ingest.pb.h"
#include "storage/scans.h"

namespace sixpoint::ingest {

// "airfoil" and so on; empty for UNSPECIFIED.
std::string KindText(v1::ScanKind kind);

// What ListScans leaves of all scans; refuses names of other collections, a kind that is none and a range that is none.
absl::StatusOr<storage::ScanFilter> FilterOf(const v1::ListScansRequest& request);

// DATA_LOSS: a word that this release does not know.
absl::StatusOr<v1::Scan> ToProto(const storage::ScanRow& row);
v1::StoredBlock ToProto(int index, const storage::ScanBlockRow& row);

// What the header says (checked before); the rest of the row is left as it is.
storage::ScanRow RowOf(const v1::ScanHeader& header, int machine_revision, int artefact_revision);

// The header as it will read once stored: times in microseconds.
void RoundAsStored(v1::ScanHeader* header);

// "a_deg: 0 -> 1; kind: ..." or nothing where they are the same. A count that is not sent is no difference.
std::string DifferencesOf(const v1::ScanHeader& stored, const v1::ScanHeader& sent);

}  // namespace sixpoint::ingest
