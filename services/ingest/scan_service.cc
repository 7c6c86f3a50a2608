#include "services/ingest/scan_service.h"

#include <utility>
#include <vector>

#include "services/ingest/call_watch.h"
#include "services/ingest/scan_messages.h"
#include "services/ingest/scan_pages.h"
#include "services/ingest/upload.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_slot.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "storage/blobs.h"
#include "storage/scans.h"

namespace sixpoint::ingest {
namespace {

using runtime::ToGrpc;

absl::StatusOr<storage::ScanRow> RequireScan(storage::Transaction& transaction, const std::string& name) {
  const absl::StatusOr<std::string> scan_id = runtime::IdOf("name", "scans", name);
  if (!scan_id.ok()) return scan_id.status();
  absl::StatusOr<std::optional<storage::ScanRow>> row = storage::FindScan(transaction, *scan_id);
  if (!row.ok()) return row.status();
  if (!row->has_value()) {
    return runtime::Failure(absl::StatusCode::kNotFound, "SCAN_NOT_FOUND", "name: " + name + ", want a stored scan");
  }
  return **std::move(row);
}

struct StoredScan {
  storage::ScanRow row;
  std::vector<storage::ScanBlockRow> blocks;
};

absl::StatusOr<StoredScan> ReadScan(storage::Database* database, const std::string& name, storage::Deadline deadline) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  absl::StatusOr<storage::ScanRow> row = RequireScan(*transaction, name);
  if (!row.ok()) return row.status();
  absl::StatusOr<std::vector<storage::ScanBlockRow>> blocks = storage::BlocksOfScan(*transaction, row->scan_id);
  if (!blocks.ok()) return blocks.status();
  return StoredScan{*std::move(row), *std::move(blocks)};
}

// A transaction of its own, so that a client that reads slowly holds no connection.
absl::StatusOr<std::string> ReadBlock(storage::Database* database, const std::string& name, std::size_t index,
                                      const std::string& sha256, storage::Deadline deadline) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  absl::StatusOr<std::string> bytes = storage::GetBlob(*transaction, sha256);
  if (absl::IsNotFound(bytes.status()) || absl::IsDataLoss(bytes.status())) {
    return runtime::Failure(absl::StatusCode::kDataLoss, "SCAN_DAMAGED",
                            name + " block[" + std::to_string(index) + "]: " + std::string(bytes.status().message()));
  }
  return bytes;
}

}  // namespace

ScanService::ScanService(const ScanServiceOptions& options, storage::Database* database,
                         std::shared_ptr<grpc::Channel> plant)
    : database_(database),
      plant_(std::move(plant)),
      workers_(options.decode_worker, options.worker_count, options.decode_patience),
      greatest_upload_count_(options.greatest_upload_count) {}

grpc::Status ScanService::UploadScan(grpc::ServerContext* context, grpc::ServerReader<v1::UploadScanRequest>* reader,
                                     v1::UploadScanResponse* response) {
  return ToGrpc(Upload(context, reader, response));
}

absl::Status ScanService::Upload(grpc::ServerContext* context, grpc::ServerReader<v1::UploadScanRequest>* reader,
                                 v1::UploadScanResponse* response) {
  const runtime::ComputeSlot slot(&upload_count_, greatest_upload_count_);
  if (absl::Status free = slot.Check("uploads", "UPLOADS_FULL"); !free.ok()) return free;
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const CallWatch watch(context, deadline);
  v1::UploadScanRequest request;
  if (!reader->Read(&request) || !request.has_header()) {
    return runtime::Refuse("header", "missing", "the header as the first message");
  }
  UploadCaller caller{deadline, [context] { return runtime::ContextFor(*context); }, context->peer()};
  absl::StatusOr<std::unique_ptr<ScanUpload>> upload =
      ScanUpload::Begin({database_, &workers_, &plant_}, std::move(*request.mutable_header()), std::move(caller));
  if (!upload.ok()) return upload.status();
  while (reader->Read(&request)) {
    if (!request.has_block()) return runtime::Refuse("block", "missing", "blocks only after the header");
    if (absl::Status added = (*upload)->Add(request.block()); !added.ok()) return added;
  }
  if (context->IsCancelled()) return absl::CancelledError("the client went away or its time ended; nothing is stored");
  absl::StatusOr<v1::UploadScanResponse> finished = (*upload)->Finish();
  if (finished.ok()) *response = *std::move(finished);
  return finished.status();
}

grpc::Status ScanService::GetScan(grpc::ServerContext* context, const v1::GetScanRequest* request, v1::Scan* response) {
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const absl::StatusOr<storage::ScanRow> row = RequireScan(*transaction, request->name());
  if (!row.ok()) return ToGrpc(row.status());
  *response = ToProto(*row);
  return grpc::Status::OK;
}

grpc::Status ScanService::ListScans(grpc::ServerContext* context, const v1::ListScansRequest* request,
                                    v1::ListScansResponse* response) {
  const absl::StatusOr<ScanPage> page = PageOf(*request);
  if (!page.ok()) return ToGrpc(page.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  // One more than asked tells whether there is another page.
  const absl::StatusOr<std::vector<storage::ScanRow>> rows =
      storage::ListScans(*transaction, page->filter, page->page.before_sequence, page->page.size + 1);
  if (!rows.ok()) return ToGrpc(rows.status());
  for (const storage::ScanRow& row : *rows) {
    if (response->scans_size() == page->page.size) {
      const std::int64_t last_sequence = response->scans(page->page.size - 1).record_sequence();
      response->set_next_page_token(TokenAfter(*request, last_sequence));
      break;
    }
    *response->add_scans() = ToProto(row);
  }
  return grpc::Status::OK;
}

grpc::Status ScanService::DownloadScan(grpc::ServerContext* context, const v1::DownloadScanRequest* request,
                                       grpc::ServerWriter<v1::DownloadScanResponse>* writer) {
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const CallWatch watch(context, deadline);
  const absl::StatusOr<StoredScan> scan = ReadScan(database_, request->name(), deadline);
  if (!scan.ok()) return ToGrpc(scan.status());
  v1::DownloadScanResponse response;
  *response.mutable_scan() = ToProto(scan->row);
  bool open = writer->Write(response);
  for (std::size_t i = 0; open && i < scan->blocks.size(); ++i) {
    const storage::ScanBlockRow& row = scan->blocks[i];
    absl::StatusOr<std::string> bytes = ReadBlock(database_, request->name(), i, row.blob_sha256, deadline);
    if (!bytes.ok()) return ToGrpc(bytes.status());
    v1::ScanBlock& block = *response.mutable_block();
    block.set_index(static_cast<int>(i));
    block.set_point_count(row.point_count);
    block.set_payload(*std::move(bytes));
    open = writer->Write(response);
  }
  return open ? grpc::Status::OK : ToGrpc(absl::CancelledError("the client went away"));
}

}  // namespace sixpoint::ingest
