#include "services/runtime/retry.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <random>
#include <thread>
#include <utility>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr std::chrono::milliseconds kFirstPause{100};
constexpr std::chrono::milliseconds kLongestPause{2000};

}  // namespace

std::string NewRequestId() {
  std::random_device device;
  const auto word = [&] { return (static_cast<std::uint64_t>(device()) << 32) | device(); };
  const std::uint64_t high = (word() & ~0xf000ull) | 0x4000ull;
  const std::uint64_t low = (word() & ~(3ull << 62)) | (1ull << 63);
  char text[40];
  std::snprintf(text, sizeof text, "%08llx-%04llx-%04llx-%04llx-%012llx", static_cast<unsigned long long>(high >> 32),
                static_cast<unsigned long long>(high >> 16 & 0xffff), static_cast<unsigned long long>(high & 0xffff),
                static_cast<unsigned long long>(low >> 48), static_cast<unsigned long long>(low & 0xffffffffffffull));
  return text;
}

bool IsWorthTryingAgain(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsResourceExhausted(status) || absl::IsAborted(status);
}

Retry::Retry(std::string service, RetryLimits limits)
    : service_(std::move(service)), limits_(std::move(limits)), pause_(kFirstPause) {}

void Retry::Say(const std::string& text) const {
  if (limits_.say) limits_.say(service_ + text);
}

double Retry::AwaySeconds() const { return std::chrono::duration<double>(Clock::now() - *failing_since_).count(); }

bool Retry::TryAgain(const absl::Status& status, const std::shared_ptr<grpc::Channel>& channel) {
  if (!IsWorthTryingAgain(status)) {
    Progressed();
    return false;
  }
  const bool first = !failing_since_.has_value();
  if (first) failing_since_ = Clock::now();
  const Clock::duration pause = std::max<Clock::duration>(pause_, RetryDelayOf(status));
  const double patience_s = absl::IsResourceExhausted(status) ? limits_.full_s : limits_.away_s;
  if (AwaySeconds() + std::chrono::duration<double>(pause).count() > patience_s ||
      limits_.deadline - std::chrono::steady_clock::now() < pause) {
    char after[40];
    std::snprintf(after, sizeof after, " did not answer after %.1f s", AwaySeconds());
    Say(after);
    return false;
  }
  if (first) Say(" is away or full (" + std::string(status.message()) + "), trying again");
  // A synchronous gRPC client makes progress on a connection only while a thread waits for something on it (else at a
  // backup poll every 5 s): so the pause is spent waiting for the connection, where that is what is missing.
  if (channel == nullptr || channel->GetState(true) == GRPC_CHANNEL_READY) {
    std::this_thread::sleep_for(pause);
  } else {
    channel->WaitForConnected(std::chrono::system_clock::now() +
                              std::chrono::duration_cast<std::chrono::milliseconds>(pause));
  }
  pause_ = std::min<Clock::duration>(2 * pause_, kLongestPause);
  return true;
}

void Retry::Progressed() {
  if (failing_since_.has_value()) {
    char after[40];
    std::snprintf(after, sizeof after, " is back after %.1f s", AwaySeconds());
    Say(after);
  }
  failing_since_.reset();
  pause_ = kFirstPause;
}

}  // namespace sixpoint::runtime
