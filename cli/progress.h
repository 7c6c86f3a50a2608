// What a command is at, told on stderr: one line that changes where that is a terminal, a plain line now and then elsewhere, and
// nothing where the results go to a program (--json).
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

namespace sixpoint::cli {

// Thread-safe.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet);
  ~ProgressLine() { Clear(); }
  // In place of what was shown. Where stderr is no terminal, only if nothing was printed for some seconds.
  void Show(const std::string& text);
  // Leaves a terminal's line empty.
  void Clear();
  // A line that stays.
  void Keep(const std::string& text);

 private:
  const bool quiet_;
  const bool terminal_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point printed_;
  bool shown_ = false;  // the terminal's line holds something
};

// Counts up to a total that is known. Thread-safe.
class Progress {
 public:
  // unit: what is counted, e.g. "points".
  Progress(std::string label, std::string unit, std::int64_t total, bool quiet);
  // Says how far it came.
  ~Progress();
  void Add(std::int64_t count);

 private:
  std::string ToText() const;
  const std::string label_;
  const std::string unit_;
  const std::int64_t total_;
  const std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point told_;
  std::int64_t count_ = 0;
  ProgressLine line_;
};

// Tells for how long a call has been at work whose end cannot be foretold.
class Elapsed {
 public:
  Elapsed(std::string label, bool quiet);
  ~Elapsed();

 private:
  ProgressLine line_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool over_ = false;
  std::thread ticking_;
};

}  // namespace sixpoint::cli
