#include "storage/work_orders.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertWorkOrder[] =
    "INSERT INTO blade_work_orders (blade_serial, revision, work_order, operation, requested_by, software_version, "
    "record_id) SELECT $1::text, coalesce(max(revision), 0) + 1, $2::text, $3::text, $4::text, $5::text, $6::uuid "
    "FROM blade_work_orders WHERE blade_serial = $1";
constexpr char kSelectAssigned[] = "SELECT blade_serial FROM blade_work_orders WHERE record_id = $1";

}  // namespace

absl::Status InsertWorkOrder(Transaction& transaction, const BladeRow& blade, const RecordEntry& entry,
                             const std::string& record_id) {
  Params params;
  params.Text(blade.blade_serial).Text(blade.work_order).OptionalText(blade.operation);
  params.Text(entry.requested_by).Text(entry.software_version).Uuid(record_id);
  return transaction.Execute(kInsertWorkOrder, params).status();
}

absl::StatusOr<BladeRow> AssignWorkOrder(Transaction& transaction, BladeRow blade, RecordEntry entry) {
  const absl::StatusOr<Rows> locked = transaction.Execute(kLockBlade, Params().Text(blade.blade_serial));
  if (!locked.ok()) return locked.status();
  absl::StatusOr<std::optional<BladeRow>> known = FindBlade(transaction, blade.blade_serial);
  if (!known.ok()) return known.status();
  if (!known->has_value()) return absl::NotFoundError("blade " + blade.blade_serial + ": not registered");
  const std::string record_id = NewUuid();
  if (const absl::Status assigned = InsertWorkOrder(transaction, blade, entry, record_id); !assigned.ok())
    return assigned;
  entry.kind = "assignment";
  entry.name = "assignments/" + record_id;
  entry.blade = blade.blade_serial;
  if (const auto recorded = AppendRecord(transaction, record_id, entry); !recorded.ok()) return recorded.status();
  (*known)->work_order = blade.work_order;
  (*known)->operation = blade.operation;
  return **std::move(known);
}

absl::StatusOr<std::optional<BladeRow>> FindAssigned(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectAssigned, Params().Uuid(IdOfName(name).id));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  const std::string serial = rows->Text(0, 0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return FindBlade(transaction, serial);
}

}  // namespace sixpoint::storage
