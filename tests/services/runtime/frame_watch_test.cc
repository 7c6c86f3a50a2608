// By bytes, as they come of a connection: docs of the frames are RFC 9113.
#include "services/runtime/frame_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/services/runtime/raw_connection.h"

namespace sixpoint::runtime {
namespace {

using testing::CallHeaders;
using testing::Frame;
using testing::FrameOf;
using testing::Preface;

constexpr int kEndStream = 1, kEndHeaders = 4;
const FrameWatch::Clock::time_point kStart = FrameWatch::Clock::now();

// As many of these frames as are let pass at once, `most` at most.
int LetPass(const std::string& frame, int most, FrameWatch* watch, FrameWatch::Clock::time_point now = kStart) {
  for (int count = 0; count < most; ++count)
    if (!watch->Take(frame, now).empty()) return count;
  return most;
}

FrameWatch Begun() {
  FrameWatch watch;
  EXPECT_EQ(watch.Take(Preface(), kStart), "");
  return watch;
}

TEST(FrameWatch, LetsCallsAndTheirBytesPass) {
  FrameWatch watch = Begun();
  const std::string call =
      FrameOf(Frame::kHeaders, kEndHeaders, 1, CallHeaders("/sixpoint.plant.v1.PlantService/ListBlades")) +
      FrameOf(Frame::kData, 0, 1, std::string(16'384, 'x')) + FrameOf(Frame::kData, kEndStream, 1, "");
  EXPECT_EQ(LetPass(call, 50'000, &watch), 50'000);
}

// A frame's head may come in any pieces.
TEST(FrameWatch, KnowsFramesHoweverTheyAreCut) {
  const std::string bytes = Preface() + FrameOf(Frame::kData, 0, 1, std::string(300, '\x09')) +
                            FrameOf(Frame::kHeaders, 0, 3, std::string(16'000, 'x')) +
                            FrameOf(Frame::kContinuation, 0, 3, std::string(16'000, 'x'));
  const std::string last = FrameOf(Frame::kContinuation, 0, 3, std::string(16'000, 'x'));
  for (std::size_t piece = 1; piece < 40; ++piece) {
    FrameWatch watch;
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      ASSERT_EQ(watch.Take(std::string_view(bytes).substr(at, piece), kStart), "") << piece;
    EXPECT_EQ(LetPass(last, 10, &watch), 2) << piece;  // the third makes it 80,000 bytes
    EXPECT_EQ(LetPass(FrameOf(Frame::kData, 0, 1, "x"), 1, &watch), 0) << "it does not become good again";
  }
}

TEST(FrameWatch, EndsAHeaderBlockWithoutEnd) {
  FrameWatch watch = Begun();
  EXPECT_EQ(watch.Take(FrameOf(Frame::kHeaders, 0, 1, std::string(16'000, 'x')), kStart), "");
  EXPECT_EQ(LetPass(FrameOf(Frame::kContinuation, 0, 1, std::string(16'000, 'x')), 100, &watch), 3);
  FrameWatch of_nothing = Begun();
  EXPECT_EQ(of_nothing.Take(FrameOf(Frame::kHeaders, 0, 1, ""), kStart), "");
  EXPECT_EQ(LetPass(FrameOf(Frame::kContinuation, 0, 1, ""), 1000, &of_nothing), 63);
  FrameWatch without_begin = Begun();
  EXPECT_LE(LetPass(FrameOf(Frame::kContinuation, kEndHeaders, 1, std::string(16'000, 'x')), 100, &without_begin), 4);
}

// Blocks that end are calls, which others count.
TEST(FrameWatch, EachBlockIsItsOwn) {
  FrameWatch watch = Begun();
  const std::string block = FrameOf(Frame::kHeaders, 0, 1, std::string(8'000, 'x')) +
                            FrameOf(Frame::kContinuation, kEndHeaders, 1, std::string(8'000, 'x'));
  EXPECT_EQ(LetPass(block, 1000, &watch), 1000);
}

TEST(FrameWatch, FramesThatCarryNothingAreSoManyASecond) {
  const std::string eight(8, 'x'), five("\0\0\0\1\x10", 5), four("\0\0\0\1", 4);
  for (const std::string& frame :
       {FrameOf(Frame::kPriority, 0, 1, five), FrameOf(Frame::kResetStream, 0, 1, four),
        FrameOf(Frame::kSettings, 0, 0, ""), FrameOf(Frame::kPushPromise, kEndHeaders, 1, five),
        FrameOf(Frame::kPing, 0, 0, eight), FrameOf(Frame::kWindowUpdate, 0, 1, four),
        FrameOf(Frame::kUnknown, 7, 9, ""), FrameOf(Frame::kData, 0, 1, "")}) {
    FrameWatch watch = Begun();
    const int type = frame[3];
    ASSERT_EQ(LetPass(frame, 8000, &watch), 8000) << type;
    // A second later there is room for as many again, and no more.
    EXPECT_EQ(LetPass(frame, 100'000, &watch, kStart + std::chrono::seconds(100)), 10'000) << type;
  }
}

// One who downloads as fast as a service gives: 20 GB, a window's update for each 32 KB.
TEST(FrameWatch, LetsDownloadsGoOn) {
  FrameWatch watch = Begun();
  const std::string update = FrameOf(Frame::kWindowUpdate, 0, 1, std::string("\0\0\x7f\xff", 4));
  auto now = kStart;
  for (int i = 0; i < 640'000; ++i, now += std::chrono::microseconds(150)) ASSERT_EQ(watch.Take(update, now), "") << i;
}

}  // namespace
}  // namespace sixpoint::runtime
