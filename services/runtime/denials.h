// What was refused for who asked, until it is written down: alike ones counted together, so that a stranger's flood is few rows.
// Private to runtime.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "storage/denials.h"

namespace sixpoint::runtime {

// Thread-safe.
class Denials {
 public:
  explicit Denials(std::string area);

  void Add(const std::string& method, const std::string& caller, const std::string& peer_address,
           const std::string& reason, const std::string& sentence);
  // What is to be written now: at most kRowsAMinute each minute; the rest stays, and what is more than kKept kinds is counted
  // under one. Put back what could not be written.
  std::vector<storage::Denial> Take();
  void PutBack(const std::vector<storage::Denial>& denials);

  static constexpr int kRowsAMinute = 100;
  static constexpr std::size_t kKept = 256;

 private:
  void Merge(storage::Denial denial);

  const std::string area_;
  std::mutex mutex_;
  std::map<std::tuple<std::string, std::string, std::string>, storage::Denial> kept_;  // by method, caller, reason
  std::chrono::steady_clock::time_point minute_;
  int rows_of_minute_ = 0;
};

}  // namespace sixpoint::runtime
