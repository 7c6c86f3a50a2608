// What a process and its children hold, from /proc.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace sixpoint::bench {

std::int64_t PeakResidentBytes(pid_t pid);  // 0 where it is gone
std::vector<pid_t> ChildrenOf(pid_t pid);

// Looks every few milliseconds at the peaks of a process and of its children.
class MemoryWatch {
 public:
  explicit MemoryWatch(pid_t pid);
  ~MemoryWatch();
  std::int64_t process_bytes() const { return process_bytes_; }
  std::int64_t worst_child_bytes() const { return worst_child_bytes_; }

 private:
  void Look();
  const pid_t pid_;
  std::atomic<bool> stop_ = false;
  std::atomic<std::int64_t> process_bytes_ = 0, worst_child_bytes_ = 0;
  std::thread thread_;
};

}  // namespace sixpoint::bench
