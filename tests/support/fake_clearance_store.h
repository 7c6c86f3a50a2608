// A ClearanceStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/clearance_store_test.cc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/clearance_store.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

class FakeClearanceStore final : public storage::ClearanceStore {
 public:
  FakeCommits commits;

  absl::StatusOr<std::vector<storage::ClearanceRow>> List(const storage::ClearanceFilter& filter,
                                                          std::int64_t before_sequence, int limit,
                                                          storage::Deadline) const override;
  absl::StatusOr<storage::ClearanceRow> Grant(const storage::ClearanceOrder& order,
                                              const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::StatusOr<std::optional<storage::ClearanceRow>> Withdraw(const storage::ClearanceOrder& order,
                                                                const storage::StillWanted& still_wanted,
                                                                storage::Deadline) override;

 private:
  struct KeptOrder {
    storage::ClearanceOrder order;
    bool granted = false;
  };

  // Where the newest of that holder and scope is.
  std::optional<std::size_t> Newest(const storage::ClearanceOrder& order) const;
  // What stands then; none: nothing was there to withdraw.
  absl::StatusOr<std::optional<storage::ClearanceRow>> Decide(const storage::ClearanceOrder& order, bool granted,
                                                              const storage::StillWanted& still_wanted);

  std::vector<storage::ClearanceRow> rows_;  // in the order in which they were granted
  std::vector<KeptOrder> orders_;
};

}  // namespace sixpoint::testing
