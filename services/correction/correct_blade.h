// The work of Correct: everything that it rests on, fetched and checked, and the correction made from it.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

struct Peers {
  explicit Peers(std::shared_ptr<grpc::Channel> plant_channel, std::shared_ptr<grpc::Channel> calibration_channel,
                 std::shared_ptr<grpc::Channel> registration_channel)
      : plant(std::move(plant_channel)),
        calibrations(std::move(calibration_channel)),
        registration(registration::v1::RegistrationService::NewStub(std::move(registration_channel))) {}
  clients::PlantClient plant;
  clients::CalibrationClient calibrations;
  std::unique_ptr<registration::v1::RegistrationService::Stub> registration;
};
// Makes the context of each call to another service.
using ContextFactory = std::function<std::unique_ptr<grpc::ClientContext>()>;

struct MadeCorrection {
  storage::CorrectionRow row;  // digests of template and program are left to the caller, who stores them
  std::string nc_program;
  storage::RecordEntry entry;
};

// FAILED_PRECONDITION with a reason: REGISTRATION_NOT_CONVERGED; CALIBRATION_EXPIRED where a calibration that the
// registration rests on is no longer in force or was superseded; KINEMATICS_UNSUPPORTED; POSE_SINGULAR;
// POSE_OUT_OF_LIMITS. INVALID_ARGUMENT for an unknown group or a template that cannot be replaced.
absl::StatusOr<MadeCorrection> CorrectBlade(const Peers& peers, const v1::CorrectRequest& request,
                                            const ContextFactory& context);

}  // namespace sixpoint::correction
