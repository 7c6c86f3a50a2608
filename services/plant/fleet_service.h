// The machines of a plant as they stand, and what each did hour by hour.
#pragma once

#include <memory>
#include <utility>

#include "sixpoint/plant/v1/fleet.grpc.pb.h"
#include "storage/clearances.h"
#include "storage/fleet.h"

namespace sixpoint::plant {

class FleetService final : public v1::FleetService::Service {
 public:
  FleetService(std::shared_ptr<const storage::FleetReader> fleet,
               std::shared_ptr<const storage::ClearanceReader> clearances)
      : fleet_(std::move(fleet)), clearances_(std::move(clearances)) {}

  grpc::Status ListMachineStates(grpc::ServerContext* context, const v1::ListMachineStatesRequest* request,
                                 v1::ListMachineStatesResponse* response) override;
  grpc::Status GetMachineActivity(grpc::ServerContext* context, const v1::GetMachineActivityRequest* request,
                                  v1::MachineActivity* response) override;

 private:
  const std::shared_ptr<const storage::FleetReader> fleet_;
  const std::shared_ptr<const storage::ClearanceReader> clearances_;
};

}  // namespace sixpoint::plant
