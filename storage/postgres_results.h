// A ResultStore in PostgreSQL, of an aggregate's own statements.
#pragma once

#include <utility>

#include "storage/one_read.h"
#include "storage/requests.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// Store: what it is, where an aggregate's store has more to ask.
template <typename Row, typename Filter, typename Store = ResultStore<Row, Filter>>
class PostgresResults : public Store {
 public:
  // Each in a transaction of the caller's; insert appends to the journal and comes last.
  struct Statements {
    absl::StatusOr<Recorded> (*insert)(Transaction&, const Row&, const RecordEntry&);
    absl::StatusOr<std::optional<Row>> (*find)(Transaction&, const std::string& id);
    absl::StatusOr<std::vector<Row>> (*list)(Transaction&, const Filter&, std::int64_t before_sequence, int limit);
  };
  PostgresResults(Database* database, const Statements& statements) : database_(database), statements_(statements) {}

  absl::StatusOr<std::optional<Row>> FindRecorded(const RecordedRequest& request, Deadline deadline) const override {
    return storage::FindRecorded<Row>(*database_, request, deadline, finder());
  }
  absl::StatusOr<std::optional<Row>> Find(const std::string& id, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return statements_.find(t, id); });
  }
  absl::StatusOr<std::vector<Row>> List(const Filter& filter, std::int64_t before_sequence, int limit,
                                        Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return statements_.list(t, filter, before_sequence, limit); });
  }
  absl::StatusOr<Row> Record(const RecordedRequest& request, Row row, const RecordEntry& entry,
                             Deadline deadline) override {
    RecordEntry kept = entry;
    kept.request = KeptRequestOf(request);
    return RecordOnce<Row>(*database_, request, deadline, finder(), [&](Transaction& t) -> absl::StatusOr<Row> {
      const absl::StatusOr<Recorded> recorded = statements_.insert(t, row, kept);
      if (!recorded.ok()) return recorded.status();
      row.recorded = *recorded;
      return row;
    });
  }

 protected:
  Database& database() const { return *database_; }

 private:
  auto finder() const {
    return [find = statements_.find](Transaction& t, const std::string& name) { return find(t, IdOfName(name).id); };
  }
  Database* const database_;
  const Statements statements_;
};

}  // namespace sixpoint::storage
