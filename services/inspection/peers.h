// The services that an inspection asks.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::inspection {

struct Peers {
  Peers(std::shared_ptr<grpc::Channel> plant_channel, std::shared_ptr<grpc::Channel> ingest_channel,
        std::shared_ptr<grpc::Channel> calibration_channel, std::shared_ptr<grpc::Channel> registration_channel)
      : plant(std::move(plant_channel)),
        scans(ingest_channel),
        scan_records(ingest::v1::ScanService::NewStub(std::move(ingest_channel))),
        calibrations(std::move(calibration_channel)),
        registration(registration::v1::RegistrationService::NewStub(std::move(registration_channel))) {}
  clients::PlantClient plant;
  clients::ScanClient scans;
  std::unique_ptr<ingest::v1::ScanService::Stub> scan_records;
  clients::CalibrationClient calibrations;
  std::unique_ptr<registration::v1::RegistrationService::Stub> registration;
};

}  // namespace sixpoint::inspection
