// Many registrations in one call: a few at a time, each as if it had been asked for alone.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <functional>

#include "services/registration/inputs.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

// The batch's own fields, and that its requests leave to it what is the batch's. What a request asks for is left to Register.
absl::Status CheckBatch(const v1::RegisterBatchRequest& batch);

// The request at that index as Register gets it: with a request_id that follows from the batch's and the index.
v1::RegisterRequest RequestAt(const v1::RegisterBatchRequest& batch, int index);

using RegisterOne = std::function<absl::StatusOr<v1::Registration>(const v1::RegisterRequest&, const Caller&)>;
// False once the client is gone. Called on RunBatch's own thread only, so that a client that reads slowly holds up the batch,
// but no slot.
using SendResponse = std::function<bool(const v1::RegisterBatchResponse&)>;

struct BatchLimits {
  int blades_at_once = 2;  // one is fetched while the other is fitted; each holds a slot while it computes
  std::chrono::seconds longest_one{120};  // of several: one that hangs does not take all the batch's time
  double away_s = 20, full_s = 5;         // how long another service may be away, or full, before that is an answer
};

// OK once each is registered or refused. UNAVAILABLE: a service that they need stays away. DEADLINE_EXCEEDED, CANCELLED: the
// caller's. What was sent as registered is stored in any case.
absl::Status RunBatch(const v1::RegisterBatchRequest& batch, const Caller& caller, const RegisterOne& register_one,
                      const SendResponse& send, const BatchLimits& limits = {});

}  // namespace sixpoint::registration
