// What keeps dispositions, in memory; held to the real one by tests/storage/disposition_store_test.cc.
#pragma once

#include "storage/dispositions.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

// They are read with their inspections: nothing is listed.
class FakeDispositions final : public FakeResults<storage::DispositionRow, storage::ResultFilter> {
 public:
  using Row = storage::DispositionRow;
  FakeDispositions()
      : FakeResults(&Row::disposition_id, [](const Row&, const storage::ResultFilter&) { return false; }) {}

 private:
  Row ReadBack(Row row, const storage::ResultFilter&) const override {
    row.machine_id.clear();
    return row;
  }
};

}  // namespace sixpoint::testing
