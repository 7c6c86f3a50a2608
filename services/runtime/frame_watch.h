// What HTTP/2 lets a client send without end, and gRPC 1.51 takes without one: header blocks that go on in frame after frame
// (CVE-2023-33953: 15 GB in 4 seconds from four connections), and frames that only cost its time. A connection that does it is ended
// before gRPC sees the frame.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace sixpoint::runtime {

// Of one connection, told what came of it, decrypted, in its order.
class FrameWatch {
 public:
  using Clock = std::chrono::steady_clock;
  // What is wrong; empty: nothing. From then on always.
  std::string_view Take(std::string_view bytes, Clock::time_point now);

 private:
  static constexpr std::size_t kHead_bytes = 9;  // RFC 9113, 4.1
  void Judge(Clock::time_point now);
  // False: there were too many.
  bool TakeOne(Clock::time_point now);

  std::string_view wrong_;
  std::array<unsigned char, kHead_bytes> head_{};
  std::size_t head_count_ = 0;
  std::size_t left_bytes_ = 24;  // of the frame's payload; at first of the client's preface
  std::size_t block_bytes_ = 0, block_frames_ = 0;
  double budget_ = -1;  // frames; below 0: none was taken yet
  Clock::time_point budget_at_;
};

// Every server's connection of a process that calls this is watched: SSL_read, by which gRPC reads, is then ours (watched_read.cc).
void WatchFrames();

}  // namespace sixpoint::runtime
