#include "services/registration/registration_service.h"

#include <optional>
#include <string>

#include "services/registration/batch.h"
#include "services/registration/registration_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_slot.h"
#include "services/runtime/errors.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "storage/registrations.h"

namespace sixpoint::registration {
namespace {

using runtime::ToGrpc;

Caller CallerOf(const grpc::ServerContext* context) {
  return {runtime::DeadlineOf(*context), [context] { return runtime::ContextFor(*context); },
          runtime::KeepGoing(*context)};
}

absl::StatusOr<v1::ListRegistrationsResponse> List(storage::Database* database, storage::Deadline deadline,
                                                   const v1::ListRegistrationsRequest& request) {
  const absl::StatusOr<std::string> serial = runtime::FilterIdOf("blade", "blades", request.blade());
  if (!serial.ok()) return serial.status();
  const std::string filters = request.blade() + (request.only_disagreeing() ? " disagreeing" : "") +
                              (request.without_for_inspection() ? " without_for_inspection" : "");
  const absl::StatusOr<runtime::Page> page = runtime::PageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  // One more than asked tells whether there is another page.
  const auto rows =
      storage::ListRegistrations(*transaction, {*serial, request.only_disagreeing(), request.without_for_inspection()},
                                 page->before_sequence, page->size + 1);
  if (!rows.ok()) return rows.status();
  v1::ListRegistrationsResponse response;
  for (const storage::RegistrationRow& row : *rows) {
    if (response.registrations_size() == page->size) {
      const std::int64_t last_sequence = response.registrations(page->size - 1).record_sequence();
      response.set_next_page_token(runtime::TokenAfter(filters, last_sequence));
      break;
    }
    absl::StatusOr<v1::Registration> registration = ToProto(row);
    if (!registration.ok()) return registration.status();
    *response.add_registrations() = *std::move(registration);
  }
  return response;
}

}  // namespace

RegistrationService::RegistrationService(storage::Database* database, const Peers& peers, const RegistrarLimits& limits)
    : database_(database), registrar_(database, peers, limits) {}

grpc::Status RegistrationService::Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                                           v1::Registration* response) {
  absl::StatusOr<v1::Registration> result = registrar_.Register(*request, CallerOf(context));
  if (result.ok()) *response = *std::move(result);
  return ToGrpc(result.status());
}

grpc::Status RegistrationService::GetRegistration(grpc::ServerContext* context,
                                                  const v1::GetRegistrationRequest* request,
                                                  v1::Registration* response) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "registrations", request->name());
  if (!id.ok()) return ToGrpc(id.status());
  absl::StatusOr<storage::Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const auto found = storage::FindRegistration(*transaction, *id);
  if (!found.ok()) return ToGrpc(found.status());
  if (!found->has_value())
    return ToGrpc(absl::NotFoundError("name: " + request->name() + ", want a registration that is recorded"));
  absl::StatusOr<v1::Registration> registration = ToProto(**found);
  if (registration.ok()) *response = *std::move(registration);
  return ToGrpc(registration.status());
}

grpc::Status RegistrationService::ListRegistrations(grpc::ServerContext* context,
                                                    const v1::ListRegistrationsRequest* request,
                                                    v1::ListRegistrationsResponse* response) {
  absl::StatusOr<v1::ListRegistrationsResponse> page = List(database_, runtime::DeadlineOf(*context), *request);
  if (page.ok()) *response = *std::move(page);
  return ToGrpc(page.status());
}

grpc::Status RegistrationService::RegisterBatch(grpc::ServerContext* context, const v1::RegisterBatchRequest* request,
                                                grpc::ServerWriter<v1::RegisterBatchResponse>* writer) {
  // One registration that is watched takes no batch's place.
  std::optional<runtime::ComputeSlot> slot;
  if (request->requests_size() > 1) {
    slot.emplace(&batches_, kMostBatches);
    if (absl::Status free = slot->Check("batches", "BATCHES_FULL"); !free.ok()) return ToGrpc(free);
  }
  return ToGrpc(RunBatch(
      *request, CallerOf(context),
      [this](const v1::RegisterRequest& one, const Caller& caller) { return registrar_.Register(one, caller); },
      [writer](const v1::RegisterBatchResponse& response) { return writer->Write(response); }));
}

}  // namespace sixpoint::registration
