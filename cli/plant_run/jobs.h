// A few independent jobs at a time.
#pragma once

#include <functional>

namespace sixpoint::cli {

// Calls job(0) ... job(count - 1), started in that order, at most `at_once` together; returns when all are done.
void RunJobs(int count, int at_once, const std::function<void(int)>& job);

}  // namespace sixpoint::cli
