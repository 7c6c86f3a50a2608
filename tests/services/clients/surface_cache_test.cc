#include "services/clients/surface_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <future>
#include <map>
#include <mutex>
#include <new>
#include <thread>

#include "tests/metrology/mesh/shapes.h"

namespace sixpoint::clients {
namespace {

using namespace std::chrono_literals;

using Clock = std::chrono::steady_clock;
using metrology::Surface;

SurfaceCache::SurfaceOr MakeSurface() {
  return Surface::Prepare(metrology::shapes::Blade(12, 6, Eigen::Vector3d::Zero()));
}

class SurfaceCacheTest : public ::testing::Test {
 protected:
  // Ten bytes each, until a test says that one grew.
  std::size_t BytesOf(const Surface& surface) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto grown = bytes_.find(&surface);
    return grown == bytes_.end() ? 10 : grown->second;
  }
  void Grow(const Surface& surface, std::size_t bytes) {
    const std::lock_guard<std::mutex> lock(mutex_);
    bytes_[&surface] = bytes;
  }
  std::shared_ptr<const Surface> Get(SurfaceCache* cache, const std::string& sha256) {
    const auto surface = cache->Get(sha256, Clock::now() + 30s, nullptr, [&] {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++made_[sha256];
      return MakeSurface();
    });
    EXPECT_TRUE(surface.ok()) << surface.status();
    return surface.ok() ? *surface : nullptr;
  }
  int made(const std::string& sha256) { return made_[sha256]; }

  std::mutex mutex_;
  std::map<std::string, int> made_;
  std::map<const Surface*, std::size_t> bytes_;
};

TEST_F(SurfaceCacheTest, TheLeastRecentlyUsedGoFirst) {
  SurfaceCache cache(30, [this](const Surface& surface) { return BytesOf(surface); });
  for (const char* name : {"a", "b", "c"}) Get(&cache, name);
  Get(&cache, "a");
  Get(&cache, "d");
  EXPECT_EQ(cache.use().surface_count, 3u);
  EXPECT_EQ(cache.use().bytes, 30u);
  Get(&cache, "a");
  Get(&cache, "c");
  EXPECT_EQ(made("a"), 1);
  EXPECT_EQ(made("c"), 1);
  Get(&cache, "b");
  EXPECT_EQ(made("b"), 2);
}

TEST_F(SurfaceCacheTest, WhatGrewWhileInUseIsCountedAtTheEndOfTheUse) {
  SurfaceCache cache(30, [this](const Surface& surface) { return BytesOf(surface); });
  Get(&cache, "a");
  Get(&cache, "b");
  auto grows = Get(&cache, "c");
  Grow(*grows, 25);  // its near cells
  EXPECT_EQ(cache.use().surface_count, 3u);
  grows.reset();
  EXPECT_EQ(cache.use().bytes, 25u);
  Get(&cache, "c");
  EXPECT_EQ(made("c"), 1);
  Get(&cache, "a");
  EXPECT_EQ(made("a"), 2);
}

TEST_F(SurfaceCacheTest, WhatIsInUseStaysAndIsSharedOverTheLimitToo) {
  SurfaceCache cache(15, [this](const Surface& surface) { return BytesOf(surface); });
  auto a = Get(&cache, "a"), b = Get(&cache, "b");
  EXPECT_EQ(cache.use().bytes, 20u);
  EXPECT_EQ(Get(&cache, "a"), a);  // not a second one beside it
  EXPECT_EQ(made("a"), 1);
  a.reset();
  EXPECT_EQ(cache.use().surface_count, 1u);
  b.reset();
  EXPECT_EQ(cache.use().bytes, 10u);

  // One that is too large for the cache lives as long as its use.
  auto large = Get(&cache, "large");
  Grow(*large, 1000);
  const std::weak_ptr<const Surface> alive = large;
  EXPECT_GT(large->area_mm2(), 0);
  large.reset();
  EXPECT_TRUE(alive.expired());
  EXPECT_LE(cache.use().bytes, 15u);
}

TEST_F(SurfaceCacheTest, WhatIsInUseOutlivesTheCache) {
  std::shared_ptr<const Surface> surface;
  {
    SurfaceCache cache(30);
    surface = Get(&cache, "a");
  }
  EXPECT_GT(surface->area_mm2(), 0);
  surface.reset();
}

TEST_F(SurfaceCacheTest, ManyAtOncePrepareOnce) {
  SurfaceCache cache(1 << 30);
  std::atomic<int> made{0};
  std::vector<std::thread> callers;
  std::vector<std::shared_ptr<const Surface>> surfaces(16);
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    callers.emplace_back([&, i] {
      const auto surface = cache.Get("a", Clock::now() + 30s, nullptr, [&] {
        ++made;
        std::this_thread::sleep_for(50ms);
        return MakeSurface();
      });
      ASSERT_TRUE(surface.ok()) << surface.status();
      surfaces[i] = *surface;
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(made, 1);
  for (const auto& surface : surfaces) EXPECT_EQ(surface, surfaces[0]);
}

// The caller that prepared is cancelled, say: that is nobody else's failure.
TEST_F(SurfaceCacheTest, WhereOneFailsTheNextTries) {
  SurfaceCache cache(1 << 30);
  std::promise<void> begun;
  auto first = std::async(std::launch::async, [&] {
    return cache.Get("a", Clock::now() + 30s, nullptr, [&]() -> SurfaceCache::SurfaceOr {
      begun.set_value();
      std::this_thread::sleep_for(50ms);
      return absl::CancelledError("gone");
    });
  });
  begun.get_future().wait();
  EXPECT_NE(Get(&cache, "a"), nullptr);
  EXPECT_TRUE(absl::IsCancelled(first.get().status()));
  EXPECT_EQ(made("a"), 1);
}

TEST_F(SurfaceCacheTest, WhereMemoryEndsTheCallFailsAndThoseWhoWaitAreWoken) {
  SurfaceCache cache(1 << 30);
  std::promise<void> begun;
  auto first = std::async(std::launch::async, [&] {
    return cache.Get("a", Clock::now() + 30s, nullptr, [&]() -> SurfaceCache::SurfaceOr {
      begun.set_value();
      std::this_thread::sleep_for(50ms);
      throw std::bad_alloc();
    });
  });
  begun.get_future().wait();
  EXPECT_NE(Get(&cache, "a"), nullptr);  // it makes its own
  EXPECT_TRUE(absl::IsResourceExhausted(first.get().status()));
}

TEST_F(SurfaceCacheTest, WhoWaitsEndsWithItsDeadlineOrItsCancellation) {
  SurfaceCache cache(1 << 30);
  std::promise<void> begun, end;
  auto first = std::async(std::launch::async, [&] {
    return cache.Get("a", Clock::now() + 30s, nullptr, [&] {
      begun.set_value();
      end.get_future().wait();
      return MakeSurface();
    });
  });
  begun.get_future().wait();
  const auto late = cache.Get("a", Clock::now() + 50ms, nullptr, MakeSurface);
  EXPECT_TRUE(absl::IsDeadlineExceeded(late.status())) << late.status();
  const auto cancelled = cache.Get(
      "a", Clock::now() + 30s, [] { return false; }, MakeSurface);
  EXPECT_TRUE(absl::IsCancelled(cancelled.status())) << cancelled.status();
  end.set_value();
  EXPECT_TRUE(first.get().ok());
}

// What the cache takes a surface for, against what the allocator gave.
TEST_F(SurfaceCacheTest, CountsWhatASurfaceTakes) {
  const auto allocated = [] {
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
  };
  if (allocated() == 0) GTEST_SKIP() << "a sanitizer's allocator, which does not tell what it gave";
  SurfaceCache cache(std::size_t{1} << 30);
  for (const int along : {100, 400}) {
    const std::size_t before = allocated(), counted_before = cache.use().bytes;
    const auto surface = cache.Get(std::to_string(along), Clock::now() + 60s, nullptr, [&] {
      return Surface::Prepare(metrology::shapes::Blade(200, along, Eigen::Vector3d::Zero()));
    });
    ASSERT_TRUE(surface.ok());
    (*surface)->PrepareNear(1);
    ASSERT_TRUE(cache.Get(std::to_string(along), Clock::now() + 60s, nullptr, [&] { return surface; }).ok());
    const double taken = static_cast<double>(allocated() - before);
    // Vectors keep up to twice what they hold; the tree's size depends on the shape.
    EXPECT_NEAR(static_cast<double>(cache.use().bytes - counted_before) / taken, 1, 0.25) << along << ": " << taken;
  }
}

}  // namespace
}  // namespace sixpoint::clients
