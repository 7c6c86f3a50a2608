// One upload from its header to its commit, whatever carried it here.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/ingest/decode_workers.h"
#include "services/ingest/known_plant.h"
#include "services/ingest/running_digest.h"
#include "services/ingest/validate.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "storage/scans.h"

namespace sixpoint::ingest {

// What an upload works with; outlives it.
struct UploadTools {
  storage::Database* database = nullptr;
  DecodeWorkers* workers = nullptr;
  KnownPlant* plant = nullptr;
};
// Who asks, and until when.
struct UploadCaller {
  storage::Deadline deadline;
  KnownPlant::ContextMaker make_context;
  std::string requested_by;
};

// Blocks go into one open transaction as they come, so memory holds one block at a time and nothing is half-stored: an
// upload that is destroyed before Finish leaves no trace. Where the scan is there already, the blocks are only compared.
// One thread at a time.
class ScanUpload {
 public:
  // Uploads of the same scan_id wait here for each other.
  static absl::StatusOr<std::unique_ptr<ScanUpload>> Begin(const UploadTools& tools, v1::ScanHeader header,
                                                           UploadCaller caller);
  absl::Status Add(const v1::ScanBlock& block);
  // Durable once this returns OK.
  absl::StatusOr<v1::UploadScanResponse> Finish();

 private:
  ScanUpload(const UploadTools& tools, v1::ScanHeader header, UploadCaller caller);
  absl::Status Recognise();
  absl::Status Store(const v1::ScanBlock& block);
  absl::Status Believe(int block_index, const BlockStatistics& statistics);
  absl::StatusOr<std::string> Encode(const v1::ScanBlock& block);
  absl::StatusOr<v1::UploadScanResponse> AnswerStored();
  storage::RecordEntry JournalEntry() const;

  const UploadTools tools_;
  const v1::ScanHeader header_;
  const UploadCaller caller_;
  plant::v1::Machine machine_;
  std::optional<storage::Transaction> transaction_;  // none where the scan is there already
  std::optional<storage::ScanRow> stored_;           // the scan that is there already
  storage::ScanRow row_;                             // grows with the blocks
  std::vector<storage::ScanBlockRow> blocks_;
  UploadProgress progress_;
  ProfileCursor cursor_;
  RunningDigest sent_;
  RunningDigest kept_;
};

}  // namespace sixpoint::ingest
