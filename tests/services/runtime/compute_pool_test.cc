#include "services/runtime/compute_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

using Clock = std::chrono::steady_clock;
using Patience = ComputePool::Patience;

const auto kOnAndOn = [] { return true; };

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

class ComputePoolTest : public ::testing::Test {
 protected:
  static absl::StatusOr<ComputePool::Slot> Enter(ComputePool* pool, Patience patience = Patience::kBounded) {
    return pool->Enter(Clock::now() + 30s, kOnAndOn, patience);
  }
  static void WaitUntilWaiting(const ComputePool& pool, int count) {
    while (pool.use().waiting < count) std::this_thread::sleep_for(1ms);
  }
};

TEST_F(ComputePoolTest, NoMoreRunAtOnceThanMay) {
  ComputePool pool({3, 100}, "fits", errors::v1::REGISTRATIONS_FULL);
  std::atomic<int> running{0}, greatest{0}, done{0};
  std::vector<std::thread> callers;
  for (int i = 0; i < 24; ++i)
    callers.emplace_back([&] {
      const auto slot = Enter(&pool);
      ASSERT_TRUE(slot.ok()) << slot.status();
      const int now = ++running;
      for (int seen = greatest; now > seen && !greatest.compare_exchange_weak(seen, now);) {
      }
      std::this_thread::sleep_for(5ms);
      --running;
      ++done;
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(done, 24);
  EXPECT_EQ(greatest, 3);
  EXPECT_EQ(pool.use().running, 0);
  EXPECT_EQ(pool.use().waiting, 0);
}

TEST_F(ComputePoolTest, FirstComeFirstServed) {
  ComputePool pool({1, 100}, "fits", errors::v1::REGISTRATIONS_FULL);
  auto slot = std::make_unique<absl::StatusOr<ComputePool::Slot>>(Enter(&pool));
  std::mutex mutex;
  std::vector<int> order;
  std::vector<std::thread> callers;
  for (int i = 0; i < 6; ++i) {
    callers.emplace_back([&, i] {
      const auto own = Enter(&pool);
      const std::lock_guard<std::mutex> lock(mutex);
      order.push_back(i);
    });
    WaitUntilWaiting(pool, i + 1);
  }
  slot.reset();
  for (std::thread& caller : callers) caller.join();
  EXPECT_THAT(order, ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST_F(ComputePoolTest, MoreThanMayWaitAreRefusedAtOnceWithAHint) {
  ComputePool pool({1, 2}, "fits", errors::v1::REGISTRATIONS_FULL);
  auto slot = std::make_unique<absl::StatusOr<ComputePool::Slot>>(Enter(&pool));
  std::vector<std::future<bool>> waiting;
  for (int i = 0; i < 2; ++i) waiting.push_back(std::async(std::launch::async, [&] { return Enter(&pool).ok(); }));
  WaitUntilWaiting(pool, 2);

  const auto begin = Clock::now();
  const absl::Status refused = Enter(&pool).status();
  EXPECT_LT(SecondsSince(begin), 1);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(ReasonOf(refused), "REGISTRATIONS_FULL");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("1 are running and 2 wait"));
  EXPECT_GT(RetryDelayOf(FromGrpc(ToGrpc(refused))), 0ms);

  // One whose number is bounded elsewhere waits all the same, behind the others, and takes no one's place.
  waiting.push_back(std::async(std::launch::async, [&] { return Enter(&pool, Patience::kPatient).ok(); }));
  WaitUntilWaiting(pool, 3);
  EXPECT_TRUE(absl::IsResourceExhausted(Enter(&pool).status()));
  slot.reset();
  for (std::future<bool>& one : waiting) EXPECT_TRUE(one.get());
}

TEST_F(ComputePoolTest, WhoWaitsEndsWithItsDeadlineOrItsCancellationAndGivesItsPlaceUp) {
  ComputePool pool({1, 1}, "fits", errors::v1::REGISTRATIONS_FULL);
  auto slot = std::make_unique<absl::StatusOr<ComputePool::Slot>>(Enter(&pool));
  auto begin = Clock::now();
  EXPECT_TRUE(absl::IsDeadlineExceeded(pool.Enter(begin + 50ms, kOnAndOn).status()));
  EXPECT_GE(SecondsSince(begin), 0.05);
  EXPECT_LT(SecondsSince(begin), 5);  // of a loaded machine; else some hundredths

  std::atomic<bool> alive{true};
  auto cancelled = std::async(std::launch::async,
                              [&] { return pool.Enter(Clock::now() + 30s, [&] { return alive.load(); }).status(); });
  WaitUntilWaiting(pool, 1);
  alive = false;
  begin = Clock::now();
  EXPECT_TRUE(absl::IsCancelled(cancelled.get()));
  EXPECT_LT(SecondsSince(begin), 5);

  // The place is free for the next.
  auto next = std::async(std::launch::async, [&] { return Enter(&pool).ok(); });
  WaitUntilWaiting(pool, 1);
  slot.reset();
  EXPECT_TRUE(next.get());
}

// Under overload a queue of those whose time is nearly over would be all that is ever worked for.
TEST_F(ComputePoolTest, WhoCouldNotEndBeforeItsDeadlineIsRefusedAtOnce) {
  ComputePool pool({1, 8}, "fits", errors::v1::REGISTRATIONS_FULL);
  {
    const auto slot = Enter(&pool);
    std::this_thread::sleep_for(200ms);  // so long they take here
  }
  auto slot = std::make_unique<absl::StatusOr<ComputePool::Slot>>(Enter(&pool));
  const absl::Status refused = pool.Enter(Clock::now() + 300ms, kOnAndOn).status();
  EXPECT_EQ(ReasonOf(refused), "REGISTRATIONS_FULL") << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("before this call's deadline"));
  // Who has the time waits, and so does who is bounded elsewhere.
  auto next = std::async(std::launch::async, [&] { return Enter(&pool).ok(); });
  WaitUntilWaiting(pool, 1);
  auto patient = std::async(std::launch::async,
                            [&] { return pool.Enter(Clock::now() + 300ms, kOnAndOn, Patience::kPatient).status(); });
  EXPECT_TRUE(absl::IsDeadlineExceeded(patient.get()));
  slot.reset();
  EXPECT_TRUE(next.get());
}

// The first in the row gives up while a slot is free for the second.
TEST_F(ComputePoolTest, WhoGivesUpDoesNotKeepTheOthersWaiting) {
  ComputePool pool({1, 8}, "fits", errors::v1::REGISTRATIONS_FULL);
  auto slot = std::make_unique<absl::StatusOr<ComputePool::Slot>>(Enter(&pool));
  std::atomic<bool> alive{true};
  auto first = std::async(std::launch::async,
                          [&] { return pool.Enter(Clock::now() + 30s, [&] { return alive.load(); }).status(); });
  WaitUntilWaiting(pool, 1);
  auto second = std::async(std::launch::async, [&] { return Enter(&pool).ok(); });
  WaitUntilWaiting(pool, 2);
  alive = false;
  EXPECT_TRUE(absl::IsCancelled(first.get()));
  slot.reset();
  EXPECT_TRUE(second.get());
}

TEST_F(ComputePoolTest, WhereNobodyMayWaitAFullPoolRefusesAtOnce) {
  ComputePool pool({1, 0}, "uploads", errors::v1::UPLOADS_FULL);
  {
    const auto slot = Enter(&pool);
    ASSERT_TRUE(slot.ok()) << slot.status();
    const absl::Status refused = Enter(&pool).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(ReasonOf(refused), "UPLOADS_FULL");
    EXPECT_EQ(MetadataOf(refused).at("limit"), "1");
  }
  EXPECT_TRUE(Enter(&pool).ok());
}

TEST_F(ComputePoolTest, PatientCallersWaitWhereNobodyElseMay) {
  ComputePool pool({1, 0}, "encoding", errors::v1::UPLOADS_FULL);
  auto first = Enter(&pool, Patience::kPatient);
  ASSERT_TRUE(first.ok());
  auto second = std::async(std::launch::async, [&] { return Enter(&pool, Patience::kPatient).status(); });
  WaitUntilWaiting(pool, 1);
  { const auto done = *std::move(first); }
  EXPECT_TRUE(second.get().ok());
}

}  // namespace
}  // namespace sixpoint::runtime
