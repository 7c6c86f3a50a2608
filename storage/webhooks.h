// Where events are sent to, and how far each has come (V0030).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/events.h"
#include "storage/one_write.h"

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

// Webhooks apart from where they are kept. PostgreSQL's and the tests' fake pass the same suite
// (tests/storage/webhook_store_test.cc). Thread-safe. No call holds a connection after it returned. Of a webhook's filter a reader is
// told neither the blade nor the part that he may not see: those are empty.
class WebhookReader {
 public:
  virtual ~WebhookReader() = default;
  virtual absl::StatusOr<std::optional<WebhookRow>> Find(const std::string& webhook_id, const Reader& reader,
                                                         Deadline deadline) const = 0;
  // As ListWebhooks.
  virtual absl::StatusOr<std::vector<WebhookRow>> List(bool withdrawn_too, const std::string& after_id, int limit,
                                                       const Reader& reader, Deadline deadline) const = 0;
};

struct WebhookWithdrawal {
  std::string webhook_id, requested_by;
  std::string request_id;  // a UUID
  Reader reader = {};      // who is told what was withdrawn
};

// Each all or nothing. INVALID_ARGUMENT: the request_id is no UUID.
class WebhookStore : public WebhookReader {
 public:
  // As InsertWebhook: of the row what is asked for. Who made it is told all of its filter.
  virtual absl::StatusOr<WebhookRow> Create(const WebhookRow& row, const StillWanted& still_wanted,
                                            Deadline deadline) = 0;
  // As the function WithdrawWebhook.
  virtual absl::StatusOr<std::optional<WebhookRow>> Withdraw(const WebhookWithdrawal& withdrawal,
                                                             const StillWanted& still_wanted, Deadline deadline) = 0;
};

// How far each has come, for who sends: kept apart from what was asked for, in the same manner.
class WebhookDeliveries {
 public:
  virtual ~WebhookDeliveries() = default;
  // As SaveDelivery: of none of that name, or of less than is kept, nothing is changed.
  virtual absl::Status Save(const std::string& webhook_id, const WebhookDelivery& delivery, Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<WebhookStore> WebhooksIn(Database* database);
std::shared_ptr<WebhookDeliveries> WebhookDeliveriesIn(Database* database);

}  // namespace sixpoint::storage
