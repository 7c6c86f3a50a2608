// The work of Inspect: register the scans, see whether that can be trusted, fetch what the verdict rests on, and judge.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <utility>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/clients/scans.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "storage/inspections.h"

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

struct Caller {
  std::function<std::unique_ptr<grpc::ClientContext>()> context;  // for each call to another service
  std::function<bool()> keep_going;
  int threads = 2;
};

struct MadeInspection {
  storage::InspectionRow row;
  storage::RecordEntry entry;
};

// FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED; what the registration service refuses is passed on.
// INVALID_ARGUMENT for a scan of another blade or kind.
absl::StatusOr<MadeInspection> InspectBlade(const Peers& peers, const v1::InspectRequest& request,
                                            const Caller& caller);

}  // namespace sixpoint::inspection
