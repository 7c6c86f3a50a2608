// A MachiningPassStore in memory; held to the real one by tests/storage/result_store_test.cc and result_reads_test.cc.
#pragma once

#include <optional>
#include <string>

#include "storage/machining_passes.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeMachiningPasses final
    : public FakeResults<storage::MachiningPassRow, storage::MachiningPassFilter, storage::MachiningPassStore> {
 public:
  using Row = storage::MachiningPassRow;
  FakeMachiningPasses()
      : FakeResults(&Row::pass_id, [](const Row& row, const storage::MachiningPassFilter& filter) {
          return IsListed(row, filter) && IsAsked(filter.outcome, row.outcome);
        }) {}

  absl::StatusOr<std::optional<storage::BlankPatchesRow>> Patches(const std::string& pass_id,
                                                                  storage::Deadline) const override {
    return MemberOf(pass_id, &Row::patches);
  }

 private:
  Row ReadBack(Row row, const storage::MachiningPassFilter&) const override {
    row.patches = {};
    return row;
  }
};

}  // namespace sixpoint::testing
