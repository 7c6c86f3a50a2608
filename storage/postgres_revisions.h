// What has revisions, in PostgreSQL: one store for all kinds, each by statements of its own.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/one_read.h"
#include "storage/plant_store.h"
#include "storage/requests.h"

namespace sixpoint::storage {

// The row that insert gives may be one of before.
template <typename Row, typename Find>
absl::StatusOr<Row> RecordRow(Database& database, const RecordedRequest& request, const Row& row,
                              const RecordEntry& entry, Deadline deadline, const Find& find,
                              absl::StatusOr<Row> (*insert)(Transaction&, Row, RecordEntry)) {
  RecordEntry kept = entry;
  kept.request = KeptRequestOf(request);
  return RecordOnce<Row>(database, request, deadline, find, [&](Transaction& t) { return insert(t, row, kept); });
}

template <typename Row>
class PostgresRevisions final : public RevisionStore<Row> {
 public:
  // Each in a transaction of the caller's.
  struct Statements {
    absl::StatusOr<Row> (*insert)(Transaction&, Row, RecordEntry);
    absl::StatusOr<std::optional<Row>> (*find)(Transaction&, const std::string& id, int revision);
    // As ListRegistered.
    absl::StatusOr<std::vector<std::string>> (*list)(Transaction&, const RegisteredFilter& filter,
                                                     const std::string& after, int limit);
    // As find, of what a list has of it; none: find.
    absl::StatusOr<std::optional<Row>> (*find_listed)(Transaction&, const std::string& id, int revision) = nullptr;
    // The same of a full list; none: find_listed.
    absl::StatusOr<std::optional<Row>> (*find_in_full)(Transaction&, const std::string& id, int revision) = nullptr;
  };
  PostgresRevisions(Database* database, const Statements& statements) : database_(database), statements_(statements) {}

  absl::StatusOr<std::optional<Row>> Find(const std::string& id, int revision, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return statements_.find(t, id, revision); });
  }
  absl::StatusOr<std::vector<Row>> List(const RegisteredFilter& filter, const std::string& after, int limit,
                                        Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::vector<Row>> {
      const absl::StatusOr<std::vector<std::string>> ids = statements_.list(t, filter, after, limit);
      if (!ids.ok()) return ids.status();
      auto find = statements_.find_listed == nullptr ? statements_.find : statements_.find_listed;
      if (filter.full && statements_.find_in_full != nullptr) find = statements_.find_in_full;
      std::vector<Row> rows;
      for (const std::string& id : *ids) {
        absl::StatusOr<std::optional<Row>> row = find(t, id, 0);
        if (!row.ok()) return row.status();
        if (!row->has_value()) return absl::DataLossError(id + ": listed, but without a revision");
        rows.push_back(**std::move(row));
      }
      return rows;
    });
  }
  absl::StatusOr<std::optional<Row>> FindRecorded(const RecordedRequest& request, Deadline deadline) const override {
    return storage::FindRecorded<Row>(*database_, request, deadline, finder());
  }
  absl::StatusOr<Row> Record(const RecordedRequest& request, Row row, const RecordEntry& entry,
                             Deadline deadline) override {
    return RecordRow(*database_, request, row, entry, deadline, finder(), statements_.insert);
  }

 private:
  auto finder() const {
    return [find = statements_.find](Transaction& t, const std::string& name) {
      const NamedId named = IdOfName(name);
      return find(t, named.id, named.revision);
    };
  }
  Database* const database_;
  const Statements statements_;
};

}  // namespace sixpoint::storage
