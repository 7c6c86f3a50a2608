#include "services/correction/correction_service.h"

#include <utility>

#include "services/correction/correction_messages.h"
#include "services/correction/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_slot.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/blobs.h"
#include "storage/requests.h"

namespace sixpoint::correction {
namespace {

using runtime::ToGrpc;

constexpr char kCorrectMethod[] = "CorrectionService.Correct";

// Blobs, journal, rows and the kept answer: together or not at all.
absl::StatusOr<v1::Correction> Store(storage::Transaction& transaction, const v1::CorrectRequest& request,
                                     MadeCorrection made) {
  if (!request.nc_template().empty()) {
    const absl::StatusOr<std::string> digest = storage::PutBlob(transaction, request.nc_template());
    if (!digest.ok()) return digest.status();
    made.row.nc_template_sha256 = *digest;
  }
  if (!made.nc_program.empty()) {
    const absl::StatusOr<std::string> digest = storage::PutBlob(transaction, made.nc_program);
    if (!digest.ok()) return digest.status();
    made.row.nc_program_sha256 = *digest;
  }
  const absl::StatusOr<storage::Recorded> recorded = storage::InsertCorrection(transaction, made.row, made.entry);
  if (!recorded.ok()) return recorded.status();
  made.row.recorded = *recorded;
  v1::Correction correction = ToProto(made.row, made.nc_program);
  const absl::Status kept = storage::KeepAnswer(transaction, kCorrectMethod, request.request_id(),
                                                request.SerializeAsString(), correction.SerializeAsString());
  if (!kept.ok()) return kept;
  if (absl::Status committed = transaction.Commit(); !committed.ok()) return committed;
  return correction;
}

absl::StatusOr<v1::Correction> CorrectOnce(storage::Database* database, const Peers& peers,
                                           const v1::CorrectRequest& request, const ContextFactory& context,
                                           storage::Deadline deadline) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const auto answer =
      storage::FindAnswer(*transaction, kCorrectMethod, request.request_id(), request.SerializeAsString());
  if (!answer.ok()) return answer.status();
  v1::Correction correction;
  if (answer->has_value()) {
    if (!correction.ParseFromString(**answer)) return absl::DataLossError("a kept answer cannot be read");
    return correction;
  }
  absl::StatusOr<MadeCorrection> made = CorrectBlade(peers, request, context);
  if (!made.ok()) return made.status();
  return Store(*transaction, request, *std::move(made));
}

absl::StatusOr<v1::Correction> WithProgram(storage::Transaction& transaction, const storage::CorrectionRow& row) {
  if (!row.nc_program_sha256) return ToProto(row, "");
  const absl::StatusOr<std::string> program = storage::GetBlob(transaction, *row.nc_program_sha256);
  if (!program.ok()) return program.status();
  return ToProto(row, *program);
}

}  // namespace

CorrectionService::CorrectionService(storage::Database* database, std::unique_ptr<Peers> peers, int greatest_count)
    : database_(database), peers_(std::move(peers)), greatest_count_(greatest_count) {}

grpc::Status CorrectionService::Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                                        v1::Correction* response) {
  if (const auto checked = CheckCorrect(*request); !checked.ok()) return ToGrpc(checked.status());
  const runtime::ComputeSlot slot(&running_, greatest_count_);
  if (absl::Status status = slot.Check("corrections", "CORRECTIONS_FULL"); !status.ok()) return ToGrpc(status);
  absl::StatusOr<v1::Correction> correction = CorrectOnce(
      database_, *peers_, *request, [context] { return runtime::ContextFor(*context); }, runtime::DeadlineOf(*context));
  if (!correction.ok()) return ToGrpc(correction.status());
  *response = *std::move(correction);
  return grpc::Status::OK;
}

grpc::Status CorrectionService::GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                                              v1::Correction* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "corrections", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const auto row = storage::FindCorrection(*transaction, *id);
  if (!row.ok()) return ToGrpc(row.status());
  if (!row->has_value()) {
    return ToGrpc(runtime::Failure(absl::StatusCode::kNotFound, "CORRECTION_NOT_FOUND",
                                   "name: " + request->name() + ", want a stored correction"));
  }
  absl::StatusOr<v1::Correction> correction = WithProgram(*transaction, **row);
  if (!correction.ok()) return ToGrpc(correction.status());
  *response = *std::move(correction);
  return grpc::Status::OK;
}

grpc::Status CorrectionService::ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                                                v1::ListCorrectionsResponse* response) {
  const absl::StatusOr<std::string> serial = runtime::FilterIdOf("blade", "blades", request->blade());
  if (!serial.ok()) return ToGrpc(serial.status());
  const auto page = runtime::PageOf(request->blade(), request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  // One more than asked tells whether there is another page. Programs are left to GetCorrection.
  const auto rows = storage::ListCorrections(*transaction, *serial, page->before_sequence, page->size + 1);
  if (!rows.ok()) return ToGrpc(rows.status());
  for (const storage::CorrectionRow& row : *rows) {
    if (response->corrections_size() == page->size) {
      const std::int64_t last_sequence = response->corrections(page->size - 1).record_sequence();
      response->set_next_page_token(runtime::TokenAfter(request->blade(), last_sequence));
      break;
    }
    *response->add_corrections() = ToProto(row, "");
  }
  return grpc::Status::OK;
}

}  // namespace sixpoint::correction
