#include "services/correction/correction_service.h"

#include <utility>

#include "services/correction/correction_messages.h"
#include "services/correction/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
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
    : database_(database),
      peers_(std::move(peers)),
      running_({greatest_count, 0}, "corrections", errors::v1::CORRECTIONS_FULL) {}

grpc::Status CorrectionService::Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                                        v1::Correction* response) {
  if (const auto checked = CheckCorrect(*request); !checked.ok()) return ToGrpc(checked.status());
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  absl::StatusOr<v1::Correction> correction = CorrectOnce(
      database_, *peers_, *request, [context] { return runtime::ContextFor(*context); }, runtime::DeadlineOf(*context));
  if (!correction.ok()) return ToGrpc(correction.status());
  *response = *std::move(correction);
  return grpc::Status::OK;
}

grpc::Status CorrectionService::GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                                              v1::Correction* response) {
  return ToGrpc(runtime::GetResult(database_, runtime::DeadlineOf(*context), "corrections", request->name(),
                                   errors::v1::CORRECTION_NOT_FOUND, storage::FindCorrection, WithProgram, response));
}

grpc::Status CorrectionService::ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                                                v1::ListCorrectionsResponse* response) {
  // Programs are left to GetCorrection.
  return ToGrpc(runtime::ListResults(
      database_, runtime::DeadlineOf(*context), *request, "", storage::ListCorrections,
      [](const storage::CorrectionRow& row) -> absl::StatusOr<v1::Correction> { return ToProto(row, ""); },
      response->mutable_corrections(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::correction
