// The caller's wish to go on, for threads that ask at once: one question at a time, none after the first no.
#pragma once

#include <functional>
#include <mutex>

namespace sixpoint::metrology {

class KeepGoing {
 public:
  // An empty function never stops. It stays where it is while this lives.
  explicit KeepGoing(const std::function<bool()>& ask) : ask_(ask) {}
  bool operator()() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!stopped_ && ask_ && !ask_()) stopped_ = true;
    return !stopped_;
  }
  bool stopped() const { return stopped_; }  // once the threads are done

 private:
  const std::function<bool()>& ask_;
  std::mutex mutex_;
  bool stopped_ = false;
};

}  // namespace sixpoint::metrology
