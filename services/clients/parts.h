// Machines, blades, parts and prepared surfaces, fetched from the plant service. Prepared surfaces are kept in a cache
// bounded by memory and shared between calls.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "metrology/surface/surface.h"
#include "services/clients/surface_cache.h"
#include "sixpoint/plant/v1/drawing.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/plant/v1/record.pb.h"

namespace sixpoint::clients {

// How far a start may be from its nominal: the tolerance of a radius; half of it of a diameter, or where a plant of the release before
// does not say.
double GreatestPositionError_mm(const plant::v1::HoleGroup& group);

// Thread-safe.
class PlantClient {
 public:
  // surface_bytes: the memory that prepared surfaces may take beyond those in use.
  explicit PlantClient(const std::shared_ptr<grpc::Channel>& plant, std::size_t surface_bytes = std::size_t{1} << 30);
  ~PlantClient();
  // revision 0: the newest.
  absl::StatusOr<plant::v1::Machine> GetMachine(const std::string& name, int revision,
                                                std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Artefact> GetArtefact(const std::string& name, int revision,
                                                  std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Part> GetPart(const std::string& name, int revision,
                                          std::unique_ptr<grpc::ClientContext> context) const;
  // name: with its revision, or without one the newest.
  absl::StatusOr<plant::v1::MachiningModel> GetMachiningModel(const std::string& name,
                                                              std::unique_ptr<grpc::ClientContext> context) const;
  // The first of the part's machining models by id, without its template; empty: it has none.
  absl::StatusOr<std::string> FirstMachiningModelOf(const std::string& part,
                                                    std::unique_ptr<grpc::ClientContext> context) const;
  // name: with its revision, or without one the newest.
  absl::StatusOr<plant::v1::Drawing> GetDrawing(const std::string& name,
                                                std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<plant::v1::Blade> GetBlade(const std::string& name,
                                            std::unique_ptr<grpc::ClientContext> context) const;
  // As the journal has it, of anything that was recorded.
  absl::StatusOr<plant::v1::RecordEntry> GetRecordEntry(const std::string& name,
                                                        std::unique_ptr<grpc::ClientContext> context) const;
  // A page of what rests on something.
  absl::StatusOr<plant::v1::RecallResponse> Recall(const plant::v1::RecallRequest& request,
                                                   std::unique_ptr<grpc::ClientContext> context) const;
  // Prepared once for all that ask for it; keep_going (may be empty) ends the wait for another call's preparation.
  absl::StatusOr<std::shared_ptr<const metrology::Surface>> GetSurface(
      const plant::v1::Part& part, std::unique_ptr<grpc::ClientContext> context,
      const std::function<bool()>& keep_going = nullptr) const;

 private:
  struct Stubs;  // as CalibrationClient's
  std::unique_ptr<const Stubs> stubs_;
  std::unique_ptr<SurfaceCache> surfaces_;
};

}  // namespace sixpoint::clients
