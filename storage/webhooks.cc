#include "storage/webhooks.h"

#include <utility>

#include "storage/clearances.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_SELECT_WEBHOOKS                                                                               \
  "SELECT w.webhook_id, w.url, w.kinds, w.machine_id, w.blade_serial, w.part_id, w.verdicts, w.begins_after, " \
  "w.secret, name_of(w.reader), name_of(w.requested_by), w.request_id::text, w.recorded_at, x.recorded_at, "   \
  "name_of(x.requested_by), d.looked_at_sequence, d.delivered_sequence, d.delivered_at, d.failing_since, "     \
  "d.failure_count, d.last_failure FROM webhooks w JOIN webhook_deliveries d ON d.webhook_id = w.webhook_id "  \
  "LEFT JOIN webhook_withdrawals x ON x.webhook_id = w.webhook_id "
constexpr char kSelectWebhook[] = SIXPOINT_SELECT_WEBHOOKS "WHERE w.webhook_id = $1";
constexpr char kSelectByRequest[] = SIXPOINT_SELECT_WEBHOOKS "WHERE w.request_id = $1::uuid";
constexpr char kSelectWebhooks[] = SIXPOINT_SELECT_WEBHOOKS
    "WHERE ($1::boolean OR x.webhook_id IS NULL) AND w.webhook_id > $2 ORDER BY w.webhook_id LIMIT $3";
#undef SIXPOINT_SELECT_WEBHOOKS
// Who makes one counts those that hold while nobody else does.
constexpr char kLockWebhooks[] = "SELECT pg_advisory_xact_lock(hashtextextended('webhooks', 0))";
constexpr char kInsertWebhook[] =
    "INSERT INTO webhooks (webhook_id, url, kinds, machine_id, blade_serial, part_id, verdicts, begins_after, secret, "
    "reader, requested_by, request_id) VALUES ($1, $2, $3::text[], $4, $5, $6, $7::text[], $8, $9, $10, $11, "
    "$12::uuid)";
constexpr char kInsertDelivery[] = "INSERT INTO webhook_deliveries (webhook_id, looked_at_sequence) VALUES ($1, $2)";
constexpr char kWithdraw[] =
    "INSERT INTO webhook_withdrawals (webhook_id, requested_by, request_id) VALUES ($1, $2, $3::uuid) "
    "ON CONFLICT (webhook_id) DO NOTHING";
constexpr char kSave[] =
    "UPDATE webhook_deliveries SET looked_at_sequence = $2, delivered_sequence = $3, delivered_at = $4, "
    "failing_since = $5, failure_count = $6, last_failure = $7 WHERE webhook_id = $1 AND looked_at_sequence <= $2";

std::vector<WebhookRow> ReadWebhooks(const Rows& rows) {
  std::vector<WebhookRow> webhooks;
  for (int row = 0; row < rows.count(); ++row) {
    WebhookRow& read = webhooks.emplace_back();
    read.webhook_id = rows.Text(row, 0);
    read.url = rows.Text(row, 1);
    read.filter = {rows.Texts(row, 2), rows.Text(row, 3), rows.Text(row, 4), rows.Text(row, 5), rows.Texts(row, 6)};
    read.begins_after = rows.Int(row, 7);
    read.secret = rows.Bytes(row, 8);
    read.reader.identity = rows.Text(row, 9);
    read.requested_by = rows.Text(row, 10);
    read.request_id = rows.Text(row, 11);
    read.recorded_at = rows.Time(row, 12);
    if (!rows.IsNull(row, 13)) read.withdrawn_at = rows.Time(row, 13);
    read.withdrawn_by = rows.OptionalText(row, 14);
    WebhookDelivery& delivery = read.delivery;
    delivery.looked_at_sequence = rows.Int(row, 15);
    delivery.delivered_sequence = rows.Int(row, 16);
    if (!rows.IsNull(row, 17)) delivery.delivered_at = rows.Time(row, 17);
    if (!rows.IsNull(row, 18)) delivery.failing_since = rows.Time(row, 18);
    delivery.failure_count = static_cast<int>(rows.Int(row, 19));
    delivery.last_failure = rows.Text(row, 20);
  }
  return webhooks;
}

absl::StatusOr<std::optional<WebhookRow>> One(Transaction& transaction, const char* sql, const std::string& of) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, Params().Text(of));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(std::optional(ReadWebhooks(*rows).front()));
}

// What of its filter the reader may be told.
absl::Status LeaveOutHidden(Transaction& transaction, const Reader& reader, WebhookRow* row) {
  for (const auto& [collection, id] :
       {std::pair{"blades/", &row->filter.blade_serial}, std::pair{"parts/", &row->filter.part_id}}) {
    if (id->empty()) continue;
    const auto hidden = FirstHidden(transaction, reader, {collection + *id}, Unrecorded::kIsHidden);
    if (!hidden.ok()) return hidden.status();
    if (hidden->has_value()) id->clear();
  }
  return absl::OkStatus();
}

// That of one that may be there, as the reader may be told it.
absl::StatusOr<std::optional<WebhookRow>> ToldTo(Transaction& transaction, const Reader& reader,
                                                 absl::StatusOr<std::optional<WebhookRow>> row) {
  if (!row.ok() || !row->has_value()) return row;
  if (absl::Status told = LeaveOutHidden(transaction, reader, &**row); !told.ok()) return told;
  return row;
}

class PostgresWebhooks final : public WebhookStore {
 public:
  explicit PostgresWebhooks(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<WebhookRow>> Find(const std::string& webhook_id, const Reader& reader,
                                                 Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ToldTo(t, reader, FindWebhook(t, webhook_id)); });
  }
  absl::StatusOr<std::vector<WebhookRow>> List(bool withdrawn_too, const std::string& after_id, int limit,
                                               const Reader& reader, Deadline deadline) const override {
    using Listed = absl::StatusOr<std::vector<WebhookRow>>;
    return OneRead(*database_, deadline, [&](Transaction& t) -> Listed {
      Listed listed = ListWebhooks(t, withdrawn_too, after_id, limit);
      if (!listed.ok()) return listed;
      for (WebhookRow& row : *listed)
        if (absl::Status told = LeaveOutHidden(t, reader, &row); !told.ok()) return told;
      return listed;
    });
  }
  absl::StatusOr<WebhookRow> Create(const WebhookRow& row, const StillWanted& still_wanted,
                                    Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return InsertWebhook(t, row); });
  }
  absl::StatusOr<std::optional<WebhookRow>> Withdraw(const WebhookWithdrawal& withdrawal,
                                                     const StillWanted& still_wanted, Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) {
      return ToldTo(t, withdrawal.reader,
                    WithdrawWebhook(t, withdrawal.webhook_id, withdrawal.requested_by, withdrawal.request_id));
    });
  }

 private:
  Database* const database_;
};

class PostgresDeliveries final : public WebhookDeliveries {
 public:
  explicit PostgresDeliveries(Database* database) : database_(database) {}

  absl::Status Save(const std::string& webhook_id, const WebhookDelivery& delivery, Deadline deadline) override {
    return OneWrite(*database_, deadline, [&](Transaction& t) { return SaveDelivery(t, webhook_id, delivery); });
  }

 private:
  Database* const database_;
};

}  // namespace

absl::StatusOr<WebhookRow> InsertWebhook(Transaction& transaction, const WebhookRow& row) {
  if (const auto locked = transaction.Execute(kLockWebhooks); !locked.ok()) return locked.status();
  const auto kept = One(transaction, kSelectByRequest, row.request_id);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) {
    // The answer tells the secret: to nobody else, whatever he learned of the request.
    const bool is_same = (*kept)->requested_by == row.requested_by && (*kept)->webhook_id == row.webhook_id &&
                         (*kept)->url == row.url && (*kept)->filter == row.filter;
    if (is_same) return **kept;
    return RequestIdReused(row.request_id);
  }
  const auto named = One(transaction, kSelectWebhook, row.webhook_id);
  if (!named.ok()) return named.status();
  if (named->has_value())
    return WithReason(
        absl::AlreadyExistsError("webhook_id: " + row.webhook_id + " is given, want another: names are given once"),
        kWebhookExists);
  const auto holding = ListWebhooks(transaction, false, "", kMostWebhooks);
  if (!holding.ok()) return holding.status();
  if (holding->size() == static_cast<std::size_t>(kMostWebhooks))
    return WithReason(
        absl::ResourceExhaustedError("webhooks: " + std::to_string(kMostWebhooks) + ", want one withdrawn before"),
        kWebhooksFull);
  Params params;
  params.Text(row.webhook_id).Text(row.url).Texts(row.filter.kinds).Text(row.filter.machine_id);
  params.Text(row.filter.blade_serial).Text(row.filter.part_id).Texts(row.filter.verdicts).Int(row.begins_after);
  params.Bytes(row.secret).Text(row.reader.identity).Text(row.requested_by).Text(row.request_id);
  if (const auto inserted = transaction.Execute(kInsertWebhook, params); !inserted.ok()) return inserted.status();
  const auto begun = transaction.Execute(kInsertDelivery, Params().Text(row.webhook_id).Int(row.begins_after));
  if (!begun.ok()) return begun.status();
  absl::StatusOr<std::optional<WebhookRow>> made = One(transaction, kSelectWebhook, row.webhook_id);
  if (!made.ok()) return made.status();
  if (!made->has_value()) return absl::InternalError("webhook: made and not there");
  return **std::move(made);
}

absl::StatusOr<std::optional<WebhookRow>> WithdrawWebhook(Transaction& transaction, const std::string& webhook_id,
                                                          const std::string& requested_by,
                                                          const std::string& request_id) {
  const auto found = One(transaction, kSelectWebhook, webhook_id);
  if (!found.ok() || !found->has_value()) return found;
  const auto withdrawn = transaction.Execute(kWithdraw, Params().Text(webhook_id).Text(requested_by).Text(request_id));
  if (!withdrawn.ok()) return withdrawn.status();
  return One(transaction, kSelectWebhook, webhook_id);
}

absl::StatusOr<std::optional<WebhookRow>> FindWebhook(Transaction& transaction, const std::string& webhook_id) {
  return One(transaction, kSelectWebhook, webhook_id);
}

absl::StatusOr<std::vector<WebhookRow>> ListWebhooks(Transaction& transaction, bool withdrawn_too,
                                                     const std::string& after_id, int limit) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kSelectWebhooks, Params().Bool(withdrawn_too).Text(after_id).Int(limit));
  if (!rows.ok()) return rows.status();
  return rows->Checked(ReadWebhooks(*rows));
}

absl::Status SaveDelivery(Transaction& transaction, const std::string& webhook_id, const WebhookDelivery& delivery) {
  Params params;
  params.Text(webhook_id).Int(delivery.looked_at_sequence).Int(delivery.delivered_sequence);
  params.OptionalTime(delivery.delivered_at);
  params.OptionalTime(delivery.failing_since);
  params.Int(delivery.failure_count).Text(delivery.last_failure);
  return transaction.Execute(kSave, params).status();
}

std::shared_ptr<WebhookStore> WebhooksIn(Database* database) { return std::make_shared<PostgresWebhooks>(database); }

std::shared_ptr<WebhookDeliveries> WebhookDeliveriesIn(Database* database) {
  return std::make_shared<PostgresDeliveries>(database);
}

}  // namespace sixpoint::storage
