#include "services/clients/parts.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "metrology/mesh/mesh_bytes.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"

namespace sixpoint::clients {
namespace {

constexpr std::size_t kGreatestSurfaceBytes = std::size_t{512} << 20;

// As the journal writes it: parts/p1@3.
std::string Revised(const std::string& name, int revision) {
  return revision == 0 ? name : name + "@" + std::to_string(revision);
}

absl::StatusOr<std::string> Download(plant::v1::PlantService::Stub& stub, const plant::v1::Part& part,
                                     grpc::ClientContext* context) {
  plant::v1::DownloadSurfaceRequest request;
  request.set_name(Revised(part.name(), part.revision()));
  std::unique_ptr<grpc::ClientReader<plant::v1::DownloadSurfaceResponse>> reader =
      stub.DownloadSurface(context, request);
  std::string bytes;
  plant::v1::DownloadSurfaceResponse response;
  while (reader->Read(&response)) {
    if (bytes.size() + response.chunk().size() > kGreatestSurfaceBytes) {
      context->TryCancel();
      reader->Finish();
      return runtime::Failure(errors::v1::SURFACE_TOO_LARGE,
                              part.name() + ".surface: more than 512 MiB, want a smaller one",
                              {{"resource", part.name()}});
    }
    bytes += response.chunk();
  }
  if (const absl::Status status = runtime::FromGrpc(reader->Finish()); !status.ok()) return status;
  return bytes;
}

}  // namespace

double GreatestPositionError_mm(const plant::v1::HoleGroup& group) {
  return group.position_zone() == plant::v1::POSITION_ZONE_RADIUS ? group.position_tolerance_mm()
                                                                  : group.position_tolerance_mm() / 2;
}

struct PlantClient::Stubs {
  std::unique_ptr<plant::v1::PlantService::Stub> plant;
  std::unique_ptr<plant::v1::DrawingService::Stub> drawings;
  std::unique_ptr<plant::v1::RecordService::Stub> record;
};

PlantClient::PlantClient(const std::shared_ptr<grpc::Channel>& plant, std::size_t surface_bytes)
    : stubs_(new Stubs{plant::v1::PlantService::NewStub(plant), plant::v1::DrawingService::NewStub(plant),
                       plant::v1::RecordService::NewStub(plant)}),
      surfaces_(std::make_unique<SurfaceCache>(surface_bytes)) {}
PlantClient::~PlantClient() = default;

absl::StatusOr<plant::v1::Machine> PlantClient::GetMachine(const std::string& name, int revision,
                                                           std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetMachineRequest request;
  request.set_name(Revised(name, revision));
  plant::v1::Machine machine;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->GetMachine(context.get(), request, &machine));
  if (!status.ok()) return status;
  return machine;
}

absl::StatusOr<plant::v1::Artefact> PlantClient::GetArtefact(const std::string& name, int revision,
                                                             std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetArtefactRequest request;
  request.set_name(Revised(name, revision));
  plant::v1::Artefact artefact;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->GetArtefact(context.get(), request, &artefact));
  if (!status.ok()) return status;
  return artefact;
}

absl::StatusOr<plant::v1::Part> PlantClient::GetPart(const std::string& name, int revision,
                                                     std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetPartRequest request;
  request.set_name(Revised(name, revision));
  plant::v1::Part part;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->GetPart(context.get(), request, &part));
  if (!status.ok()) return status;
  return part;
}

absl::StatusOr<plant::v1::MachiningModel> PlantClient::GetMachiningModel(
    const std::string& name, std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetMachiningModelRequest request;
  request.set_name(name);
  plant::v1::MachiningModel model;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->GetMachiningModel(context.get(), request, &model));
  if (!status.ok()) return status;
  return model;
}

absl::StatusOr<plant::v1::Drawing> PlantClient::GetDrawing(const std::string& name,
                                                           std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetDrawingRequest request;
  request.set_name(name);
  plant::v1::Drawing drawing;
  const absl::Status status = runtime::FromGrpc(stubs_->drawings->GetDrawing(context.get(), request, &drawing));
  if (!status.ok()) return status;
  return drawing;
}

absl::StatusOr<std::string> PlantClient::FirstMachiningModelOf(const std::string& part,
                                                               std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::ListMachiningModelsRequest request;
  request.set_part(part);
  request.set_page_size(1);
  plant::v1::ListMachiningModelsResponse page;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->ListMachiningModels(context.get(), request, &page));
  if (!status.ok()) return status;
  return page.machining_models_size() == 0 ? "" : page.machining_models(0).name();
}

absl::StatusOr<plant::v1::Blade> PlantClient::GetBlade(const std::string& name,
                                                       std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetBladeRequest request;
  request.set_name(name);
  plant::v1::Blade blade;
  const absl::Status status = runtime::FromGrpc(stubs_->plant->GetBlade(context.get(), request, &blade));
  if (!status.ok()) return status;
  return blade;
}

absl::StatusOr<plant::v1::RecordEntry> PlantClient::GetRecordEntry(const std::string& name,
                                                                   std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::GetRecordEntryRequest request;
  request.set_name(name);
  plant::v1::RecordEntry entry;
  const absl::Status status = runtime::FromGrpc(stubs_->record->GetRecordEntry(context.get(), request, &entry));
  if (!status.ok()) return status;
  return entry;
}

absl::StatusOr<plant::v1::RecallResponse> PlantClient::Recall(const plant::v1::RecallRequest& request,
                                                              std::unique_ptr<grpc::ClientContext> context) const {
  plant::v1::RecallResponse response;
  const absl::Status status = runtime::FromGrpc(stubs_->record->Recall(context.get(), request, &response));
  if (!status.ok()) return status;
  return response;
}

absl::StatusOr<std::shared_ptr<const metrology::Surface>> PlantClient::GetSurface(
    const plant::v1::Part& part, std::unique_ptr<grpc::ClientContext> context,
    const std::function<bool()>& keep_going) const {
  const std::string& sha256 = part.surface().surface_sha256();
  if (sha256.empty()) return runtime::Refuse("part.surface.surface_sha256", "", "a part as the plant service gave it");
  return surfaces_->Get(sha256, runtime::DeadlineOf(*context), keep_going, [&]() -> SurfaceCache::SurfaceOr {
    absl::StatusOr<metrology::TriangleMesh> mesh = [&]() -> absl::StatusOr<metrology::TriangleMesh> {
      const absl::StatusOr<std::string> bytes = Download(*stubs_->plant, part, context.get());
      if (!bytes.ok()) return bytes.status();
      return metrology::MeshFromBytes(*bytes);
    }();
    if (!mesh.ok()) return mesh.status();
    return metrology::Surface::Prepare(*std::move(mesh));
  });
}

}  // namespace sixpoint::clients
