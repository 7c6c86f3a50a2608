#include "services/registration/registration_service.h"

#include <optional>
#include <string>

#include "services/registration/batch.h"
#include "services/registration/registration_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "storage/registrations.h"

namespace sixpoint::registration {
namespace {

using runtime::ToGrpc;

Caller CallerOf(const grpc::ServerContext* context) {
  return {runtime::DeadlineOf(*context), [context] { return runtime::ContextFor(*context); },
          runtime::KeepGoing(*context)};
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
  return ToGrpc(runtime::GetResult(
      database_, runtime::DeadlineOf(*context), "registrations", request->name(), errors::v1::REGISTRATION_NOT_FOUND,
      storage::FindRegistration,
      [](storage::Transaction&, const storage::RegistrationRow& row) { return ToProto(row); }, response));
}

grpc::Status RegistrationService::ListRegistrations(grpc::ServerContext* context,
                                                    const v1::ListRegistrationsRequest* request,
                                                    v1::ListRegistrationsResponse* response) {
  const std::string more_filters = std::string(request->only_disagreeing() ? " disagreeing" : "") +
                                   (request->without_for_inspection() ? " without_for_inspection" : "");
  const auto list = [request](storage::Transaction& transaction, const std::string& serial,
                              std::int64_t before_sequence, int limit) {
    return storage::ListRegistrations(
        transaction, {serial, request->only_disagreeing(), request->without_for_inspection()}, before_sequence, limit);
  };
  return ToGrpc(runtime::ListResults(database_, runtime::DeadlineOf(*context), *request, more_filters, list, ToProto,
                                     response->mutable_registrations(), response->mutable_next_page_token()));
}

grpc::Status RegistrationService::RegisterBatch(grpc::ServerContext* context, const v1::RegisterBatchRequest* request,
                                                grpc::ServerWriter<v1::RegisterBatchResponse>* writer) {
  // One registration that is watched takes no batch's place.
  std::optional<runtime::ComputePool::Slot> slot;
  if (request->requests_size() > 1) {
    auto free = batches_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
    if (!free.ok()) return ToGrpc(free.status());
    slot.emplace(*std::move(free));
  }
  return ToGrpc(RunBatch(
      *request, CallerOf(context),
      [this](const v1::RegisterRequest& one, const Caller& caller) { return registrar_.Register(one, caller); },
      [writer](const v1::RegisterBatchResponse& response) { return writer->Write(response); }));
}

}  // namespace sixpoint::registration
