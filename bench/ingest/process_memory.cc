#include "bench/ingest/process_memory.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

namespace sixpoint::bench {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{5};

// A child between fork and exec still shows its parent's memory.
bool HasItsOwnProgram(pid_t child, pid_t parent) {
  std::error_code gone;
  const auto program = [&gone](pid_t pid) {
    return std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/exe", gone);
  };
  return program(child) != program(parent);
}

}  // namespace

std::int64_t PeakResidentBytes(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) == 0) return std::stoll(line.substr(6)) * 1024;
  }
  return 0;
}

std::vector<pid_t> ChildrenOf(pid_t pid) {
  std::vector<pid_t> children;
  std::error_code gone;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task", gone)) {
    std::ifstream list(task.path() / "children");
    for (pid_t child = 0; list >> child;) children.push_back(child);
  }
  return children;
}

MemoryWatch::MemoryWatch(pid_t pid) : pid_(pid), thread_([this] { Look(); }) {}

MemoryWatch::~MemoryWatch() {
  stop_ = true;
  thread_.join();
}

void MemoryWatch::Look() {
  while (!stop_) {
    process_bytes_ = std::max<std::int64_t>(process_bytes_, PeakResidentBytes(pid_));
    for (const pid_t child : ChildrenOf(pid_)) {
      if (!HasItsOwnProgram(child, pid_)) continue;
      worst_child_bytes_ = std::max<std::int64_t>(worst_child_bytes_, PeakResidentBytes(child));
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

}  // namespace sixpoint::bench
