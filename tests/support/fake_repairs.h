// A RepairStore in memory; held to the real one by tests/storage/result_store_test.cc and result_reads_test.cc.
#pragma once

#include <string>
#include <vector>

#include "storage/repairs.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeRepairs final : public FakeResults<storage::RepairRow, storage::RepairFilter, storage::RepairStore> {
 public:
  using Row = storage::RepairRow;
  FakeRepairs()
      : FakeResults(&Row::repair_id,
                    [](const Row& row, const storage::RepairFilter& filter) { return IsListed(row, filter); }) {}

  absl::StatusOr<std::vector<storage::RepairContourRow>> Contours(const std::string& repair_id,
                                                                  storage::Deadline) const override {
    return ListOf(repair_id, &Row::contours);
  }
  absl::StatusOr<std::vector<storage::RepairLapRow>> Laps(const std::string& repair_id,
                                                          storage::Deadline) const override {
    return ListOf(repair_id, &Row::laps);
  }

 private:
  Row ReadBack(Row row, const storage::RepairFilter&) const override {
    row.contours.clear();
    row.laps.clear();
    return row;
  }
};

}  // namespace sixpoint::testing
