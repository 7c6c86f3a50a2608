#include "cli/plant_run/jobs.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace sixpoint::cli {

void RunJobs(int count, int at_once, const std::function<void(int)>& job) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) job(i);
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < std::min(count, at_once); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace sixpoint::cli
