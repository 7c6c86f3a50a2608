#include "tests/support/fake_clearance_store.h"

#include <chrono>

#include "storage/requests.h"

namespace sixpoint::testing {
namespace {

storage::Instant ClearancesClock() {
  return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

bool IsClearanceOf(const storage::ClearanceRow& row, const std::string& holder, const std::string& scope) {
  return (holder.empty() || row.holder == holder) && (scope.empty() || row.scope == scope);
}

}  // namespace

absl::StatusOr<std::vector<storage::ClearanceRow>> FakeClearanceStore::List(const storage::ClearanceFilter& filter,
                                                                            std::int64_t before_sequence, int limit,
                                                                            storage::Deadline) const {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  std::vector<storage::ClearanceRow> listed;
  for (auto row = rows_.rbegin(); row != rows_.rend() && static_cast<int>(listed.size()) < limit; ++row)
    if (IsClearanceOf(*row, filter.holder, filter.scope) && (filter.withdrawn_too || !row->withdrawn_at) &&
        (before_sequence == 0 || row->granted_sequence < before_sequence))
      listed.push_back(*row);
  return listed;
}

std::optional<std::size_t> FakeClearanceStore::Newest(const storage::ClearanceOrder& order) const {
  for (std::size_t i = rows_.size(); i > 0; --i)
    if (IsClearanceOf(rows_[i - 1], order.holder, order.scope)) return i - 1;
  return std::nullopt;
}

absl::StatusOr<std::optional<storage::ClearanceRow>> FakeClearanceStore::Decide(
    const storage::ClearanceOrder& order, bool granted, const storage::StillWanted& still_wanted) {
  if (!commits.failure().ok()) return commits.failure();
  if (!storage::IsUuid(order.request_id))
    return absl::InvalidArgumentError("request_id: " + order.request_id + ", want a UUID");
  const std::optional<std::size_t> newest = Newest(order);
  for (const KeptOrder& kept : orders_) {
    if (kept.order.request_id != order.request_id) continue;
    if (kept.order.holder == order.holder && kept.order.scope == order.scope && kept.granted == granted)
      return rows_[newest.value()];
    return storage::RequestIdReused(order.request_id);
  }
  if (!granted && !newest) return std::nullopt;
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  orders_.push_back({order, granted});
  const bool holds = newest && !rows_[*newest].withdrawn_at;
  if (granted && !holds) {
    storage::ClearanceRow row;
    row.holder = order.holder;
    row.scope = order.scope;
    row.granted_sequence = static_cast<std::int64_t>(orders_.size());
    row.granted_at = ClearancesClock();
    row.granted_by = order.requested_by;
    rows_.push_back(row);
    return row;
  }
  storage::ClearanceRow& row = rows_[*newest];
  if (!granted && holds) {
    row.withdrawn_at = ClearancesClock();
    row.withdrawn_by = order.requested_by;
  }
  return row;
}

absl::StatusOr<storage::ClearanceRow> FakeClearanceStore::Grant(const storage::ClearanceOrder& order,
                                                                const storage::StillWanted& still_wanted,
                                                                storage::Deadline) {
  const auto lock = commits.Lock();
  const auto granted = Decide(order, true, still_wanted);
  if (!granted.ok()) return granted.status();
  return granted->value();
}

absl::StatusOr<std::optional<storage::ClearanceRow>> FakeClearanceStore::Withdraw(
    const storage::ClearanceOrder& order, const storage::StillWanted& still_wanted, storage::Deadline) {
  const auto lock = commits.Lock();
  return Decide(order, false, still_wanted);
}

}  // namespace sixpoint::testing
