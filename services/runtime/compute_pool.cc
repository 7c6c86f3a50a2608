#include "services/runtime/compute_pool.h"

#include <algorithm>

namespace sixpoint::runtime {
namespace {

// gRPC tells nobody that a call was cancelled: it has to be asked.
constexpr std::chrono::milliseconds kBetweenPoolQuestions{20};

}  // namespace

ComputePool::ComputePool(PoolLimits limits, std::string what, ErrorReason reason)
    : limits_({std::max(0, limits.at_once), std::max(0, limits.waiting)}),
      what_(std::move(what)),
      reason_(reason),
      running_gauge_("sixpoint_pool_running", "What runs at once in a pool.", {{"pool", what_}}),
      waiting_gauge_("sixpoint_pool_waiting", "What waits for its turn in a pool.", {{"pool", what_}}),
      wait_s_("sixpoint_pool_wait_seconds", "Time that work waited for its turn in a pool, in vain too.",
              UsualSeconds(), {{"pool", what_}}),
      refused_("sixpoint_pool_refused_total", "Work that a full pool refused at once.", {{"pool", what_}}) {
  Gauge("sixpoint_pool_slots", "What may run at once in a pool.", {{"pool", what_}}).Set(limits_.at_once);
}

absl::StatusOr<ComputePool::Slot> ComputePool::Enter(std::chrono::steady_clock::time_point deadline,
                                                     const std::function<bool()>& keep_going, Patience patience) {
  const auto asked = std::chrono::steady_clock::now();
  std::unique_lock<std::mutex> lock(mutex_);
  if (waiting_.empty() && running_ < limits_.at_once) {
    ++running_;
    running_gauge_.Add(1);
    wait_s_.Observe(0);
    return Slot(this);
  }
  if (patience == Patience::kBounded && bounded_count_ >= limits_.waiting) {
    refused_.Add();
    return Failure(reason_,
                   what_ + ": " + std::to_string(running_) + " are running and " + std::to_string(waiting_.size()) +
                       " wait, want fewer at once; try again",
                   {{"limit", std::to_string(limits_.at_once)}});
  }
  const auto before = usual_ * (waiting_.size() + 1) / std::max(1, limits_.at_once);
  if (patience == Patience::kBounded && asked + before + usual_ > deadline) {
    refused_.Add();
    return Failure(reason_,
                   what_ + ": " + std::to_string(running_) + " are running and " + std::to_string(waiting_.size()) +
                       " wait, too many to end before this call's deadline; try again",
                   {{"limit", std::to_string(limits_.at_once)}});
  }
  const int bounded = patience == Patience::kBounded ? 1 : 0;
  const auto self = waiting_.emplace(waiting_.end());
  bounded_count_ += bounded;
  waiting_gauge_.Add(1);
  absl::Status stopped;
  while (self != waiting_.begin() || running_ >= limits_.at_once) {
    self->turn.wait_until(lock, std::min(deadline, std::chrono::steady_clock::now() + kBetweenPoolQuestions));
    if (std::chrono::steady_clock::now() >= deadline) {
      stopped = absl::DeadlineExceededError(what_ + ": its time was over while it waited for its turn");
    } else if (keep_going && !keep_going()) {
      stopped = absl::CancelledError(what_ + ": stopped by its caller while it waited for its turn");
    }
    if (!stopped.ok()) break;
  }
  waiting_.erase(self);
  bounded_count_ -= bounded;
  waiting_gauge_.Add(-1);
  wait_s_.Observe(std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count());
  if (stopped.ok()) {
    ++running_;
    running_gauge_.Add(1);
  }
  WakeFirst();
  if (!stopped.ok()) return stopped;
  return Slot(this);
}

void ComputePool::Leave(std::chrono::steady_clock::time_point begin) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto held = std::chrono::steady_clock::now() - begin;
  usual_ = usual_.count() == 0 ? held : (usual_ * 7 + held) / 8;
  --running_;
  running_gauge_.Add(-1);
  WakeFirst();
}

void ComputePool::WakeFirst() {
  if (!waiting_.empty() && running_ < limits_.at_once) waiting_.front().turn.notify_one();
}

ComputePool::Use ComputePool::use() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return {running_, static_cast<int>(waiting_.size())};
}

}  // namespace sixpoint::runtime
