#include "services/runtime/denials.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "services/runtime/metrics.h"

namespace sixpoint::runtime {
namespace {

using std::chrono::steady_clock;

// Stands for all methods, once there are too many different denials to keep apart.
constexpr char kAny[] = "*";
constexpr std::size_t kLongestText = 200, kLongestSentence = 1000;

std::vector<std::string> AllReasons() {
  std::vector<std::string> all;
  const auto* const reasons = errors::v1::ErrorReason_descriptor();
  for (int i = 0; i < reasons->value_count(); ++i) all.push_back(reasons->value(i)->name());
  return all;
}

// The reasons that who asks has; others are there once they were.
CounterBy& Counted() {
  static CounterBy counted("sixpoint_denials_total", "Calls that were refused for who asked, by errors.v1.ErrorReason.",
                           "reason",
                           {"CERTIFICATE_MISSING", "CERTIFICATE_FOREIGN", "CERTIFICATE_EXPIRED", "CERTIFICATE_REVOKED",
                            "ROLE_MISSING", "MACHINE_DIFFERS", "CODE_NOT_VALID"},
                           AllReasons());
  return counted;
}

}  // namespace

Denials::Denials(std::string area) : area_(std::move(area)) { Counted(); }

void Denials::Add(const std::string& method, const std::string& caller, const std::string& peer_address,
                  const std::string& reason, const std::string& sentence) {
  Counted().Add(reason);
  const storage::Instant now = std::chrono::system_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  Merge({area_, method, Tame(caller, kLongestText), Tame(peer_address, kLongestText), reason,
         Tame(sentence, kLongestSentence), 1, now, now});
}

void Denials::Merge(storage::Denial denial) {
  auto key = std::make_tuple(denial.method, denial.caller, denial.reason);
  if (kept_.size() >= kKept && kept_.count(key) == 0) {
    denial.method = kAny;
    denial.caller.clear();
    denial.sentence.clear();  // of one of many, whom it names
    key = std::make_tuple(denial.method, denial.caller, denial.reason);
  }
  const auto [place, is_new] = kept_.emplace(std::move(key), denial);
  if (is_new) return;
  storage::Denial& kept = place->second;
  kept.count += denial.count;
  if (denial.first_denied_at < kept.first_denied_at) {
    kept.first_denied_at = denial.first_denied_at;
    kept.peer_address = denial.peer_address;
    kept.sentence = denial.sentence;
  }
  kept.last_denied_at = std::max(kept.last_denied_at, denial.last_denied_at);
}

std::vector<storage::Denial> Denials::Take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = steady_clock::now();
  if (now - minute_ >= std::chrono::minutes(1)) {
    minute_ = now;
    rows_of_minute_ = 0;
  }
  std::vector<storage::Denial> taken;
  while (!kept_.empty() && rows_of_minute_ < kRowsAMinute) {
    taken.push_back(std::move(kept_.begin()->second));
    kept_.erase(kept_.begin());
    ++rows_of_minute_;
  }
  return taken;
}

void Denials::PutBack(const std::vector<storage::Denial>& denials) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const storage::Denial& denial : denials) Merge(denial);
  rows_of_minute_ -= static_cast<int>(denials.size());
}

}  // namespace sixpoint::runtime
