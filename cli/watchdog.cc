#include "cli/watchdog.h"

namespace sixpoint::cli {
namespace {

constexpr int kMostSilent = 3;
// Nothing listens: it is starting, or has ended, which is the supervisor's; or it ends each connection at once: somebody holds all its
// places or descriptors, and may let go of them. After a minute it is none of these.
constexpr int kMostAway = 20;

}  // namespace

bool Watch::IsStuckAfter(const std::string& health) {
  silent_count_ = health == "SILENT" ? silent_count_ + 1 : 0;
  away_count_ = health == "NOT_REACHED" ? away_count_ + 1 : 0;
  if (silent_count_ < kMostSilent && away_count_ < kMostAway) return false;
  silent_count_ = away_count_ = 0;
  return true;
}

}  // namespace sixpoint::cli
