// Calls made again while a service is away or full, in one place for every client.
#pragma once

#include <absl/status/status.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace sixpoint::runtime {

// A random UUID (version 4): one per request, kept through its retries.
std::string NewRequestId();

// Away (restarting, connection lost), full, or it let another go first. Everything else is an answer.
bool IsWorthTryingAgain(const absl::Status& status);

struct RetryLimits {
  // How long a service may be away, or full, without any progress.
  double away_s = 60;
  double full_s = 60;
  // No attempt begins after this.
  std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();
  // Hears when a service does not answer, and when it does again; may be empty.
  std::function<void(const std::string&)> say;
};

// The pauses of one call that is made again; not thread-safe.
class Retry {
 public:
  // `service` is for what is said.
  Retry(std::string service, RetryLimits limits);
  // After an attempt that ended so. False: the status is what the caller gets. Else a growing pause has passed (less where
  // the channel, if there is one, connected before its end), and the call may be made again.
  bool TryAgain(const absl::Status& status, const std::shared_ptr<grpc::Channel>& channel);
  // The service did something for this call: patience and pauses begin anew.
  void Progressed();

 private:
  using Clock = std::chrono::steady_clock;
  void Say(const std::string& text) const;
  double AwaySeconds() const;

  const std::string service_;
  const RetryLimits limits_;
  std::optional<Clock::time_point> failing_since_;
  Clock::duration pause_;
};

}  // namespace sixpoint::runtime
