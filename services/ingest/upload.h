// One upload, from its header to the scan's commit, over as many streams as it takes.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/ingest/decode_workers.h"
#include "services/ingest/known_plant.h"
#include "services/ingest/validate.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "storage/scan_store.h"

namespace sixpoint::ingest {

// What an upload works with; outlives it.
struct UploadTools {
  storage::ScanStore* store = nullptr;
  DecodeWorkers* workers = nullptr;
  KnownPlant* plant = nullptr;
  runtime::ComputePool* encoding = nullptr;  // more at once than cores would only make every stream wait longer
};
// Who asks, and until when.
struct UploadCaller {
  storage::Deadline deadline;
  std::function<bool()> keep_going;
  KnownPlant::ContextMaker make_context;
  std::string requested_by, trace_id;
  storage::Reader reader;
};

// Holds no connection and no lock between its calls: what came so far stands in the store, and a block goes in only where it is
// the next. One thread at a time.
class ScanUpload {
 public:
  // Begins the upload, goes on with it, or finds its scan complete.
  static absl::StatusOr<std::unique_ptr<ScanUpload>> Begin(const UploadTools& tools, v1::ScanHeader header,
                                                           UploadCaller caller);
  v1::UploadProgress progress() const;
  // Durable once this returns OK. A block that came before is only compared.
  absl::Status Add(const v1::ScanBlock& block);
  // The scan is visible once this returns OK.
  absl::StatusOr<v1::StoredScan> Finish(const v1::ScanEnd& end);

 private:
  struct Prepared;
  ScanUpload(const UploadTools& tools, v1::ScanHeader header, UploadCaller caller);
  storage::Deadline SoonEnough() const;
  absl::Status CheckSeen(const std::string& field, const std::string& name, storage::Unrecorded unrecorded) const;
  absl::Status Recognise();
  absl::Status Join();
  absl::Status JoinKnown(std::string* other_subject);
  absl::Status Keep(const v1::ScanBlock& block, const std::string& sent_sha256);
  absl::StatusOr<Prepared> Prepare(const v1::ScanBlock& block);
  absl::StatusOr<Prepared> Encode(const v1::ScanBlock& block);
  absl::Status Believe(int block_index, const BlockStatistics& statistics) const;
  absl::Status Compare(int block_index, const std::string& sent_sha256);
  // The scan of what was acknowledged, if its end says the same.
  absl::StatusOr<storage::MadeScan> Made(const storage::ScanUploadRow& upload,
                                         const std::vector<storage::ScanBlockRow>& blocks,
                                         const v1::ScanEnd& end) const;
  absl::StatusOr<v1::StoredScan> AnswerStored(const v1::ScanEnd& end) const;
  storage::RecordEntry JournalEntry(const storage::ScanRow& scan) const;

  const UploadTools tools_;
  const v1::ScanHeader header_;
  const UploadCaller caller_;
  plant::v1::Machine machine_;
  std::optional<storage::ScanRow> stored_;  // where the scan is complete
  storage::ScanUploadRow row_;              // what was acknowledged
};

}  // namespace sixpoint::ingest
