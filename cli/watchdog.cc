#include "cli/watchdog.h"

namespace sixpoint::cli {
namespace {

constexpr int kMostSilent = 3;
// Nothing listens: it is starting, or has ended, which is the supervisor's; or it ends each connection at once: somebody holds all its
// places or descriptors, and may let go of them. After a minute it is none of these.
// Some of them are silences between, where a connection that was taken in time is not served.
constexpr int kMostUnanswered = 20;

}  // namespace

bool Watch::IsStuckAfter(const std::string& health) {
  const bool is_silent = health == "SILENT", is_unanswered = is_silent || health == "NOT_REACHED";
  silent_count_ = is_silent ? silent_count_ + 1 : 0;
  unanswered_count_ = is_unanswered ? unanswered_count_ + 1 : 0;
  if (silent_count_ < kMostSilent && unanswered_count_ < kMostUnanswered) return false;
  silent_count_ = unanswered_count_ = 0;
  return true;
}

}  // namespace sixpoint::cli
