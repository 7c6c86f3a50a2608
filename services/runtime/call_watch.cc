#include "services/runtime/call_watch.h"

namespace sixpoint::runtime {
namespace {

constexpr std::chrono::milliseconds kRound{100};

}  // namespace

CallWatchdog::CallWatchdog() : thread_([this] { Watch(); }) {}

CallWatchdog::~CallWatchdog() {
  {
    std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  stopping_.notify_all();
  thread_.join();
}

void CallWatchdog::Watch() {
  std::unique_lock lock(mutex_);
  while (!stopping_.wait_for(lock, kRound, [this] { return stopped_; })) {
    const Clock::time_point now = Clock::now();
    for (Watched& watched : watched_) {
      const Clock::time_point touched{Clock::duration(watched.touched.load())};
      if (now >= watched.deadline || now >= touched + watched.patience) watched.context->TryCancel();
    }
  }
}

CallWatch::CallWatch(CallWatchdog* watchdog, grpc::ServerContextBase* context,
                     std::chrono::steady_clock::time_point deadline, std::chrono::milliseconds patience)
    : watchdog_(watchdog) {
  std::lock_guard lock(watchdog_->mutex_);
  watched_ = watchdog_->watched_.emplace(watchdog_->watched_.end());
  watched_->context = context;
  watched_->deadline = deadline;
  watched_->patience = patience;
  Touch();
}

CallWatch::~CallWatch() {
  std::lock_guard lock(watchdog_->mutex_);
  watchdog_->watched_.erase(watched_);
}

void CallWatch::Touch() { watched_->touched = CallWatchdog::Clock::now().time_since_epoch().count(); }

}  // namespace sixpoint::runtime
