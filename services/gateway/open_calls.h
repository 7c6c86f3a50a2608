// The calls whose end gRPC has not told yet.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <vector>

namespace sixpoint::gateway {

// Thread-safe.
class OpenCalls {
 public:
  // cancel: makes gRPC tell its end soon; keeps the call.
  void Add(const void* call, std::function<void()> cancel) {
    const std::lock_guard<std::mutex> lock(mutex_);
    cancel_of_[call] = std::move(cancel);
  }
  // By what tells its end, as the last that it does.
  void Remove(const void* call) {
    std::function<void()> kept;  // may be the last that keeps the call: ends without the lock
    const std::lock_guard<std::mutex> lock(mutex_);
    kept.swap(cancel_of_[call]);
    cancel_of_.erase(call);
    if (cancel_of_.empty()) none_.notify_all();
  }
  // No call has anything to tell when this returns. A cancelled one ends at this computer, whatever its service does.
  void CancelAll() {
    std::vector<std::function<void()>> cancels;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      for (const auto& [call, cancel] : cancel_of_) cancels.push_back(cancel);
    }
    for (const auto& cancel : cancels) cancel();  // without the lock: gRPC may tell the end at once
    std::unique_lock<std::mutex> lock(mutex_);
    none_.wait(lock, [this] { return cancel_of_.empty(); });
  }

 private:
  std::mutex mutex_;
  std::condition_variable none_;
  std::map<const void*, std::function<void()>> cancel_of_;
};

}  // namespace sixpoint::gateway
