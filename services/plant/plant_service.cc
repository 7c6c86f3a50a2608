#include "services/plant/plant_service.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "services/plant/registry_calls.h"
#include "services/plant/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/clearance.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/work_order.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;

constexpr std::size_t kChunkBytes = std::size_t{1} << 20;

absl::Status ListBladesOf(const storage::BladeReader& reader, const grpc::ServerContext& context,
                          const v1::ListBladesRequest& request, v1::ListBladesResponse* response) {
  storage::BladeFilter filter;
  runtime::Refusals refusals;
  for (const auto& [field, collection, name, id] :
       {std::tuple("part", "parts", &request.part(), &filter.part_id),
        std::tuple("machine", "machines", &request.machine(), &filter.machine_id)}) {
    absl::StatusOr<std::string> read = runtime::FilterIdOf(field, collection, *name);
    refusals.Add(read.status());
    if (read.ok()) *id = *std::move(read);
  }
  for (const auto& [field, word] : {std::pair("verdict", &request.verdict()), std::pair("state", &request.state())})
    if (word->find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_") != std::string::npos)
      refusals.Add(runtime::Refuse(field, *word, "as entries of the journal have it: CONFORM, RELEASED, ..."));
  if (!refusals.status().ok()) return refusals.status();
  filter.serial_prefix = request.serial_prefix();
  filter.verdict = request.verdict();
  filter.state = request.state();
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  if (!recorded.ok()) return recorded.status();
  filter.recorded = *recorded;
  if (absl::Status status = runtime::CheckWorkOrder(request.work_order(), ""); !status.ok()) return status;
  filter.work_order = request.work_order();
  filter.reader = runtime::ReaderOf(context);
  const std::string filters = runtime::FiltersOf(request);
  const absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request.page_size(), request.page_token());
  if (!page.ok()) return page.status();
  const auto listed = reader.List(filter, page->after_id, page->size + 1, runtime::DeadlineOf(context));
  if (!listed.ok()) return listed.status();
  absl::Status added = AddIdPage(
      listed->blades, page->size, filters, [](const storage::BladeRow& row) { return ToProto(row); },
      response->mutable_blades(), response->mutable_next_page_token());
  if (!added.ok()) return added;
  if (response->next_page_token().empty() && !listed->looked_upto.empty())
    response->set_next_page_token(runtime::TokenAfterId(filters, listed->looked_upto));
  return absl::OkStatus();
}

}  // namespace

PlantService::PlantService(PlantServiceOptions options, storage::PlantStores stores)
    : options_(std::move(options)),
      stores_(std::move(stores)),
      surfaces_(options_.cad_worker, stores_.surfaces, options_.cad_worker_count) {}

grpc::Status PlantService::CreateMachine(grpc::ServerContext* context, const v1::CreateMachineRequest* request,
                                         v1::Machine* response) {
  absl::StatusOr<storage::MachineRow> machine = Validated(*request);
  if (!machine.ok()) return ToGrpc(machine.status());
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::MachineRow>> {
    return runtime::Made<storage::MachineRow>{*std::move(machine), NewEntry()};
  };
  return Once(context, stores_.machines.get(), "CreateMachine", *request, response, make);
}

grpc::Status PlantService::GetMachine(grpc::ServerContext* context, const v1::GetMachineRequest* request,
                                      v1::Machine* response) {
  return Get(Require(*stores_.machines, "machines", request->name(), errors::v1::MACHINE_NOT_FOUND,
                     runtime::DeadlineOf(*context)),
             response);
}

grpc::Status PlantService::ListMachines(grpc::ServerContext* context, const v1::ListMachinesRequest* request,
                                        v1::ListMachinesResponse* response) {
  return ToGrpc(ListNewest(*stores_.machines, *context, *request, response->mutable_machines(),
                           response->mutable_next_page_token()));
}

grpc::Status PlantService::CreateArtefact(grpc::ServerContext* context, const v1::CreateArtefactRequest* request,
                                          v1::Artefact* response) {
  absl::StatusOr<storage::ArtefactRow> artefact = Validated(*request);
  if (!artefact.ok()) return ToGrpc(artefact.status());
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::ArtefactRow>> {
    return runtime::Made<storage::ArtefactRow>{*std::move(artefact), NewEntry()};
  };
  return Once(context, stores_.artefacts.get(), "CreateArtefact", *request, response, make);
}

grpc::Status PlantService::GetArtefact(grpc::ServerContext* context, const v1::GetArtefactRequest* request,
                                       v1::Artefact* response) {
  return Get(Require(*stores_.artefacts, "artefacts", request->name(), errors::v1::ARTEFACT_NOT_FOUND,
                     runtime::DeadlineOf(*context)),
             response);
}

grpc::Status PlantService::ListArtefacts(grpc::ServerContext* context, const v1::ListArtefactsRequest* request,
                                         v1::ListArtefactsResponse* response) {
  return ToGrpc(ListNewest(*stores_.artefacts, *context, *request, response->mutable_artefacts(),
                           response->mutable_next_page_token()));
}

grpc::Status PlantService::CreatePart(grpc::ServerContext* context, const v1::CreatePartRequest* request,
                                      v1::Part* response) {
  absl::StatusOr<storage::PartRow> part = Validated(*request);
  if (!part.ok()) return ToGrpc(part.status());
  // Asked again when it is stored; here so that neither a retry nor an unreadable CAD file tells of it.
  absl::Status seen =
      runtime::CheckSeen(*stores_.clearances, runtime::ReaderOf(*context), "part_id", "parts/" + part->part_id,
                         storage::Unrecorded::kIsSeen, runtime::DeadlineOf(*context));
  if (!seen.ok()) return ToGrpc(seen);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::PartRow>> {
    absl::StatusOr<storage::TessellationRow> tessellation =
        surfaces_.Of(part->cad_format, part->cad_unit_mm, part->solid, request->cad(), runtime::DeadlineOf(*context),
                     runtime::KeepGoing(*context));
    if (!tessellation.ok()) return tessellation.status();
    part->tessellation = *std::move(tessellation);
    if (absl::Status status = CheckInsideBox(*part); !status.ok()) return status;
    if (absl::Status status = CheckStationsApart(*part); !status.ok()) return status;
    storage::RecordEntry entry = NewEntry();
    entry.method = part->tessellation.method;
    return runtime::Made<storage::PartRow>{*std::move(part), std::move(entry)};
  };
  return Once(context, stores_.parts.get(), "CreatePart", *request, response, make);
}

grpc::Status PlantService::GetPart(grpc::ServerContext* context, const v1::GetPartRequest* request,
                                   v1::Part* response) {
  return Get(
      Require(*stores_.parts, "parts", request->name(), errors::v1::PART_NOT_FOUND, runtime::DeadlineOf(*context)),
      response);
}

grpc::Status PlantService::ListParts(grpc::ServerContext* context, const v1::ListPartsRequest* request,
                                     v1::ListPartsResponse* response) {
  return ToGrpc(
      ListNewest(*stores_.parts, *context, *request, response->mutable_parts(), response->mutable_next_page_token()));
}

grpc::Status PlantService::DownloadSurface(grpc::ServerContext* context, const v1::DownloadSurfaceRequest* request,
                                           grpc::ServerWriter<v1::DownloadSurfaceResponse>* writer) {
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const absl::StatusOr<storage::PartRow> part =
      Require(*stores_.parts, "parts", request->name(), errors::v1::PART_NOT_FOUND, deadline);
  if (!part.ok()) return ToGrpc(part.status());
  const auto slot = downloads_.Enter(deadline, runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  const absl::StatusOr<std::string> bytes = stores_.surfaces->Bytes(part->tessellation.surface_sha256, deadline);
  if (!bytes.ok()) return ToGrpc(bytes.status());
  v1::DownloadSurfaceResponse response;
  for (std::size_t offset = 0; offset < bytes->size(); offset += kChunkBytes) {
    response.set_chunk(bytes->substr(offset, kChunkBytes));
    if (!writer->Write(response)) return ToGrpc(absl::CancelledError("the client went away or reads nothing"));
  }
  return grpc::Status::OK;
}

grpc::Status PlantService::CreateMachiningModel(grpc::ServerContext* context,
                                                const v1::CreateMachiningModelRequest* request,
                                                v1::MachiningModel* response) {
  absl::StatusOr<storage::MachiningModelRow> model = Validated(*request);
  if (!model.ok()) return ToGrpc(model.status());
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::MachiningModelRow>> {
    const absl::StatusOr<storage::PartRow> part =
        Require(stores_.parts->Find(model->part_id, 0, runtime::DeadlineOf(*context)), errors::v1::PART_NOT_FOUND,
                request->machining_model().part());
    if (!part.ok()) return part.status();
    if (absl::Status status = FitToPart(*part, request->machining_model(), &*model); !status.ok()) return status;
    model->part_revision = part->revision;
    runtime::Made<storage::MachiningModelRow> made{*std::move(model), NewEntry()};
    made.entry.inputs = {runtime::RevisedName("parts", part->part_id, part->revision)};
    return made;
  };
  return Once(context, stores_.machining_models.get(), "CreateMachiningModel", *request, response, make);
}

grpc::Status PlantService::GetMachiningModel(grpc::ServerContext* context, const v1::GetMachiningModelRequest* request,
                                             v1::MachiningModel* response) {
  return Get(Require(*stores_.machining_models, "machining_models", request->name(),
                     errors::v1::MACHINING_MODEL_NOT_FOUND, runtime::DeadlineOf(*context)),
             response);
}

grpc::Status PlantService::ListMachiningModels(grpc::ServerContext* context,
                                               const v1::ListMachiningModelsRequest* request,
                                               v1::ListMachiningModelsResponse* response) {
  return ToGrpc(ListNewest(*stores_.machining_models, *context, *request, response->mutable_machining_models(),
                           response->mutable_next_page_token()));
}

grpc::Status PlantService::CreateBlade(grpc::ServerContext* context, const v1::CreateBladeRequest* request,
                                       v1::Blade* response) {
  if (absl::Status status = runtime::CheckId("serial", request->serial()); !status.ok()) return ToGrpc(status);
  const absl::Status order = runtime::CheckWorkOrder(request->work_order(), request->operation());
  if (!order.ok()) return ToGrpc(order);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::BladeRow>> {
    const absl::StatusOr<std::string> part_id = runtime::IdOf("part", "parts", request->part());
    if (!part_id.ok()) return part_id.status();
    const absl::StatusOr<storage::PartRow> part = Require(
        stores_.parts->Find(*part_id, 0, runtime::DeadlineOf(*context)), errors::v1::PART_NOT_FOUND, request->part());
    if (!part.ok()) return part.status();
    runtime::Made<storage::BladeRow> made{{}, NewEntry()};
    made.row.blade_serial = request->serial();
    made.row.part_id = part->part_id;
    made.row.work_order = request->work_order();
    made.row.operation = request->operation();
    made.entry.inputs = {runtime::RevisedName("parts", part->part_id, part->revision)};
    return made;
  };
  return Once(context, stores_.blades.get(), "CreateBlade", *request, response, make);
}

grpc::Status PlantService::AssignWorkOrder(grpc::ServerContext* context, const v1::AssignWorkOrderRequest* request,
                                           v1::Blade* response) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("blade", "blades", request->blade());
  if (!serial.ok()) return ToGrpc(serial.status());
  if (request->work_order().empty())
    return ToGrpc(runtime::Refuse("work_order", "", "1 to 64 of A-Z, a-z, 0-9, '.', '_', ':', '/', '-'"));
  const absl::Status status = runtime::CheckWorkOrder(request->work_order(), request->operation());
  if (!status.ok()) return ToGrpc(status);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::BladeRow>> {
    const absl::StatusOr<storage::BladeRow> blade = Require(
        stores_.blades->Find(*serial, runtime::DeadlineOf(*context)), errors::v1::BLADE_NOT_FOUND, request->blade());
    if (!blade.ok()) return blade.status();
    runtime::Made<storage::BladeRow> made{*blade, NewEntry()};
    made.row.work_order = request->work_order();
    made.row.operation = request->operation();
    made.entry.inputs = {request->blade()};
    return made;
  };
  return Once(context, stores_.work_orders.get(), "AssignWorkOrder", *request, response, make);
}

grpc::Status PlantService::GetBlade(grpc::ServerContext* context, const v1::GetBladeRequest* request,
                                    v1::Blade* response) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", request->name());
  if (!serial.ok()) return ToGrpc(serial.status());
  return Get(Require(stores_.blades->Find(*serial, runtime::DeadlineOf(*context)), errors::v1::BLADE_NOT_FOUND,
                     request->name()),
             response);
}

grpc::Status PlantService::ListBlades(grpc::ServerContext* context, const v1::ListBladesRequest* request,
                                      v1::ListBladesResponse* response) {
  return ToGrpc(ListBladesOf(*stores_.blades, *context, *request, response));
}

grpc::Status PlantService::ListEndpoints(grpc::ServerContext*, const v1::ListEndpointsRequest*,
                                         v1::ListEndpointsResponse* response) {
  for (const auto& [area, address] : options_.endpoints) {
    v1::Endpoint* endpoint = response->add_endpoints();
    endpoint->set_area(area);
    endpoint->set_address(address);
  }
  response->set_software_version(runtime::SoftwareVersion());
  response->set_page_url(options_.page_url);
  return grpc::Status::OK;
}

}  // namespace sixpoint::plant
