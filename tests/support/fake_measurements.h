// What keeps other instruments' measurements, in memory; held to the real one by tests/storage/measurement_store_test.cc.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/measurements.h"
#include "tests/support/fake_record.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeMeasurements final : public storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>,
                               public storage::ResultWriter<storage::MeasurementImport> {
 public:
  using Row = storage::MeasurementRow;
  using Import = storage::MeasurementImport;

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure) {
    const auto lock = record_.Lock();
    record_.Fail(std::move(failure));
  }
  std::vector<Row> rows() const {
    const auto lock = record_.Lock();
    std::vector<Row> rows;
    for (const Import& import : imports_)
      rows.insert(rows.end(), import.measurements.begin(), import.measurements.end());
    return rows;
  }

  absl::StatusOr<std::optional<Row>> Find(const std::string& id, storage::Deadline) const override {
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    for (const Import& import : imports_)
      for (const Row& row : import.measurements)
        if (row.measurement_id == id) return row;
    return std::nullopt;
  }
  absl::StatusOr<std::vector<Row>> List(const storage::MeasurementFilter& filter, std::int64_t before_sequence,
                                        int limit, storage::Deadline) const override {
    const auto lock = record_.Lock();
    if (!record_.failure().ok()) return record_.failure();
    std::vector<Row> listed;
    for (auto import = imports_.rbegin(); import != imports_.rend(); ++import)
      for (auto row = import->measurements.rbegin(); row != import->measurements.rend(); ++row) {
        if (static_cast<int>(listed.size()) == limit) return listed;
        if ((before_sequence != 0 && row->recorded.sequence >= before_sequence) || !Matches(*row, filter)) continue;
        listed.push_back(*row);
        if (!filter.with_values) listed.back().values.clear();
      }
    return listed;
  }

  absl::StatusOr<std::optional<Import>> FindRecorded(const storage::RecordedRequest& request,
                                                     storage::Deadline) const override {
    const auto lock = record_.Lock();
    return record_.Kept<Import>(request, [this](const std::string& id) { return Known(id); });
  }
  absl::StatusOr<Import> Record(const storage::RecordedRequest& request, Import import,
                                const storage::RecordEntry& entry, storage::Deadline) override {
    const auto lock = record_.Lock();
    const auto work = [&]() -> absl::StatusOr<Import> {
      for (Row& row : import.measurements) {
        storage::RecordEntry own = entry;
        own.name = "measurements/" + row.measurement_id;
        own.blade = row.blade_serial;
        row.recorded = record_.Next();
        row.file.requested_by = import.requested_by;
        record_.Append(std::move(own), row.recorded);
      }
      if (!import.measurements.empty()) import.recorded = import.measurements.front().recorded;
      imports_.push_back(import);
      return import;
    };
    return record_.Once<Import>(
        request, [this](const std::string& id) { return Known(id); }, work,
        [](const Import& recorded) { return recorded.measurements.front().measurement_id; });
  }

 private:
  static bool Matches(const Row& row, const storage::MeasurementFilter& filter) {
    return IsAsked(filter.blade_serial, row.blade_serial) && IsAsked(filter.part_id, row.file.part_id) &&
           IsAsked(filter.drawing_id, row.file.drawing_id) &&
           IsAsked(filter.instrument_serial_number, row.file.instrument.serial_number) &&
           IsAsked(filter.file_sha256, row.file.sha256) && storage::Contains(filter.recorded, row.recorded.recorded_at);
  }
  std::optional<Import> Known(const std::string& first_id) const {
    for (const Import& import : imports_)
      if (import.measurements.front().measurement_id == first_id) return import;
    return std::nullopt;
  }

  FakeRecord record_;
  std::vector<Import> imports_;  // as recorded
};

}  // namespace sixpoint::testing
