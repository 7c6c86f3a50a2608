#include "storage/clearances.h"

#include "refusal/message_text.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

// Under the lock of a holder and scope the newest event is the newest for whoever waits for it.
constexpr char kLockClearance[] =
    "SELECT pg_advisory_xact_lock(hashtextextended('clearances/' || pseudonym_of($1) || $2, 0))";
constexpr char kSelectRequest[] =
    "SELECT holder = clearance_holder($2) AND scope = $3 AND granted = $4::boolean FROM clearance_events "
    "WHERE request_id = $1::uuid";
constexpr char kInsertClearanceEvent[] =
    "INSERT INTO clearance_events (event_id, holder, scope, granted, took_effect, requested_by, request_id) VALUES "
    "($1, "
    "$2, $3, $4::boolean, $5::boolean, $6, $7::uuid)";
#define SIXPOINT_SELECT_CLEARANCES                                                                   \
  "SELECT name_of(holder), scope, granted_sequence, granted_at, name_of(granted_by), withdrawn_at, " \
  "name_of(withdrawn_by) FROM clearances WHERE "
constexpr char kSelectNewestClearance[] =
    SIXPOINT_SELECT_CLEARANCES "holder = clearance_holder($1) AND scope = $2 ORDER BY granted_sequence DESC LIMIT 1";
constexpr char kSelectClearances[] = SIXPOINT_SELECT_CLEARANCES
    "($1 = '' OR holder = clearance_holder($1)) AND ($2 = '' OR scope = $2) AND ($3::boolean OR withdrawn_at IS NULL) "
    "AND ($4::bigint = 0 OR granted_sequence < $4::bigint) ORDER BY granted_sequence DESC LIMIT $5";
#undef SIXPOINT_SELECT_CLEARANCES
constexpr char kSight[] = "SELECT hidden, seen_blades FROM sight_of($1, $2::integer)";
// PostgreSQL counts a look into every month for each row that it joins, where at run time it looks into one: of what a few blades have
// it would rather read all months whole. Until the transaction ends.
constexpr char kByIndex[] =
    "SELECT set_config('enable_hashjoin', 'off', true), set_config('enable_mergejoin', 'off', true)";
constexpr char kFirstHidden[] = "SELECT first_hidden($1::text[], $2, $3::boolean)";
// Of the customer that a part is to have ($3) and the one that it has, who is not cleared for; where they are the same nothing is asked.
constexpr char kCustomerMissing[] =
    "WITH present AS (SELECT customer_id FROM restricted_parts WHERE part_id = $2) "
    "SELECT asked.customer_id FROM (SELECT $3::text COLLATE \"C\" AS customer_id UNION ALL SELECT customer_id FROM "
    "present) asked "
    "WHERE NOT EXISTS (SELECT 1 FROM present WHERE customer_id = $3) AND NOT EXISTS (SELECT 1 FROM clearances WHERE "
    "holder = clearance_holder($1) AND withdrawn_at IS NULL AND scope = 'customers/' || asked.customer_id) LIMIT 1";
// Of a reader who sees no more than these, lists go by blade; of one who sees more, few rows have to be left out on the way.
constexpr int kFewBlades = 1000;
constexpr std::size_t kLongestName = 80;

std::vector<ClearanceRow> ReadClearances(const Rows& rows) {
  std::vector<ClearanceRow> clearances;
  for (int row = 0; row < rows.count(); ++row) {
    ClearanceRow& read = clearances.emplace_back();
    read.holder = rows.Text(row, 0);
    read.scope = rows.Text(row, 1);
    read.granted_sequence = rows.Int(row, 2);
    read.granted_at = rows.Time(row, 3);
    read.granted_by = rows.Text(row, 4);
    if (rows.IsNull(row, 5)) continue;
    read.withdrawn_at = rows.Time(row, 5);
    read.withdrawn_by = rows.Text(row, 6);
  }
  return clearances;
}

absl::StatusOr<std::optional<ClearanceRow>> Newest(Transaction& transaction, const ClearanceOrder& order) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kSelectNewestClearance, Params().Text(order.holder).Text(order.scope));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(std::optional(ReadClearances(*rows).front()));
}

// True: the request was recorded before.
absl::StatusOr<bool> WasRecorded(Transaction& transaction, const ClearanceOrder& order, bool granted) {
  const absl::StatusOr<Rows> rows = transaction.Execute(
      kSelectRequest, Params().Text(order.request_id).Text(order.holder).Text(order.scope).Bool(granted));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return false;
  const bool is_same = rows->Bool(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  if (is_same) return true;
  return RequestIdReused(order.request_id);
}

// What stands then; none: nothing was there to withdraw.
absl::StatusOr<std::optional<ClearanceRow>> Decide(Transaction& transaction, const ClearanceOrder& order,
                                                   bool granted) {
  const absl::StatusOr<Rows> locked =
      transaction.Execute(kLockClearance, Params().Text(order.holder).Text(order.scope));
  if (!locked.ok()) return locked.status();
  const absl::StatusOr<bool> before = WasRecorded(transaction, order, granted);
  if (!before.ok()) return before.status();
  absl::StatusOr<std::optional<ClearanceRow>> newest = Newest(transaction, order);
  if (!newest.ok() || *before) return newest;
  const bool holds = newest->has_value() && !(*newest)->withdrawn_at.has_value();
  if (!granted && !newest->has_value()) return newest;
  Params params;
  params.Uuid(NewUuid()).Text(order.holder).Text(order.scope).Bool(granted).Bool(holds != granted);
  params.Text(order.requested_by).Text(order.request_id);
  if (const auto inserted = transaction.Execute(kInsertClearanceEvent, params); !inserted.ok())
    return inserted.status();
  return Newest(transaction, order);
}

class PostgresClearances final : public ClearanceReader {
 public:
  explicit PostgresClearances(Database* database) : database_(database) {}
  absl::StatusOr<std::optional<std::string>> FirstHidden(const Reader& reader, const std::vector<std::string>& names,
                                                         Unrecorded unrecorded, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return storage::FirstHidden(t, reader, names, unrecorded); });
  }

 private:
  Database* const database_;
};

}  // namespace

absl::StatusOr<ClearanceRow> GrantClearance(Transaction& transaction, const ClearanceOrder& order) {
  absl::StatusOr<std::optional<ClearanceRow>> granted = Decide(transaction, order, true);
  if (!granted.ok()) return granted.status();
  if (!granted->has_value()) return absl::InternalError("clearance: granted and not there");
  return **std::move(granted);
}

absl::StatusOr<std::optional<ClearanceRow>> WithdrawClearance(Transaction& transaction, const ClearanceOrder& order) {
  return Decide(transaction, order, false);
}

absl::StatusOr<std::vector<ClearanceRow>> ListClearances(Transaction& transaction, const ClearanceFilter& filter,
                                                         std::int64_t before_sequence, int limit) {
  Params params;
  params.Text(filter.holder).Text(filter.scope).Bool(filter.withdrawn_too).Int(before_sequence).Int(limit);
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectClearances, params);
  if (!rows.ok()) return rows.status();
  return rows->Checked(ReadClearances(*rows));
}

void AddSight(const Sight& sight, Params* params) {
  if (sight.seen_blades)
    params->Texts({}).Texts(*sight.seen_blades);
  else
    params->Texts(sight.hidden_parts).Null();
}

absl::StatusOr<Sight> SightOf(Transaction& transaction, const Reader& reader) {
  if (reader.sees_all) return Sight();
  const absl::StatusOr<Rows> rows = transaction.Execute(kSight, Params().Text(reader.identity).Int(kFewBlades));
  if (!rows.ok()) return rows.status();
  Sight sight;
  sight.hidden_parts = rows->Texts(0, 0);
  if (rows->IsNull(0, 1)) return rows->Checked(std::move(sight));
  sight.seen_blades = rows->Texts(0, 1);
  if (const absl::StatusOr<Rows> set = transaction.Execute(kByIndex); !set.ok()) return set.status();
  return rows->Checked(std::move(sight));
}

absl::StatusOr<std::optional<std::string>> FirstHidden(Transaction& transaction, const Reader& reader,
                                                       const std::vector<std::string>& names, Unrecorded unrecorded) {
  if (reader.sees_all || names.empty()) return std::nullopt;
  const absl::StatusOr<Rows> rows = transaction.Execute(
      kFirstHidden, Params().Texts(names).Text(reader.identity).Bool(unrecorded == Unrecorded::kIsHidden));
  if (!rows.ok()) return rows.status();
  if (rows->IsNull(0, 0)) return std::nullopt;
  return rows->Checked(std::optional(rows->Text(0, 0)));
}

absl::Status NotSeen(const std::string& field, const std::string& name, const Reader& reader) {
  return WithReason(absl::PermissionDeniedError(field + ": " + Tame(name, kLongestName) + ", want what " +
                                                reader.identity + " is cleared to see"),
                    kClearanceMissing);
}

absl::Status CheckPartSeen(Transaction& transaction, const Reader& reader, const std::string& part_id,
                           const std::string& customer_id) {
  const std::string name = "parts/" + part_id;
  const auto hidden = FirstHidden(transaction, reader, {name}, Unrecorded::kIsSeen);
  if (!hidden.ok()) return hidden.status();
  if (hidden->has_value()) return NotSeen("part_id", name, reader);
  if (customer_id.empty() || reader.sees_all) return absl::OkStatus();
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kCustomerMissing, Params().Text(reader.identity).Text(part_id).Text(customer_id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return rows->status();
  const std::string missing = rows->Text(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return WithReason(
      absl::PermissionDeniedError("part.customer: " + Tame(customer_id, kLongestName) + ", want " + reader.identity +
                                  " cleared for customers/" + Tame(missing, kLongestName)),
      kClearanceMissing);
}

std::shared_ptr<const ClearanceReader> ClearancesIn(Database* database) {
  return std::make_shared<PostgresClearances>(database);
}

}  // namespace sixpoint::storage
