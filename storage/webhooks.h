// Where events are sent to, and how far each has come (V0030).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/events.h"

namespace sixpoint::storage {

struct WebhookDelivery {
  std::int64_t looked_at_sequence = 0, delivered_sequence = 0;
  std::optional<Instant> delivered_at, failing_since;
  int failure_count = 0;     // since it last went well
  std::string last_failure;  // empty: none yet
};
struct WebhookRow {
  std::string webhook_id, url;
  EventFilter filter;
  std::int64_t begins_after = 0;
  std::string secret;  // 32 bytes
  Reader reader;       // by whose clearances is sent
  std::string requested_by, request_id;
  Instant recorded_at;
  std::optional<Instant> withdrawn_at;
  std::string withdrawn_by;
  WebhookDelivery delivery;
};

// All of them are few: so many hold at once, and each has a thread.
inline constexpr int kMostWebhooks = 16;

// In a transaction of the caller's. The request_id by which the same person made one before is answered with that. ALREADY_EXISTS: the name, or the request_id,
// was another's; RESOURCE_EXHAUSTED: kMostWebhooks hold.
absl::StatusOr<WebhookRow> InsertWebhook(Transaction& transaction, const WebhookRow& row);
// What is withdrawn already is answered as it stands; none: there is none of that name.
absl::StatusOr<std::optional<WebhookRow>> WithdrawWebhook(Transaction& transaction, const std::string& webhook_id,
                                                          const std::string& requested_by,
                                                          const std::string& request_id);
absl::StatusOr<std::optional<WebhookRow>> FindWebhook(Transaction& transaction, const std::string& webhook_id);
// In order of name, from after `after_id`.
absl::StatusOr<std::vector<WebhookRow>> ListWebhooks(Transaction& transaction, bool withdrawn_too,
                                                     const std::string& after_id, int limit);
// How far it has come. Never back: another process may have gone on.
absl::Status SaveDelivery(Transaction& transaction, const std::string& webhook_id, const WebhookDelivery& delivery);

}  // namespace sixpoint::storage
