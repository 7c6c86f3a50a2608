// Machines, blades, parts and prepared surfaces, fetched from the plant service. Prepared surfaces are kept in a cache
// bounded by memory and shared between calls.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <mutex>
#include <string>

#include "metrology/surface/surface.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::clients {

// Thread-safe.
class PlantClient {
 public:
  explicit PlantClient(std::shared_ptr<grpc::Channel> plant);
  ~PlantClient();
  // revision 0: the newest.
  absl::StatusOr<plant::v1::Machine> GetMachine(const std::string& name, int revision,
                                                std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Artefact> GetArtefact(const std::string& name, int revision,
                                                  std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Part> GetPart(const std::string& name, int revision,
                                          std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Blade> GetBlade(const std::string& name,
                                            std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<std::shared_ptr<const metrology::Surface>> GetSurface(
      const plant::v1::Part& part, std::unique_ptr<grpc::ClientContext> context) const;

 private:
  std::unique_ptr<plant::v1::PlantService::Stub> stub_;
  struct Cache;
  std::unique_ptr<Cache> cache_;
};

}  // namespace sixpoint::clients
