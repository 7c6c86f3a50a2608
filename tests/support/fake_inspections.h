// An InspectionStore in memory, held to the real one by tests/storage/result_store_test.cc, and a reader of its values, held to the real one
// by tests/storage/value_reads_test.cc.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/inspection_values.h"
#include "storage/inspections.h"
#include "tests/support/fake_results.h"

namespace sixpoint::testing {

// What is only read, decisions and work orders, is as it was recorded here.
class FakeInspections final : public FakeResults<storage::InspectionRow, storage::InspectionFilter> {
 public:
  using Row = storage::InspectionRow;
  FakeInspections()
      : FakeResults(&Row::inspection_id, [](const Row& row, const storage::InspectionFilter& filter) {
          return IsListed(row, filter) && IsAsked(filter.verdict, row.verdict) &&
                 IsAsked(filter.work_order, row.work_order);
        }) {}
};

// Fails as the inspections' lists do, each of which is one of its reads.
class FakeValues final : public storage::ValueReader {
 public:
  explicit FakeValues(std::shared_ptr<const FakeInspections> inspections) : inspections_(std::move(inspections)) {}

  absl::StatusOr<std::vector<storage::HoleValuesRow>> Values(const storage::ValueFilter& filter,
                                                             std::int64_t before_sequence, int inspection_limit,
                                                             storage::Deadline deadline) const override {
    const auto all = inspections_->List({}, 0, std::numeric_limits<int>::max(), deadline);
    if (!all.ok()) return all.status();
    std::vector<storage::HoleValuesRow> values;
    std::set<std::string> seen;  // blades
    for (const storage::InspectionRow& row : *all) {
      const bool is_newest = seen.insert(row.blade_serial).second;
      if (before_sequence != 0 && row.recorded.sequence >= before_sequence) continue;
      if (!Matches(row, filter) || (filter.only_newest && !is_newest)) continue;
      const std::vector<storage::HoleValuesRow> own = ValuesOf(row, filter);
      // Where one hole is asked for, an inspection without it is none of them.
      if (own.empty() && !filter.hole_name.empty()) continue;
      if (inspection_limit-- <= 0) break;
      values.insert(values.end(), own.begin(), own.end());
    }
    return values;
  }

 private:
  static bool Matches(const storage::InspectionRow& row, const storage::ValueFilter& filter) {
    return IsAsked(filter.blade_serial, row.blade_serial) && row.blade_serial.rfind(filter.serial_prefix, 0) == 0 &&
           IsAsked(filter.part_id, row.part_id) && IsAsked(filter.machine_id, row.machine_id) &&
           storage::Contains(filter.recorded, row.recorded.recorded_at) && IsAsked(filter.verdict, row.verdict) &&
           (IsAsked(filter.calibration_id, row.sensor_calibration_id) ||
            filter.calibration_id == row.rotation_calibration_id);
  }
  static std::vector<storage::HoleValuesRow> ValuesOf(const storage::InspectionRow& row,
                                                      const storage::ValueFilter& filter) {
    std::vector<storage::HoleValuesRow> values;
    for (const storage::InspectionHoleRow& hole : row.holes) {
      if (!IsAsked(filter.group_name, hole.group_name) || !IsAsked(filter.hole_name, hole.hole_name)) continue;
      storage::HoleValuesRow& value = values.emplace_back();
      value.sequence = row.recorded.sequence;
      value.recorded_at = row.recorded.recorded_at;
      value.inspection_id = row.inspection_id;
      value.blade_serial = row.blade_serial;
      value.machine_id = row.machine_id;
      value.machine_revision = row.machine_revision;
      value.part_id = row.part_id;
      value.part_revision = row.part_revision;
      value.method = row.method;
      value.group_name = hole.group_name;
      value.hole_name = hole.hole_name;
      value.position_verdict = hole.position_verdict;
      value.inclination_verdict = hole.inclination_verdict;
      value.position_tolerance_mm = hole.position_tolerance_mm;
      value.inclination_tolerance_deg = hole.inclination_tolerance_deg;
      if (!hole.measured) continue;
      value.position_error_mm = hole.measured->position_error_mm;
      value.inclination_error_deg = hole.measured->inclination_error_deg;
      value.position_expanded_uncertainty_um = hole.measured->position_expanded_uncertainty_um;
      value.inclination_expanded_uncertainty_deg = hole.measured->inclination_expanded_uncertainty_deg;
    }
    return values;
  }

  const std::shared_ptr<const FakeInspections> inspections_;
};

}  // namespace sixpoint::testing
