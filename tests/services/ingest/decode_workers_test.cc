#include "services/ingest/decode_workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "metrology/cloud/draco_codec.h"
#include "sandbox/confine.h"
#include "tests/sandbox/denied_call.h"
#include "tests/services/ingest/sample_scans.h"
#include "tests/services/ingest/worker_program.h"
#include "tests/support/stock_draco.h"

namespace sixpoint::ingest {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

steady_clock::time_point Soon() { return steady_clock::now() + std::chrono::seconds(20); }

// The processes whose parent is this one.
std::vector<pid_t> Children() {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream status(entry.path() / "status");
    for (std::string line; std::getline(status, line);) {
      if (line == "PPid:\t" + std::to_string(getpid())) children.push_back(static_cast<pid_t>(std::stol(name)));
    }
  }
  return children;
}

TEST(DecodeWorkers, WriteAnothersBlockAgain) {
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
  const std::string sent = testing::StockDraco(SampleProfiles(10, 640), 14, 10);
  const auto checked = workers.Check(sent, 6400, 0.05, {}, {Soon(), nullptr});
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_NE(checked->reencoded, sent);
  const auto points_mm = metrology::DecodeBlock(sent, 6400),
             again_mm = metrology::DecodeBlock(checked->reencoded, 6400);
  ASSERT_TRUE(points_mm.ok() && again_mm.ok()) << again_mm.status();
  EXPECT_EQ(metrology::GreatestDifferenceMm(*points_mm, *again_mm), 0);
}

TEST(DecodeWorkers, TellWhatABlockHolds) {
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
  const auto points_mm = SampleProfiles(10, 640);
  const auto block = SampleBlocks(points_mm, points_mm.size())[0];
  const auto checked = workers.Check(block.payload(), block.point_count(), 0.05, {}, {Soon(), nullptr});
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_EQ(checked->reencoded, "");  // our own encoder wrote it
  const BlockStatistics* const statistics = &checked->statistics;
  const BlockStatistics expected = StatisticsOf(points_mm, 0.05, {});
  EXPECT_EQ(statistics->point_count, 6400);
  EXPECT_EQ(statistics->greatest_column_count, 640);
  EXPECT_EQ(statistics->end.column_count, 640);
  EXPECT_EQ(statistics->greatest_backstep_mm, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(statistics->minimum_mm[i], expected.minimum_mm[i], 0.25e-3);
    EXPECT_NEAR(statistics->maximum_mm[i], expected.maximum_mm[i], 0.25e-3);
  }
  ASSERT_TRUE(workers.Check(block.payload(), block.point_count(), 0.05, {}, {Soon(), nullptr}).ok());
  EXPECT_EQ(workers.started_count(), 1);  // lives on
}

// What that holds them from is in tests/sandbox.
TEST(DecodeWorkers, AreConfined) {
  if (!sandbox::kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  ASSERT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
  const std::vector<pid_t> children = Children();
  ASSERT_EQ(children.size(), 1U);
  std::ifstream file("/proc/" + std::to_string(children[0]) + "/status");
  const std::string status{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(status, HasSubstr("Seccomp:\t2\n"));  // a filter is at work
  EXPECT_THAT(status, HasSubstr("NoNewPrivs:\t1\n"));
}

TEST(DecodeWorkers, SayThatTheyCannotConfineThemselves) {
  if (!sandbox::kApplied) GTEST_SKIP() << "sanitizers make calls of their own: workers are not confined under one";
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  EXPECT_EXIT(
      {
        testing::DenyCall("seccomp", EPERM);
        DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
        const auto statistics = workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr});
        std::fprintf(stderr, "%s\n", statistics.status().ToString().c_str());
        _exit(absl::IsUnavailable(statistics.status()) ? 0 : 1);
      },
      ::testing::ExitedWithCode(0), "cannot confine itself");
}

TEST(DecodeWorkers, RefuseWhatIsNotABlock) {
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  EXPECT_THAT(workers.Check(block.payload(), 199, 0.05, {}, {Soon(), nullptr}).status().message(),
              HasSubstr("200 points"));
  const std::string half = block.payload().substr(0, block.payload().size() / 2);
  EXPECT_TRUE(absl::IsInvalidArgument(workers.Check(half, 200, 0.05, {}, {Soon(), nullptr}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(workers.Check("", 200, 0.05, {}, {Soon(), nullptr}).status()));
  EXPECT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
}

// Some hundreds of blocks with damaged bytes, the header spared so that the decoder itself is reached. Some decode to other
// points, which is not for the decoder to tell; nothing may harm this process, and all end soon.
TEST(DecodeWorkers, SurviveMutatedBlocks) {
  DecodeWorkers workers(WorkerProgram(), 2, milliseconds(8000));
  const auto block = SampleBlocks(SampleProfiles(10, 200), 2000)[0];
  std::mt19937 random(11);
  const auto pick = [&](std::size_t from, std::size_t below) { return from + random() % (below - from); };
  int refused = 0;
  steady_clock::duration slowest{};
  for (int i = 0; i < 300; ++i) {
    std::string bytes = block.payload();
    for (std::size_t flips = pick(1, 6); flips > 0; --flips) {
      // Half of the damage where the structure is: the first bytes behind the header.
      const std::size_t at = random() % 2 == 0 ? pick(15, 60) : pick(15, bytes.size());
      bytes[at] = static_cast<char>(random());
    }
    const auto begin = steady_clock::now();
    const auto statistics = workers.Check(bytes, 2000, 0.05, {}, {Soon(), nullptr});
    slowest = std::max(slowest, steady_clock::now() - begin);
    if (statistics.ok()) continue;
    EXPECT_TRUE(absl::IsInvalidArgument(statistics.status())) << statistics.status();
    ++refused;
  }
  EXPECT_GT(refused, 50);
  EXPECT_LT(slowest, std::chrono::seconds(17));
  RecordProperty("refused", refused);
  RecordProperty("slowest_ms", static_cast<int>(std::chrono::duration_cast<milliseconds>(slowest).count()));
  EXPECT_TRUE(workers.Check(block.payload(), 2000, 0.05, {}, {Soon(), nullptr}).ok());
}

TEST(DecodeWorkers, ReplaceAWorkerThatWasKilled) {
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(5000));
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  ASSERT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
  ASSERT_EQ(Children().size(), 1U);
  ASSERT_EQ(kill(Children()[0], SIGKILL), 0);
  EXPECT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
  EXPECT_EQ(workers.started_count(), 2);
}

TEST(DecodeWorkers, EndAWorkerThatTakesTooLong) {
  DecodeWorkers workers(WorkerProgram(), 1, milliseconds(200));
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  ASSERT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
  ASSERT_EQ(kill(Children().at(0), SIGSTOP), 0);
  const auto begin = steady_clock::now();
  EXPECT_THAT(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).status().message(),
              HasSubstr("too long"));
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_TRUE(Children().empty());
}

TEST(DecodeWorkers, ServeMoreCallersThanThereAreWorkers) {
  DecodeWorkers workers(WorkerProgram(), 2, milliseconds(8000));
  const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
  std::atomic<int> sound_count = 0;
  std::vector<std::thread> callers;
  for (int i = 0; i < 8; ++i) {
    callers.emplace_back([&] {
      for (int k = 0; k < 10; ++k)
        sound_count += workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok() ? 1 : 0;
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(sound_count, 80);
  EXPECT_LE(workers.started_count(), 2);
}

TEST(DecodeWorkers, SayThatTheirProgramIsMissing) {
  DecodeWorkers workers("/nowhere/sixpoint-decode-worker", 1, milliseconds(1000));
  EXPECT_TRUE(absl::IsUnavailable(workers.Check("x", 1, 0.05, {}, {Soon(), nullptr}).status()));
}

TEST(DecodeWorkers, LeaveNoProcessBehind) {
  {
    DecodeWorkers workers(WorkerProgram(), 2, milliseconds(5000));
    const auto block = SampleBlocks(SampleProfiles(2, 100), 200)[0];
    ASSERT_TRUE(workers.Check(block.payload(), 200, 0.05, {}, {Soon(), nullptr}).ok());
    EXPECT_EQ(Children().size(), 1U);
  }
  EXPECT_TRUE(Children().empty());
}

}  // namespace
}  // namespace sixpoint::ingest
