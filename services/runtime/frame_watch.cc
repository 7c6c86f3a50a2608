#include "services/runtime/frame_watch.h"

#include <algorithm>

namespace sixpoint::runtime {
namespace {

// RFC 9113, 6.
enum FrameType : unsigned char { kData = 0, kHeaders = 1, kContinuation = 9 };
constexpr unsigned kEndStream = 1;

// A call's metadata may have 8 KB (server.cc), which gRPC refuses with words; beyond this nobody listens.
constexpr std::size_t kMostBlock_bytes = 64 * 1024, kMostBlockFrames = 64;
// Of frames that carry neither a call nor its bytes: window updates of one who reads 200 MB a second are 7000 a second, pings, resets and
// settings far fewer. A flood is a million.
constexpr double kMostFrames = 10'000, kFramesPerSecond = 10'000;

}  // namespace

std::string_view FrameWatch::Take(std::string_view bytes, Clock::time_point now) {
  while (wrong_.empty() && !bytes.empty()) {
    if (left_bytes_ > 0) {
      const std::size_t passed = std::min(left_bytes_, bytes.size());
      bytes.remove_prefix(passed);
      left_bytes_ -= passed;
      continue;
    }
    head_[head_count_++] = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    if (head_count_ < kHead_bytes) continue;
    head_count_ = 0;
    left_bytes_ = std::size_t{head_[0]} << 16 | std::size_t{head_[1]} << 8 | head_[2];
    Judge(now);
  }
  return wrong_;
}

void FrameWatch::Judge(Clock::time_point now) {
  const unsigned char type = head_[3], flags = head_[4];
  if (type == kHeaders || type == kContinuation) {
    if (type == kHeaders) block_bytes_ = block_frames_ = 0;
    block_bytes_ += left_bytes_;
    if (block_bytes_ > kMostBlock_bytes || ++block_frames_ > kMostBlockFrames)
      wrong_ = "a header block of more than 64 KB or 64 frames";
    return;
  }
  const bool carries = type == kData && (left_bytes_ > 0 || (flags & kEndStream) != 0);
  if (!carries && !TakeOne(now)) wrong_ = "more than 10,000 frames a second that carry nothing";
}

bool FrameWatch::TakeOne(Clock::time_point now) {
  const double passed_s = budget_ < 0 ? 1 : std::chrono::duration<double>(now - budget_at_).count();
  budget_ = std::min(kMostFrames, std::max(budget_, 0.0) + kFramesPerSecond * passed_s);
  budget_at_ = now;
  if (budget_ < 1) return false;
  budget_ -= 1;
  return true;
}

}  // namespace sixpoint::runtime
