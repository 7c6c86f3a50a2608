#include "services/inspection/inspection_service.h"

#include <utility>

#include "services/inspection/inspection_messages.h"
#include "services/inspection/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "storage/requests.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

constexpr char kInspectMethod[] = "InspectionService.Inspect";

// Journal, rows and the kept answer: together or not at all.
absl::StatusOr<v1::Inspection> Store(storage::Transaction& transaction, const v1::InspectRequest& request,
                                     MadeInspection made) {
  const absl::StatusOr<storage::Recorded> recorded = storage::InsertInspection(transaction, made.row, made.entry);
  if (!recorded.ok()) return recorded.status();
  made.row.recorded = *recorded;
  absl::StatusOr<v1::Inspection> inspection = ToProto(made.row);
  if (!inspection.ok()) return inspection.status();
  const absl::Status kept = storage::KeepAnswer(transaction, kInspectMethod, request.request_id(),
                                                request.SerializeAsString(), inspection->SerializeAsString());
  if (!kept.ok()) return kept;
  if (absl::Status committed = transaction.Commit(); !committed.ok()) return committed;
  return inspection;
}

absl::StatusOr<v1::Inspection> InspectOnce(storage::Database* database, const Peers& peers,
                                           const v1::InspectRequest& request, const Caller& caller,
                                           storage::Deadline deadline) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  const auto answer =
      storage::FindAnswer(*transaction, kInspectMethod, request.request_id(), request.SerializeAsString());
  if (!answer.ok()) return answer.status();
  v1::Inspection inspection;
  if (answer->has_value()) {
    if (!inspection.ParseFromString(**answer)) return absl::DataLossError("a kept answer cannot be read");
    return inspection;
  }
  absl::StatusOr<MadeInspection> made = InspectBlade(peers, request, caller);
  if (!made.ok()) return made.status();
  return Store(*transaction, request, *std::move(made));
}

}  // namespace

InspectionService::InspectionService(storage::Database* database, std::unique_ptr<Peers> peers,
                                     const InspectionServiceOptions& options)
    : database_(database),
      peers_(std::move(peers)),
      options_(options),
      running_({options.greatest_count, 0}, "inspections", errors::v1::INSPECTIONS_FULL) {}

grpc::Status InspectionService::Inspect(grpc::ServerContext* context, const v1::InspectRequest* request,
                                        v1::Inspection* response) {
  if (absl::Status status = CheckInspect(*request); !status.ok()) return ToGrpc(status);
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  const Caller caller{[context] { return runtime::ContextFor(*context); }, runtime::KeepGoing(*context),
                      options_.threads};
  absl::StatusOr<v1::Inspection> inspection =
      InspectOnce(database_, *peers_, *request, caller, runtime::DeadlineOf(*context));
  if (!inspection.ok()) return ToGrpc(inspection.status());
  *response = *std::move(inspection);
  return grpc::Status::OK;
}

grpc::Status InspectionService::GetInspection(grpc::ServerContext* context, const v1::GetInspectionRequest* request,
                                              v1::Inspection* response) {
  return ToGrpc(runtime::GetResult(
      database_, runtime::DeadlineOf(*context), "inspections", request->name(), errors::v1::INSPECTION_NOT_FOUND,
      storage::FindInspection, [](storage::Transaction&, const storage::InspectionRow& row) { return ToProto(row); },
      response));
}

grpc::Status InspectionService::ListInspections(grpc::ServerContext* context, const v1::ListInspectionsRequest* request,
                                                v1::ListInspectionsResponse* response) {
  return ToGrpc(runtime::ListResults(
      database_, runtime::DeadlineOf(*context), *request, "", storage::ListInspections,
      [](const storage::InspectionRow& row) -> absl::StatusOr<v1::Inspection> { return ToProto(row); },
      response->mutable_inspections(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::inspection
