// A ResultStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/result_store_test.cc.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/result_store.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

template <typename Row, typename Filter>
class FakeResults final : public storage::ResultStore<Row, Filter> {
 public:
  // id: the row's member; matches(row, filter): whether a list under that filter holds the row.
  FakeResults(std::string Row::*id, std::function<bool(const Row&, const Filter&)> matches)
      : id_(id), matches_(std::move(matches)) {}

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) {
    const auto lock = record_.Lock();
    record_.Fail(std::move(failure));
  }
  std::vector<Row> rows() const {
    const auto lock = record_.Lock();
    return rows_;
  }
  std::vector<storage::RecordEntry> entries() const {
    const auto lock = record_.Lock();
    std::vector<storage::RecordEntry> entries;
    for (const storage::JournalEntry& entry : record_.entries()) entries.push_back(entry.entry);
    return entries;
  }

  absl::StatusOr<std::optional<Row>> FindRecorded(const storage::RecordedRequest& request,
                                                  storage::Deadline) const override {
    const auto lock = record_.Lock();
    return record_.template Kept<Row>(request, [this](const std::string& id) { return Known(id); });
  }
  absl::StatusOr<std::optional<Row>> Find(const std::string& id, storage::Deadline) const override {
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    return Known(id);
  }
  absl::StatusOr<std::vector<Row>> List(const Filter& filter, std::int64_t before_sequence, int limit,
                                        storage::Deadline) const override {
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    std::vector<Row> listed;
    for (auto row = rows_.rbegin(); row != rows_.rend() && static_cast<int>(listed.size()) < limit; ++row)
      if ((before_sequence == 0 || row->recorded.sequence < before_sequence) && matches_(*row, filter))
        listed.push_back(*row);
    return listed;
  }
  absl::StatusOr<Row> Record(const storage::RecordedRequest& request, Row row, const storage::RecordEntry& entry,
                             storage::Deadline) override {
    const auto lock = record_.Lock();
    const auto work = [&]() -> absl::StatusOr<Row> {
      row.recorded = record_.Next();
      record_.Append(entry, row.recorded);
      rows_.push_back(row);
      return row;
    };
    return record_.template Once<Row>(
        request, [this](const std::string& id) { return Known(id); }, work,
        [this](const Row& recorded) { return recorded.*id_; });
  }

 private:
  std::optional<Row> Known(const std::string& id) const {
    for (const Row& row : rows_)
      if (row.*id_ == id) return row;
    return std::nullopt;
  }

  std::string Row::*const id_;
  const std::function<bool(const Row&, const Filter&)> matches_;
  FakeRecord record_;
  std::vector<Row> rows_;  // as recorded
};

}  // namespace sixpoint::testing
