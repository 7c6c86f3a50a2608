// A SectionStore in memory; held to the real one by tests/storage/result_store_test.cc and result_reads_test.cc.
#pragma once

#include <string>
#include <vector>

#include "storage/sections.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeSections final
    : public FakeResults<storage::SectionMeasurementRow, storage::SectionFilter, storage::SectionStore> {
 public:
  using Row = storage::SectionMeasurementRow;
  FakeSections()
      : FakeResults(&Row::section_measurement_id,
                    [](const Row& row, const storage::SectionFilter& filter) { return IsListed(row, filter); }) {}

  absl::StatusOr<std::vector<storage::SectionOutlineRow>> Outlines(const std::string& section_measurement_id,
                                                                   storage::Deadline) const override {
    return ListOf(section_measurement_id, &Row::outlines);
  }

 private:
  Row ReadBack(Row row, const storage::SectionFilter& filter) const override {
    row.outlines.clear();
    if (filter.with_values) return row;
    for (storage::SectionRow& section : row.sections) section.values.clear();
    return row;
  }
};

}  // namespace sixpoint::testing
