// The services' own kernels on what the services fetch, without the services: what a registration and a correction cost at least.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::bench {

struct Channels {
  std::shared_ptr<grpc::Channel> plant, ingest, calibration, registration;
};

struct RegistrationTimes {
  double decode_s = 0;  // and thin
  double fit_s = 0;
};

// Ends the program with 2 where something fails.
class BareRegistration {
 public:
  explicit BareRegistration(const Channels& channels);
  ~BareRegistration();
  RegistrationTimes Run(const registration::v1::RegisterRequest& request) const;

 private:
  struct Parts;
  const std::unique_ptr<const Parts> parts_;
};

// Seconds to solve, write, read back and prove, and of what its gate computes.
double BareCorrection_s(const Channels& channels, const correction::v1::CorrectRequest& request);

}  // namespace sixpoint::bench
