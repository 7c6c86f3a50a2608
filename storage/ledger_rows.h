// What a leaf of the ledger is made of: the rows of an entry, in whichever tables, as texts that are the same whatever the session's
// settings and whatever columns come later, and their digests. The statements are made here and not in the database, where whoever is
// to be found out could change them.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

inline constexpr int kLedgerFormat = 1;

// A table whose rows belong to an entry of the journal.
struct LedgerTable {
  const char* name;
  const char* owner;     // the record_id of the entry that a row t belongs to
  const char* join;      // what `owner` needs beside t; empty: nothing
  bool kept_by_another;  // in the month of what the entry was made from, not in its own
};
// All of them, by name (tests/storage/ledger_test.cc asks the schema for one that is missing here).
const std::vector<LedgerTable>& LedgerTables();
// Whether its rows go with a month that is detached; the rows of the others stay. Here and not asked of the database, which would excuse
// what was taken away (the same test compares with the schema).
bool IsByMonths(const std::string& table);

// Of a transaction: the role that reads the record, and how values are written.
absl::Status BeginLedger(Transaction& transaction);

// The columns as the schema has them now, by the table's name, in order.
using LedgerColumns = std::map<std::string, std::vector<std::string>>;
absl::StatusOr<LedgerColumns> ReadLedgerColumns(Transaction& transaction);

// SQL for the text of a row t: JSON, a column that is NULL left out, every value the text that PostgreSQL writes.
std::string RowTextSql(const std::vector<std::string>& columns);

struct RowsDigest {
  std::int64_t count = 0;
  std::string sha256;  // hexadecimal: over the SHA-256 of each row's text, in their own order
};
using Content = std::map<std::string, RowsDigest>;  // by table
// By record_id; one that has no rows is not in it.
absl::StatusOr<std::map<std::string, Content>> ReadContents(Transaction& transaction, const LedgerColumns& columns,
                                                            const std::vector<std::string>& record_ids);
// "inspections 1 abc...\n", a line a table, and back. Of another text as much as can be read.
std::string ContentText(const Content& content);
Content ContentOf(const std::string& text);

// The rows themselves, by table, each as its text, in the order of their digests; of a table that holds more than `most_bytes` none.
absl::StatusOr<std::map<std::string, std::vector<std::string>>> ReadRowTexts(Transaction& transaction,
                                                                             const LedgerColumns& columns,
                                                                             const std::string& record_id,
                                                                             std::int64_t most_bytes);

struct NamedRecord {
  std::string record_id, name;
  std::int64_t sequence = 0;
  std::string row_sha256;  // 32 bytes
};
// Entries after one sequence and up to another, in order; after the least number there is: that too.
absl::StatusOr<std::vector<NamedRecord>> ReadNames(Transaction& transaction, const LedgerColumns& columns,
                                                   std::int64_t after, std::int64_t until, std::int64_t limit);

struct NameText {
  std::string name, text;  // its row of record_names, as its canonical text
};
// NOT_FOUND where it is gone.
absl::StatusOr<NameText> ReadNameText(Transaction& transaction, const LedgerColumns& columns,
                                      const std::string& record_id);

// Months of the journal that are in the plant: 2026_11.
absl::StatusOr<std::set<std::string>> AttachedMonths(Transaction& transaction);
// Of a UUID of version 7.
std::string MonthOf(const std::string& record_id);

}  // namespace sixpoint::storage
