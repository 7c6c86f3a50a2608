// A scan's rows and blobs as an upload leaves them, without an upload.
#pragma once

#include <string>
#include <vector>

#include "storage/blob_store.h"
#include "storage/database.h"

namespace sixpoint::testing {

// Machine m1 and artefact p1, which the scans below name.
void PutScanSubjects(storage::Database* database);
// Bytes that nothing refers to; their digest.
std::string PutCloud(storage::Database* database, storage::BlobStore* store, const std::string& bytes);
// Of kind artefact or arm, of these payloads, recorded so many days ago.
void PutScan(storage::Database* database, storage::BlobStore* store, const std::string& scan_id,
             const std::string& kind, const std::vector<std::string>& blocks, int days_ago);

}  // namespace sixpoint::testing
