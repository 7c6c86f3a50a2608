// Bounds what runs at once in a server: more is refused at once, not queued.
#pragma once

#include <absl/status/status.h>

#include <atomic>
#include <string>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {

class ComputeSlot {
 public:
  // The counter is the service's; the limit is the greatest number that may hold a slot.
  ComputeSlot(std::atomic<int>* running, int limit)
      : running_(running), limit_(limit), taken_(running->fetch_add(1) < limit) {}
  ~ComputeSlot() { --*running_; }
  ComputeSlot(const ComputeSlot&) = delete;
  ComputeSlot& operator=(const ComputeSlot&) = delete;

  // RESOURCE_EXHAUSTED when there was none left; what: uploads, calibrations, ... and their reason, UPLOADS_FULL, ...
  absl::Status Check(const std::string& what, const std::string& reason) const {
    if (taken_) return absl::OkStatus();
    return Failure(absl::StatusCode::kResourceExhausted, reason,
                   what + ": " + std::to_string(limit_) + " are running, want fewer at once; try again");
  }

 private:
  std::atomic<int>* const running_;
  const int limit_;
  const bool taken_;
};

}  // namespace sixpoint::runtime
