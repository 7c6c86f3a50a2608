// So many lines a second of what strangers can cause: nobody rolls the log away. Private to runtime.
#pragma once

#include <chrono>
#include <mutex>
#include <utility>

namespace sixpoint::runtime {

// Thread-safe.
class LineBudget {
 public:
  // False: this one is left out.
  bool Take() {
    constexpr int kLinesASecond = 5;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (const auto now = std::chrono::steady_clock::now(); now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      lines_ = 0;
    }
    if (++lines_ <= kLinesASecond) return true;
    ++left_out_count_;
    return false;
  }
  // Since it was asked last.
  long TakeLeftOut() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(left_out_count_, 0);
  }

 private:
  std::mutex mutex_;
  std::chrono::steady_clock::time_point second_;
  int lines_ = 0;
  long left_out_count_ = 0;
};

}  // namespace sixpoint::runtime
