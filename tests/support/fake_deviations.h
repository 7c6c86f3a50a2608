// A DeviationStore in memory; held to the real one by tests/storage/result_store_test.cc and result_reads_test.cc.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "storage/blobs.h"
#include "storage/deviations.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

class FakeDeviations final
    : public FakeResults<storage::DeviationMapRow, storage::DeviationFilter, storage::DeviationStore> {
 public:
  using Row = storage::DeviationMapRow;
  FakeDeviations()
      : FakeResults(&Row::deviation_id, [](const Row& row, const storage::DeviationFilter& filter) {
          return IsListed(row, filter) && IsAsked(filter.verdict, row.verdict);
        }) {}

  absl::StatusOr<std::optional<storage::DeviationPatchesRow>> Patches(const std::string& deviation_id,
                                                                      storage::Deadline) const override {
    return MemberOf(deviation_id, &Row::patches);
  }
  absl::StatusOr<std::vector<storage::DeviationCloudBlockRow>> Cloud(const std::string& deviation_id,
                                                                     storage::Deadline) const override {
    return ListOf(deviation_id, &Row::cloud);
  }
  absl::StatusOr<std::string> CloudBytes(const std::string& blob_sha256, storage::Deadline) const override {
    const auto rows = AllWhole();
    if (!rows.ok()) return rows.status();
    for (const Row& row : *rows)
      for (std::size_t i = 0; i < row.cloud.size(); ++i)
        if (row.cloud[i].blob_sha256 == blob_sha256) return row.cloud_bytes.at(i);
    return absl::NotFoundError("blob " + blob_sha256 + ": not stored");
  }

 private:
  Row ReadBack(Row row, const storage::DeviationFilter&) const override {
    row.patches = {};
    row.cloud.clear();
    row.cloud_bytes.clear();
    return row;
  }
  absl::Status CheckNew(const Row& row) const override {
    for (std::size_t i = 0; i < row.cloud.size(); ++i)
      if (storage::Sha256Hex(row.cloud_bytes.at(i)) != row.cloud[i].blob_sha256)
        return absl::InternalError("cloud: want the digest " + row.cloud[i].blob_sha256);
    return absl::OkStatus();
  }
};

}  // namespace sixpoint::testing
