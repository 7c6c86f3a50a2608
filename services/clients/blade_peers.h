// The services that a registered blade is fetched from.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/clients/registrations.h"
#include "services/clients/scans.h"

namespace sixpoint::clients {

struct BladePeers {
  BladePeers(const std::shared_ptr<grpc::Channel>& plant_channel, const std::shared_ptr<grpc::Channel>& ingest_channel,
             const std::shared_ptr<grpc::Channel>& calibration_channel,
             const std::shared_ptr<grpc::Channel>& registration_channel)
      : plant(plant_channel),
        scans(ingest_channel),
        calibrations(calibration_channel),
        registrations(registration_channel) {}
  PlantClient plant;
  ScanClient scans;
  CalibrationClient calibrations;
  RegistrationClient registrations;
};

}  // namespace sixpoint::clients
