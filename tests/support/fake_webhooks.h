// A WebhookStore and WebhookDeliveries in memory, about the same webhooks: what handlers and the sender are tested on without
// PostgreSQL. Held to the real ones by tests/storage/webhook_store_test.cc.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "storage/webhooks.h"
#include "tests/support/fake_clearances.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

class FakeWebhooks final : public storage::WebhookStore, public storage::WebhookDeliveries {
 public:
  FakeCommits commits;
  // Whose the parts are; to be changed while nobody calls.
  FakeClearances clearances;

  absl::StatusOr<std::optional<storage::WebhookRow>> Find(const std::string& webhook_id, const storage::Reader& reader,
                                                          storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::WebhookRow>> List(bool withdrawn_too, const std::string& after_id, int limit,
                                                        const storage::Reader& reader,
                                                        storage::Deadline) const override;
  absl::StatusOr<storage::WebhookRow> Create(const storage::WebhookRow& row, const storage::StillWanted& still_wanted,
                                             storage::Deadline) override;
  absl::StatusOr<std::optional<storage::WebhookRow>> Withdraw(const storage::WebhookWithdrawal& withdrawal,
                                                              const storage::StillWanted& still_wanted,
                                                              storage::Deadline) override;
  absl::Status Save(const std::string& webhook_id, const storage::WebhookDelivery& delivery,
                    storage::Deadline) override;

 private:
  absl::StatusOr<storage::WebhookRow> ToldTo(storage::WebhookRow row, const storage::Reader& reader) const;
  // What stands then; nothing is kept yet.
  absl::StatusOr<storage::WebhookRow> Made(const storage::WebhookRow& row) const;

  std::map<std::string, storage::WebhookRow> webhooks_;  // by id
};

}  // namespace sixpoint::testing
