#include "services/inspection/inspection_service.h"

#include <utility>

#include "services/inspection/inspection_messages.h"
#include "services/inspection/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_slot.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
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
  v1::Inspection inspection = ToProto(made.row);
  const absl::Status kept = storage::KeepAnswer(transaction, kInspectMethod, request.request_id(),
                                                request.SerializeAsString(), inspection.SerializeAsString());
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
    : database_(database), peers_(std::move(peers)), options_(options) {}

grpc::Status InspectionService::Inspect(grpc::ServerContext* context, const v1::InspectRequest* request,
                                        v1::Inspection* response) {
  if (absl::Status status = CheckInspect(*request); !status.ok()) return ToGrpc(status);
  const runtime::ComputeSlot slot(&running_, options_.greatest_count);
  if (absl::Status status = slot.Check("inspections", "INSPECTIONS_FULL"); !status.ok()) return ToGrpc(status);
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
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "inspections", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const auto row = storage::FindInspection(*transaction, *id);
  if (!row.ok()) return ToGrpc(row.status());
  if (!row->has_value()) {
    return ToGrpc(runtime::Failure(absl::StatusCode::kNotFound, "INSPECTION_NOT_FOUND",
                                   "name: " + request->name() + ", want a stored inspection"));
  }
  *response = ToProto(**row);
  return grpc::Status::OK;
}

grpc::Status InspectionService::ListInspections(grpc::ServerContext* context, const v1::ListInspectionsRequest* request,
                                                v1::ListInspectionsResponse* response) {
  const absl::StatusOr<std::string> serial = runtime::FilterIdOf("blade", "blades", request->blade());
  if (!serial.ok()) return ToGrpc(serial.status());
  const auto page = runtime::PageOf(request->blade(), request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  // One more than asked tells whether there is another page.
  const auto rows = storage::ListInspections(*transaction, *serial, page->before_sequence, page->size + 1);
  if (!rows.ok()) return ToGrpc(rows.status());
  for (const storage::InspectionRow& row : *rows) {
    if (response->inspections_size() == page->size) {
      const std::int64_t last_sequence = response->inspections(page->size - 1).record_sequence();
      response->set_next_page_token(runtime::TokenAfter(request->blade(), last_sequence));
      break;
    }
    *response->add_inspections() = ToProto(row);
  }
  return grpc::Status::OK;
}

}  // namespace sixpoint::inspection
