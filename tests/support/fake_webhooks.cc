#include "tests/support/fake_webhooks.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::testing {
namespace {

storage::Instant WebhooksClock() {
  return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

absl::Status CheckWebhookRequest(const std::string& request_id) {
  if (storage::IsUuid(request_id)) return absl::OkStatus();
  return absl::InvalidArgumentError("request_id: " + request_id + ", want a UUID");
}

}  // namespace

absl::StatusOr<storage::WebhookRow> FakeWebhooks::ToldTo(storage::WebhookRow row, const storage::Reader& reader) const {
  for (const auto& [collection, id] :
       {std::pair{"blades/", &row.filter.blade_serial}, std::pair{"parts/", &row.filter.part_id}}) {
    if (id->empty()) continue;
    const auto hidden = clearances.FirstHidden(reader, {collection + *id}, storage::Unrecorded::kIsHidden, {});
    if (!hidden.ok()) return hidden.status();
    if (hidden->has_value()) id->clear();
  }
  return row;
}

absl::StatusOr<std::optional<storage::WebhookRow>> FakeWebhooks::Find(const std::string& webhook_id,
                                                                      const storage::Reader& reader,
                                                                      storage::Deadline) const {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  const auto found = webhooks_.find(webhook_id);
  if (found == webhooks_.end()) return std::nullopt;
  return ToldTo(found->second, reader);
}

absl::StatusOr<std::vector<storage::WebhookRow>> FakeWebhooks::List(bool withdrawn_too, const std::string& after_id,
                                                                    int limit, const storage::Reader& reader,
                                                                    storage::Deadline) const {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  std::vector<storage::WebhookRow> listed;
  for (auto at = webhooks_.upper_bound(after_id); at != webhooks_.end() && static_cast<int>(listed.size()) < limit;
       ++at) {
    if (!withdrawn_too && at->second.withdrawn_at) continue;
    const absl::StatusOr<storage::WebhookRow> told = ToldTo(at->second, reader);
    if (!told.ok()) return told.status();
    listed.push_back(*told);
  }
  return listed;
}

absl::StatusOr<storage::WebhookRow> FakeWebhooks::Made(const storage::WebhookRow& row) const {
  if (absl::Status checked = CheckWebhookRequest(row.request_id); !checked.ok()) return checked;
  for (const auto& [id, kept] : webhooks_) {
    if (kept.request_id != row.request_id) continue;
    if (kept.requested_by == row.requested_by && id == row.webhook_id && kept.url == row.url &&
        kept.filter == row.filter)
      return kept;
    return storage::RequestIdReused(row.request_id);
  }
  if (webhooks_.count(row.webhook_id) > 0)
    return storage::WithReason(
        absl::AlreadyExistsError("webhook_id: " + row.webhook_id + " is given, want another: names are given once"),
        storage::kWebhookExists);
  const auto holding_count =
      std::count_if(webhooks_.begin(), webhooks_.end(), [](const auto& one) { return !one.second.withdrawn_at; });
  if (holding_count >= storage::kMostWebhooks)
    return storage::WithReason(absl::ResourceExhaustedError("webhooks: " + std::to_string(storage::kMostWebhooks) +
                                                            ", want one withdrawn before"),
                               storage::kWebhooksFull);
  storage::WebhookRow made = row;
  made.reader.sees_all = false;  // is not kept
  made.recorded_at = WebhooksClock();
  made.withdrawn_at.reset();
  made.withdrawn_by.clear();
  made.delivery = {};
  made.delivery.looked_at_sequence = row.begins_after;
  return made;
}

absl::StatusOr<storage::WebhookRow> FakeWebhooks::Create(const storage::WebhookRow& row,
                                                         const storage::StillWanted& still_wanted, storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  absl::StatusOr<storage::WebhookRow> made = Made(row);
  if (!made.ok()) return made;
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  webhooks_.insert({row.webhook_id, *made});  // nothing, where it is there
  return made;
}

absl::StatusOr<std::optional<storage::WebhookRow>> FakeWebhooks::Withdraw(const storage::WebhookWithdrawal& withdrawal,
                                                                          const storage::StillWanted& still_wanted,
                                                                          storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  const auto found = webhooks_.find(withdrawal.webhook_id);
  if (found == webhooks_.end()) return std::nullopt;
  if (absl::Status checked = CheckWebhookRequest(withdrawal.request_id); !checked.ok()) return checked;
  storage::WebhookRow withdrawn = found->second;
  if (!withdrawn.withdrawn_at) {
    withdrawn.withdrawn_at = WebhooksClock();
    withdrawn.withdrawn_by = withdrawal.requested_by;
  }
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  found->second = withdrawn;
  return ToldTo(std::move(withdrawn), withdrawal.reader);
}

absl::Status FakeWebhooks::Save(const std::string& webhook_id, const storage::WebhookDelivery& delivery,
                                storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  const auto found = webhooks_.find(webhook_id);
  if (found != webhooks_.end() && found->second.delivery.looked_at_sequence <= delivery.looked_at_sequence)
    found->second.delivery = delivery;
  return absl::OkStatus();
}

}  // namespace sixpoint::testing
