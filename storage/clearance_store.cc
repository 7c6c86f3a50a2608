#include "storage/clearance_store.h"

#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

class PostgresClearanceStore final : public ClearanceStore {
 public:
  explicit PostgresClearanceStore(Database* database) : database_(database) {}

  absl::StatusOr<std::vector<ClearanceRow>> List(const ClearanceFilter& filter, std::int64_t before_sequence, int limit,
                                                 Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return ListClearances(t, filter, before_sequence, limit); });
  }
  absl::StatusOr<ClearanceRow> Grant(const ClearanceOrder& order, const StillWanted& still_wanted,
                                     Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return GrantClearance(t, order); });
  }
  absl::StatusOr<std::optional<ClearanceRow>> Withdraw(const ClearanceOrder& order, const StillWanted& still_wanted,
                                                       Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return WithdrawClearance(t, order); });
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<ClearanceStore> ClearanceStoreIn(Database* database) {
  return std::make_shared<PostgresClearanceStore>(database);
}

}  // namespace sixpoint::storage
