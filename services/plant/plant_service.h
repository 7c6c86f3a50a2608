// The plant's registry.
#pragma once

#include <map>
#include <string>

#include "services/plant/surfaces.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {

struct PlantServiceOptions {
  CadWorkerOptions cad_worker;
  int cad_worker_count = 2;
  std::string page_url;                          // where people find the page; empty: nowhere
  std::map<std::string, std::string> endpoints;  // area -> address, the plant's own included
};

class PlantService final : public v1::PlantService::Service {
 public:
  PlantService(PlantServiceOptions options, storage::PlantStores stores);

  grpc::Status CreateMachine(grpc::ServerContext* context, const v1::CreateMachineRequest* request,
                             v1::Machine* response) override;
  grpc::Status GetMachine(grpc::ServerContext* context, const v1::GetMachineRequest* request,
                          v1::Machine* response) override;
  grpc::Status ListMachines(grpc::ServerContext* context, const v1::ListMachinesRequest* request,
                            v1::ListMachinesResponse* response) override;

  grpc::Status CreateArtefact(grpc::ServerContext* context, const v1::CreateArtefactRequest* request,
                              v1::Artefact* response) override;
  grpc::Status GetArtefact(grpc::ServerContext* context, const v1::GetArtefactRequest* request,
                           v1::Artefact* response) override;
  grpc::Status ListArtefacts(grpc::ServerContext* context, const v1::ListArtefactsRequest* request,
                             v1::ListArtefactsResponse* response) override;

  grpc::Status CreatePart(grpc::ServerContext* context, const v1::CreatePartRequest* request,
                          v1::Part* response) override;
  grpc::Status GetPart(grpc::ServerContext* context, const v1::GetPartRequest* request, v1::Part* response) override;
  grpc::Status ListParts(grpc::ServerContext* context, const v1::ListPartsRequest* request,
                         v1::ListPartsResponse* response) override;
  grpc::Status DownloadSurface(grpc::ServerContext* context, const v1::DownloadSurfaceRequest* request,
                               grpc::ServerWriter<v1::DownloadSurfaceResponse>* writer) override;

  grpc::Status CreateMachiningModel(grpc::ServerContext* context, const v1::CreateMachiningModelRequest* request,
                                    v1::MachiningModel* response) override;
  grpc::Status GetMachiningModel(grpc::ServerContext* context, const v1::GetMachiningModelRequest* request,
                                 v1::MachiningModel* response) override;
  grpc::Status ListMachiningModels(grpc::ServerContext* context, const v1::ListMachiningModelsRequest* request,
                                   v1::ListMachiningModelsResponse* response) override;

  grpc::Status CreateBlade(grpc::ServerContext* context, const v1::CreateBladeRequest* request,
                           v1::Blade* response) override;
  grpc::Status AssignWorkOrder(grpc::ServerContext* context, const v1::AssignWorkOrderRequest* request,
                               v1::Blade* response) override;
  grpc::Status GetBlade(grpc::ServerContext* context, const v1::GetBladeRequest* request, v1::Blade* response) override;
  grpc::Status ListBlades(grpc::ServerContext* context, const v1::ListBladesRequest* request,
                          v1::ListBladesResponse* response) override;

  grpc::Status ListEndpoints(grpc::ServerContext* context, const v1::ListEndpointsRequest* request,
                             v1::ListEndpointsResponse* response) override;

  const Surfaces& surfaces() const { return surfaces_; }

 private:
  const PlantServiceOptions options_;
  const storage::PlantStores stores_;
  Surfaces surfaces_;
  // Each holds a whole surface.
  static constexpr int kDownloadsAtOnce = 8, kDownloadsWaiting = 32;
  runtime::ComputePool downloads_{
      {kDownloadsAtOnce, kDownloadsWaiting}, "downloads of surfaces", errors::v1::DOWNLOADS_FULL};
};

}  // namespace sixpoint::plant
