#include "services/plant/plant_service.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "services/plant/plant_messages.h"
#include "services/plant/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "storage/requests.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;
using storage::Transaction;

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

storage::RecordEntry EntryFor(const grpc::ServerContext& context) {
  storage::RecordEntry entry;
  entry.software_version = runtime::SoftwareVersion();
  entry.requested_by = context.peer();
  return entry;
}

// Done once for each request_id, in the transaction that keeps the answer. Names the call as plant.CreateMachine, ...
template <typename Response, typename Request, typename Work>
grpc::Status Once(grpc::ServerContext* context, storage::Database* database, const std::string& call,
                  const Request& request, Response* response, Work work) {
  const auto run = [&]() -> absl::StatusOr<Response> {
    if (absl::Status status = runtime::CheckUuid("request_id", request.request_id()); !status.ok()) return status;
    const absl::StatusOr<std::string> answer = storage::RecordOnce(
        *database, runtime::RecordedRequestOf("plant." + call, request), runtime::DeadlineOf(*context),
        [&](Transaction& transaction) -> absl::StatusOr<std::string> {
          const auto row = work(transaction);
          if (!row.ok()) return row.status();
          return ToProto(*row).SerializeAsString();
        });
    if (!answer.ok()) return answer.status();
    return runtime::ReadAnswer<Response>(*answer);
  };
  return runtime::Answer(run(), response);
}

// NOT_FOUND with a reason where `found` holds nothing.
template <typename Row>
absl::StatusOr<Row> Require(absl::StatusOr<std::optional<Row>> found, runtime::ErrorReason reason,
                            const std::string& name, int revision = 0) {
  if (!found.ok()) return found.status();
  if (*found) return **std::move(found);
  runtime::Metadata about = {{"resource", name}};
  if (revision != 0) about.emplace("revision", std::to_string(revision));
  return runtime::Failure(reason, "name: " + name + ", want one that is registered", about);
}

absl::StatusOr<storage::MachineRow> RequireMachine(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<runtime::RevisedId> of = runtime::RevisedIdOf("name", "machines", name);
  if (!of.ok()) return of.status();
  return Require(storage::FindMachine(transaction, of->id, of->revision), errors::v1::MACHINE_NOT_FOUND, name,
                 of->revision);
}

absl::StatusOr<storage::ArtefactRow> RequireArtefact(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<runtime::RevisedId> of = runtime::RevisedIdOf("name", "artefacts", name);
  if (!of.ok()) return of.status();
  return Require(storage::FindArtefact(transaction, of->id, of->revision), errors::v1::ARTEFACT_NOT_FOUND, name,
                 of->revision);
}

absl::StatusOr<storage::PartRow> RequirePart(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<runtime::RevisedId> of = runtime::RevisedIdOf("name", "parts", name);
  if (!of.ok()) return of.status();
  return Require(storage::FindPart(transaction, of->id, of->revision), errors::v1::PART_NOT_FOUND, name, of->revision);
}

absl::StatusOr<storage::BladeRow> RequireBlade(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", name);
  if (!serial.ok()) return serial.status();
  return Require(storage::FindBlade(transaction, *serial), errors::v1::BLADE_NOT_FOUND, name);
}

// A read of one thing.
template <typename Response, typename Row>
grpc::Status Get(grpc::ServerContext* context, storage::Database* database, const std::string& name,
                 absl::StatusOr<Row> (*require)(Transaction&, const std::string&), Response* response) {
  absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const absl::StatusOr<Row> row = require(*transaction, name);
  if (row.ok()) *response = ToProto(*row);
  return ToGrpc(row.status());
}

// A page of what has revisions, by id, each with its newest one. `list` and `require` tell which.
template <typename Request, typename Message, typename Row>
absl::Status ListNewest(Transaction& transaction, const Request& request, storage::Registered list,
                        absl::StatusOr<Row> (*require)(Transaction&, const std::string&),
                        google::protobuf::RepeatedPtrField<Message>* out, std::string* next_page_token) {
  const absl::StatusOr<bool> full = runtime::WantsFull(request.view());
  if (!full.ok()) return full.status();
  const std::string filters = runtime::FiltersOf(request);
  absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  if (*full) page->size = std::min(page->size, runtime::kGreatestFullPageSize);
  // One more than asked tells whether there is another page.
  const absl::StatusOr<std::vector<std::string>> ids =
      storage::ListRegistered(transaction, list, page->after_id, page->size + 1);
  if (!ids.ok()) return ids.status();
  for (const std::string& id : *ids) {
    if (out->size() == page->size) {
      *next_page_token = runtime::TokenAfterId(filters, ids->at(static_cast<std::size_t>(page->size) - 1));
      break;
    }
    const absl::StatusOr<Row> row = require(transaction, runtime::NameOf(storage::CollectionOf(list), id));
    if (!row.ok()) return row.status();
    Message& message = *out->Add() = ToProto(*row);
    if (!*full) LeaveBasic(&message);
  }
  return absl::OkStatus();
}

template <typename Request, typename Message, typename Row>
grpc::Status List(grpc::ServerContext* context, storage::Database* database, const Request& request,
                  storage::Registered list, absl::StatusOr<Row> (*require)(Transaction&, const std::string&),
                  google::protobuf::RepeatedPtrField<Message>* out, std::string* next_page_token) {
  absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  return ToGrpc(ListNewest(*transaction, request, list, require, out, next_page_token));
}

absl::Status ListBladesIn(Transaction& transaction, const v1::ListBladesRequest& request,
                          v1::ListBladesResponse* response) {
  storage::BladeFilter filter;
  absl::StatusOr<std::string> part = runtime::FilterIdOf("part", "parts", request.part());
  if (!part.ok()) return part.status();
  filter.part_id = *std::move(part);
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  const std::string filters = runtime::FiltersOf(request);
  const absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  const absl::StatusOr<std::vector<storage::BladeRow>> blades =
      storage::ListBlades(transaction, filter, page->after_id, page->size + 1);
  if (!blades.ok()) return blades.status();
  for (const storage::BladeRow& blade : *blades) {
    if (response->blades_size() == page->size) {
      const auto last = static_cast<std::size_t>(page->size) - 1;
      response->set_next_page_token(runtime::TokenAfterId(filters, blades->at(last).blade_serial));
      break;
    }
    *response->add_blades() = ToProto(blade);
  }
  return absl::OkStatus();
}

}  // namespace

PlantService::PlantService(PlantServiceOptions options, storage::Database* database)
    : options_(std::move(options)),
      database_(database),
      surfaces_(options_.cad_worker, database, options_.cad_worker_count) {}

grpc::Status PlantService::CreateMachine(grpc::ServerContext* context, const v1::CreateMachineRequest* request,
                                         v1::Machine* response) {
  absl::StatusOr<storage::MachineRow> machine = Validated(*request);
  if (!machine.ok()) return ToGrpc(machine.status());
  return Once(context, database_, "CreateMachine", *request, response, [&](Transaction& transaction) {
    return storage::InsertMachine(transaction, *machine, EntryFor(*context));
  });
}

grpc::Status PlantService::GetMachine(grpc::ServerContext* context, const v1::GetMachineRequest* request,
                                      v1::Machine* response) {
  return Get(context, database_, request->name(), RequireMachine, response);
}

grpc::Status PlantService::ListMachines(grpc::ServerContext* context, const v1::ListMachinesRequest* request,
                                        v1::ListMachinesResponse* response) {
  return List(context, database_, *request, storage::Registered::kMachines, RequireMachine,
              response->mutable_machines(), response->mutable_next_page_token());
}

grpc::Status PlantService::CreateArtefact(grpc::ServerContext* context, const v1::CreateArtefactRequest* request,
                                          v1::Artefact* response) {
  absl::StatusOr<storage::ArtefactRow> artefact = Validated(*request);
  if (!artefact.ok()) return ToGrpc(artefact.status());
  return Once(context, database_, "CreateArtefact", *request, response, [&](Transaction& transaction) {
    return storage::InsertArtefact(transaction, *artefact, EntryFor(*context));
  });
}

grpc::Status PlantService::GetArtefact(grpc::ServerContext* context, const v1::GetArtefactRequest* request,
                                       v1::Artefact* response) {
  return Get(context, database_, request->name(), RequireArtefact, response);
}

grpc::Status PlantService::ListArtefacts(grpc::ServerContext* context, const v1::ListArtefactsRequest* request,
                                         v1::ListArtefactsResponse* response) {
  return List(context, database_, *request, storage::Registered::kArtefacts, RequireArtefact,
              response->mutable_artefacts(), response->mutable_next_page_token());
}

grpc::Status PlantService::CreatePart(grpc::ServerContext* context, const v1::CreatePartRequest* request,
                                      v1::Part* response) {
  absl::StatusOr<storage::PartRow> part = Validated(*request);
  if (!part.ok()) return ToGrpc(part.status());
  absl::StatusOr<storage::TessellationRow> tessellation = surfaces_.Of(
      part->cad_format, part->cad_unit_mm, request->cad(), runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!tessellation.ok()) return ToGrpc(tessellation.status());
  part->tessellation = *std::move(tessellation);
  if (absl::Status status = CheckInsideBox(*part); !status.ok()) return ToGrpc(status);
  return Once(context, database_, "CreatePart", *request, response, [&](Transaction& transaction) {
    storage::RecordEntry entry = EntryFor(*context);
    entry.method = part->tessellation.method;
    return storage::InsertPart(transaction, *part, std::move(entry));
  });
}

grpc::Status PlantService::GetPart(grpc::ServerContext* context, const v1::GetPartRequest* request,
                                   v1::Part* response) {
  return Get(context, database_, request->name(), RequirePart, response);
}

grpc::Status PlantService::ListParts(grpc::ServerContext* context, const v1::ListPartsRequest* request,
                                     v1::ListPartsResponse* response) {
  return List(context, database_, *request, storage::Registered::kParts, RequirePart, response->mutable_parts(),
              response->mutable_next_page_token());
}

grpc::Status PlantService::DownloadSurface(grpc::ServerContext* context, const v1::DownloadSurfaceRequest* request,
                                           grpc::ServerWriter<v1::DownloadSurfaceResponse>* writer) {
  const auto read = [&]() -> absl::StatusOr<std::string> {
    absl::StatusOr<Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<storage::PartRow> part = RequirePart(*transaction, request->name());
    if (!part.ok()) return part.status();
    return storage::GetBlob(*transaction, part->tessellation.surface_sha256);
  };
  // The connection goes back before the first chunk: a client that reads slowly holds none.
  const absl::StatusOr<std::string> bytes = read();
  if (!bytes.ok()) return ToGrpc(bytes.status());
  v1::DownloadSurfaceResponse response;
  for (std::size_t offset = 0; offset < bytes->size(); offset += kChunkBytes) {
    response.set_chunk(bytes->substr(offset, kChunkBytes));
    if (!writer->Write(response)) return ToGrpc(absl::CancelledError("the client went away"));
  }
  return grpc::Status::OK;
}

grpc::Status PlantService::CreateBlade(grpc::ServerContext* context, const v1::CreateBladeRequest* request,
                                       v1::Blade* response) {
  if (absl::Status status = runtime::CheckId("serial", request->serial()); !status.ok()) return ToGrpc(status);
  return Once(context, database_, "CreateBlade", *request, response,
              [&](Transaction& transaction) -> absl::StatusOr<storage::BladeRow> {
                const absl::StatusOr<std::string> part_id = runtime::IdOf("part", "parts", request->part());
                if (!part_id.ok()) return part_id.status();
                const absl::StatusOr<storage::PartRow> part =
                    Require(storage::FindPart(transaction, *part_id, 0), errors::v1::PART_NOT_FOUND, request->part());
                if (!part.ok()) return part.status();
                storage::RecordEntry entry = EntryFor(*context);
                entry.inputs = {request->part() + "@" + std::to_string(part->revision)};
                storage::BladeRow blade;
                blade.blade_serial = request->serial();
                blade.part_id = part->part_id;
                return storage::InsertBlade(transaction, std::move(blade), std::move(entry));
              });
}

grpc::Status PlantService::GetBlade(grpc::ServerContext* context, const v1::GetBladeRequest* request,
                                    v1::Blade* response) {
  return Get(context, database_, request->name(), RequireBlade, response);
}

grpc::Status PlantService::ListBlades(grpc::ServerContext* context, const v1::ListBladesRequest* request,
                                      v1::ListBladesResponse* response) {
  absl::StatusOr<Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  return ToGrpc(ListBladesIn(*transaction, *request, response));
}

grpc::Status PlantService::ListEndpoints(grpc::ServerContext*, const v1::ListEndpointsRequest*,
                                         v1::ListEndpointsResponse* response) {
  for (const auto& [area, address] : options_.endpoints) {
    v1::Endpoint* endpoint = response->add_endpoints();
    endpoint->set_area(area);
    endpoint->set_address(address);
  }
  response->set_software_version(runtime::SoftwareVersion());
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
