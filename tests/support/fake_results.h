// A ResultStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/result_store_test.cc.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/result_filter.h"
#include "storage/result_store.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

// Whether that is what a list asks for: an empty text asks for nothing.
inline bool IsAsked(const std::string& asked, const std::string& is) { return asked.empty() || asked == is; }

// What lists of all results ask for. Whose table an axis was taken with, and who may see what, PostgreSQL alone knows.
template <typename Row>
bool IsListed(const Row& row, const storage::ResultFilter& filter) {
  return IsAsked(filter.blade_serial, row.blade_serial) && IsAsked(filter.machine_id, row.machine_id) &&
         IsAsked(filter.part_id, row.part_id) && storage::Contains(filter.recorded, row.recorded.recorded_at) &&
         (IsAsked(filter.calibration_id, row.sensor_calibration_id) ||
          filter.calibration_id == row.rotation_calibration_id);
}

// Store: what it is, where an aggregate's store has more to ask.
template <typename Row, typename Filter, typename Store = storage::ResultStore<Row, Filter>>
class FakeResults : public Store {
 public:
  // id: the row's member; matches(row, filter): whether a list under that filter holds the row.
  FakeResults(std::string Row::*id, std::function<bool(const Row&, const Filter&)> matches)
      : id_(id), matches_(std::move(matches)) {}

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) {
    const auto lock = record_.Lock();
    record_.Fail(std::move(failure));
  }
  // Happens before each list is read, and may call the store: what comes about between two pages.
  void BeforeList(std::function<void()> meanwhile) {
    const auto lock = record_.Lock();
    before_list_ = std::move(meanwhile);
  }
  // As they were recorded, with what is only written.
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
    if (const std::function<void()> meanwhile = WhatIsBeforeAList()) meanwhile();
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    std::vector<Row> listed;
    for (auto row = rows_.rbegin(); row != rows_.rend() && static_cast<int>(listed.size()) < limit; ++row)
      if ((before_sequence == 0 || row->recorded.sequence < before_sequence) && matches_(*row, filter))
        listed.push_back(ReadBack(*row, filter));
    return listed;
  }
  absl::StatusOr<Row> Record(const storage::RecordedRequest& request, Row row, const storage::RecordEntry& entry,
                             storage::Deadline) override {
    const auto lock = record_.Lock();
    const auto work = [&]() -> absl::StatusOr<Row> {
      if (absl::Status good = CheckNew(row); !good.ok()) return good;
      row.recorded = record_.Next();
      record_.Append(entry, row.recorded);
      rows_.push_back(row);
      return row;
    };
    return record_.template Once<Row>(
        request, [this](const std::string& id) { return Known(id); }, work,
        [this](const Row& recorded) { return recorded.*id_; });
  }

 protected:
  // As a reader gets it: without what is only written, and what the filter does not ask for.
  virtual Row ReadBack(Row row, const Filter&) const { return row; }
  // Whether the store takes it.
  virtual absl::Status CheckNew(const Row&) const { return absl::OkStatus(); }

  // As they were recorded; fails as every call does.
  absl::StatusOr<std::vector<Row>> AllWhole() const {
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    return rows_;
  }
  // Of the row of that id, as it was recorded; none: there is no such row.
  template <typename Value>
  absl::StatusOr<std::optional<Value>> MemberOf(const std::string& id, Value Row::*member) const {
    const absl::StatusOr<std::vector<Row>> rows = AllWhole();
    if (!rows.ok()) return rows.status();
    for (const Row& row : *rows)
      if (row.*id_ == id) return std::optional<Value>(row.*member);
    return std::optional<Value>();
  }
  // The same of a list: empty where there is no such row.
  template <typename Value>
  absl::StatusOr<std::vector<Value>> ListOf(const std::string& id, std::vector<Value> Row::*members) const {
    absl::StatusOr<std::optional<std::vector<Value>>> found = MemberOf(id, members);
    if (!found.ok()) return found.status();
    return found->value_or(std::vector<Value>());
  }

 private:
  std::optional<Row> Known(const std::string& id) const {
    for (const Row& row : rows_)
      if (row.*id_ == id) return ReadBack(row, {});
    return std::nullopt;
  }
  std::function<void()> WhatIsBeforeAList() const {
    const auto lock = record_.Lock();
    return before_list_;
  }

  std::string Row::*const id_;
  const std::function<bool(const Row&, const Filter&)> matches_;
  std::function<void()> before_list_;
  FakeRecord record_;
  std::vector<Row> rows_;  // as recorded
};

}  // namespace sixpoint::testing
