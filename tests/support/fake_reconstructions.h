// A ReconstructionStore in memory; held to the real one by tests/storage/result_store_test.cc and result_reads_test.cc.
#pragma once

#include <optional>
#include <string>

#include "storage/blobs.h"
#include "storage/reconstructions.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeReconstructions final
    : public FakeResults<storage::ReconstructionRow, storage::ReconstructionFilter, storage::ReconstructionStore> {
 public:
  using Row = storage::ReconstructionRow;
  FakeReconstructions()
      : FakeResults(&Row::reconstruction_id, [](const Row& row, const storage::ReconstructionFilter& filter) {
          return IsListed(row, filter) && IsAsked(filter.outcome, row.outcome);
        }) {}

  absl::StatusOr<std::optional<storage::BlankPatchesRow>> Patches(const std::string& reconstruction_id,
                                                                  storage::Deadline) const override {
    return MemberOf(reconstruction_id, &Row::patches);
  }
  absl::StatusOr<std::string> Lattice(const std::string& lattice_sha256, storage::Deadline) const override {
    const auto rows = AllWhole();
    if (!rows.ok()) return rows.status();
    for (const Row& row : *rows)
      if (row.lattice_sha256 == lattice_sha256) return row.lattice;
    return absl::NotFoundError("blob " + lattice_sha256 + ": not stored");
  }

 private:
  Row ReadBack(Row row, const storage::ReconstructionFilter&) const override {
    row.patches = {};
    row.lattice.clear();
    return row;
  }
  absl::Status CheckNew(const Row& row) const override {
    if (row.lattice_sha256.empty() || storage::Sha256Hex(row.lattice) == row.lattice_sha256) return absl::OkStatus();
    return absl::InternalError("lattice: want the digest " + row.lattice_sha256);
  }
};

}  // namespace sixpoint::testing
