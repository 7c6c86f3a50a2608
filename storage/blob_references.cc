#include "storage/blob_references.h"

#include <utility>

namespace sixpoint::storage {
namespace {

// Names come quoted from the server.
constexpr char kSelectReferences[] =
    "SELECT format('%I.%I', n.nspname, c.relname), quote_ident(a.attname), c.oid = 'scan_blocks'::regclass "
    "FROM pg_constraint k JOIN pg_class c ON c.oid = k.conrelid JOIN pg_namespace n ON n.oid = c.relnamespace "
    "JOIN pg_attribute a ON a.attrelid = k.conrelid AND a.attnum = k.conkey[1] "
    "WHERE k.contype = 'f' AND k.confrelid = 'blobs'::regclass AND k.conparentid = 0 ORDER BY 1, 2";
constexpr char kOfKeptScan[] = " AND NOT EXISTS (SELECT 1 FROM scan_deletions d WHERE d.scan_key = r.scan_key)";

}  // namespace

absl::StatusOr<BlobConditions> ReadBlobConditions(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectReferences);
  if (!rows.ok()) return rows.status();
  // A catalogue that shows no references is one that we may not read, not one without any.
  if (rows->count() == 0) return absl::InternalError("blobs: the schema shows no foreign key to them");
  BlobConditions conditions;
  for (int row = 0; row < rows->count(); ++row) {
    const std::string reference =
        " AND NOT EXISTS (SELECT 1 FROM " + rows->Text(row, 0) + " r WHERE r." + rows->Text(row, 1) + " = b.sha256";
    conditions.unreferenced += reference + ")";
    conditions.unneeded += reference + (rows->Bool(row, 2) ? kOfKeptScan : "") + ")";
  }
  return rows->Checked(std::move(conditions));
}

}  // namespace sixpoint::storage
