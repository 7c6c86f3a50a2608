#include "services/plant/plant_service.h"

#include <optional>
#include <utility>

#include "services/plant/plant_messages.h"
#include "services/plant/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
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

// One transaction that does the work once for each request_id, and keeps the answer with it.
template <typename Response, typename Request, typename Work>
grpc::Status Once(grpc::ServerContext* context, storage::Database* database, const char* method, const Request& request,
                  Response* response, Work work) {
  const auto run = [&]() -> absl::Status {
    if (absl::Status status = runtime::CheckUuid("request_id", request.request_id()); !status.ok()) return status;
    absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
    if (!transaction.ok()) return transaction.status();
    const std::string request_bytes = request.request_id().empty() ? "" : request.SerializeAsString();
    const absl::StatusOr<std::optional<std::string>> answered =
        storage::FindAnswer(*transaction, method, request.request_id(), request_bytes);
    if (!answered.ok()) return answered.status();
    if (*answered) {
      return response->ParseFromString(**answered) ? absl::OkStatus()
                                                   : absl::DataLossError("request_id: its kept answer is unreadable");
    }
    auto row = work(*transaction);
    if (!row.ok()) return row.status();
    *response = ToProto(*row);
    absl::Status status =
        storage::KeepAnswer(*transaction, method, request.request_id(), request_bytes, response->SerializeAsString());
    return status.ok() ? transaction->Commit() : status;
  };
  return ToGrpc(run());
}

// NOT_FOUND with a reason where `found` holds nothing.
template <typename Row>
absl::StatusOr<Row> Require(absl::StatusOr<std::optional<Row>> found, runtime::ErrorReason reason,
                            const std::string& name, int revision) {
  if (!found.ok()) return found.status();
  if (*found) return **std::move(found);
  if (revision == 0)
    return runtime::Failure(reason, "name: " + name + ", want one that is registered", {{"resource", name}});
  return runtime::Failure(reason, "revision: " + std::to_string(revision) + ", want one that " + name + " has",
                          {{"resource", name}, {"revision", std::to_string(revision)}});
}

absl::StatusOr<storage::MachineRow> RequireMachine(Transaction& transaction, const std::string& name, int revision) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "machines", name);
  if (!id.ok()) return id.status();
  return Require(storage::FindMachine(transaction, *id, revision), errors::v1::MACHINE_NOT_FOUND, name, revision);
}

absl::StatusOr<storage::ArtefactRow> RequireArtefact(Transaction& transaction, const std::string& name, int revision) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "artefacts", name);
  if (!id.ok()) return id.status();
  return Require(storage::FindArtefact(transaction, *id, revision), errors::v1::ARTEFACT_NOT_FOUND, name, revision);
}

absl::StatusOr<storage::PartRow> RequirePart(Transaction& transaction, const std::string& field,
                                             const std::string& name, int revision) {
  const absl::StatusOr<std::string> id = runtime::IdOf(field, "parts", name);
  if (!id.ok()) return id.status();
  return Require(storage::FindPart(transaction, *id, revision), errors::v1::PART_NOT_FOUND, name, revision);
}

absl::StatusOr<storage::BladeRow> RequireBlade(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", name);
  if (!serial.ok()) return serial.status();
  return Require(storage::FindBlade(transaction, *serial), errors::v1::BLADE_NOT_FOUND, name, 0);
}

// A read of one revision.
template <typename Request, typename Response, typename Find>
grpc::Status Get(grpc::ServerContext* context, storage::Database* database, const Request& request, Response* response,
                 Find find) {
  if (absl::Status status = CheckRevision(request.revision()); !status.ok()) return ToGrpc(status);
  absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  auto row = find(*transaction);
  if (!row.ok()) return ToGrpc(row.status());
  *response = ToProto(*row);
  return grpc::Status::OK;
}

// A page of ids, each with its newest revision. `add` takes the id; the page after begins behind the last one added.
template <typename Request, typename Response, typename Add>
grpc::Status List(grpc::ServerContext* context, storage::Database* database, const Request& request,
                  storage::Registered what, Response* response, Add add) {
  const absl::StatusOr<Page> page = ValidatedPage(request.page_size(), request.page_token());
  if (!page.ok()) return ToGrpc(page.status());
  absl::StatusOr<Transaction> transaction = database->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  absl::StatusOr<std::vector<std::string>> ids =
      storage::ListRegistered(*transaction, what, page->after, page->size + 1);
  if (!ids.ok()) return ToGrpc(ids.status());
  if (static_cast<int>(ids->size()) > page->size) {
    ids->pop_back();
    response->set_next_page_token(ids->back());
  }
  for (const std::string& id : *ids) {
    if (absl::Status status = add(*transaction, id); !status.ok()) return ToGrpc(status);
  }
  return grpc::Status::OK;
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
    return storage::InsertMachine(transaction, *std::move(machine), EntryFor(*context));
  });
}

grpc::Status PlantService::GetMachine(grpc::ServerContext* context, const v1::GetMachineRequest* request,
                                      v1::Machine* response) {
  return Get(context, database_, *request, response, [&](Transaction& transaction) {
    return RequireMachine(transaction, request->name(), request->revision());
  });
}

grpc::Status PlantService::ListMachines(grpc::ServerContext* context, const v1::ListMachinesRequest* request,
                                        v1::ListMachinesResponse* response) {
  return List(context, database_, *request, storage::Registered::kMachines, response,
              [&](Transaction& transaction, const std::string& id) {
                auto row = RequireMachine(transaction, "machines/" + id, 0);
                if (row.ok()) *response->add_machines() = ToProto(*row);
                return row.status();
              });
}

grpc::Status PlantService::CreateArtefact(grpc::ServerContext* context, const v1::CreateArtefactRequest* request,
                                          v1::Artefact* response) {
  absl::StatusOr<storage::ArtefactRow> artefact = Validated(*request);
  if (!artefact.ok()) return ToGrpc(artefact.status());
  return Once(context, database_, "CreateArtefact", *request, response, [&](Transaction& transaction) {
    return storage::InsertArtefact(transaction, *std::move(artefact), EntryFor(*context));
  });
}

grpc::Status PlantService::GetArtefact(grpc::ServerContext* context, const v1::GetArtefactRequest* request,
                                       v1::Artefact* response) {
  return Get(context, database_, *request, response, [&](Transaction& transaction) {
    return RequireArtefact(transaction, request->name(), request->revision());
  });
}

grpc::Status PlantService::ListArtefacts(grpc::ServerContext* context, const v1::ListArtefactsRequest* request,
                                         v1::ListArtefactsResponse* response) {
  return List(context, database_, *request, storage::Registered::kArtefacts, response,
              [&](Transaction& transaction, const std::string& id) {
                auto row = RequireArtefact(transaction, "artefacts/" + id, 0);
                if (row.ok()) *response->add_artefacts() = ToProto(*row);
                return row.status();
              });
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
    return storage::InsertPart(transaction, *std::move(part), std::move(entry));
  });
}

grpc::Status PlantService::GetPart(grpc::ServerContext* context, const v1::GetPartRequest* request,
                                   v1::Part* response) {
  return Get(context, database_, *request, response, [&](Transaction& transaction) {
    return RequirePart(transaction, "name", request->name(), request->revision());
  });
}

grpc::Status PlantService::ListParts(grpc::ServerContext* context, const v1::ListPartsRequest* request,
                                     v1::ListPartsResponse* response) {
  return List(context, database_, *request, storage::Registered::kParts, response,
              [&](Transaction& transaction, const std::string& id) {
                auto row = RequirePart(transaction, "name", "parts/" + id, 0);
                if (row.ok()) *response->add_parts() = ToProto(*row);
                return row.status();
              });
}

grpc::Status PlantService::DownloadSurface(grpc::ServerContext* context, const v1::DownloadSurfaceRequest* request,
                                           grpc::ServerWriter<v1::DownloadSurfaceResponse>* writer) {
  if (absl::Status status = CheckRevision(request->revision()); !status.ok()) return ToGrpc(status);
  const auto read = [&]() -> absl::StatusOr<std::string> {
    absl::StatusOr<Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<storage::PartRow> part =
        RequirePart(*transaction, "name", request->name(), request->revision());
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
                const absl::StatusOr<storage::PartRow> part = RequirePart(transaction, "part", request->part(), 0);
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
  absl::StatusOr<Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  const absl::StatusOr<storage::BladeRow> blade = RequireBlade(*transaction, request->name());
  if (!blade.ok()) return ToGrpc(blade.status());
  *response = ToProto(*blade);
  return grpc::Status::OK;
}

grpc::Status PlantService::ListBlades(grpc::ServerContext* context, const v1::ListBladesRequest* request,
                                      v1::ListBladesResponse* response) {
  const absl::StatusOr<Page> page = ValidatedPage(request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  absl::StatusOr<Transaction> transaction = database_->Begin(runtime::DeadlineOf(*context));
  if (!transaction.ok()) return ToGrpc(transaction.status());
  absl::StatusOr<std::vector<storage::BladeRow>> blades =
      storage::ListBlades(*transaction, page->after, page->size + 1);
  if (!blades.ok()) return ToGrpc(blades.status());
  if (static_cast<int>(blades->size()) > page->size) {
    blades->pop_back();
    response->set_next_page_token(blades->back().blade_serial);
  }
  for (const storage::BladeRow& blade : *blades) *response->add_blades() = ToProto(blade);
  return grpc::Status::OK;
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
