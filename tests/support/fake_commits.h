// What the fakes of stores share whose writes are transactions of their own: calls that fail, and the moment before a commit.
// Each call of a store holds Lock() while it lasts.
#pragma once

#include <absl/status/status.h>

#include <functional>
#include <mutex>
#include <utility>

#include "storage/one_write.h"

namespace sixpoint::testing {

class FakeCommits {
 public:
  using Meanwhile = std::function<void(const storage::StillWanted& still_wanted)>;

  std::unique_lock<std::mutex> Lock() const { return std::unique_lock(mutex_); }
  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) {
    const auto lock = Lock();
    failure_ = std::move(failure);
  }
  // Happens before each commit, while the store's call lasts: it may not call the store.
  void BeforeCommit(Meanwhile meanwhile) {
    const auto lock = Lock();
    meanwhile_ = std::move(meanwhile);
  }
  const absl::Status& failure() const { return failure_; }
  // What was done counts where it is OK.
  absl::Status Commit(const storage::StillWanted& still_wanted) const {
    if (meanwhile_) meanwhile_(still_wanted);
    return still_wanted() ? absl::OkStatus() : absl::CancelledError("the client went away");
  }

 private:
  mutable std::mutex mutex_;
  absl::Status failure_;
  Meanwhile meanwhile_;
};

}  // namespace sixpoint::testing
