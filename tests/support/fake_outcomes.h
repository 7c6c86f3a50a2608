// What became of the corrections of blades that were cut, in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/outcomes_test.cc.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "storage/outcomes.h"
#include "tests/support/customers_parts.h"
#include "tests/support/cut_blade.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

// The plant is the one of CutBlades, each event a minute after the one before. Who may see what, and what is too much for an answer, is
// PostgreSQL's alone.
class FakeOutcomes final : public storage::OutcomeReader {
 public:
  FakeOutcomes();
  // As those of CutBlades.
  CutNames Cut(const CutBlade& blade);
  std::string InspectAnew(const CutBlade& blade);
  void CalibrateAxesAnew();
  void Withdraw(const std::string& calibration);
  const MachinesCalibrations& calibrations() const { return calibrations_; }

  // Every read fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure);
  // As where the rows are damaged: of no calibration the axes are there.
  void LoseAxes();

  absl::StatusOr<storage::Outcomes> Read(const storage::OutcomeFilter& filter, int most_blades,
                                         storage::Deadline) const override;

 private:
  // What a correction and an inspection have in common.
  struct Made {
    std::int64_t sequence = 0;  // of an inspection: of its scan
    storage::Instant at;
    std::string id, sensor_calibration_id, rotation_calibration_id;
    CutBlade blade;
  };
  Made MakeNow(const CutBlade& blade);
  std::string Inspect(const CutBlade& blade);
  bool IsWithdrawn(const Made& made) const;
  std::string StateOf(const std::string& calibration_id) const;
  void ReadBlades(const storage::OutcomeFilter& filter, int most_blades, storage::Outcomes* outcomes) const;
  void ReadHoles(const storage::OutcomeFilter& filter, storage::Outcomes* outcomes) const;
  void ReadCalibrations(storage::Outcomes* outcomes) const;
  // That cut the blade before it was scanned for the inspection; null: none can have.
  const Made* CutBefore(const Made& inspection) const;

  FakeRecord record_;
  MachinesCalibrations calibrations_;
  std::vector<std::string> rotation_ids_;  // as they came into force
  std::set<std::string> withdrawn_ids_;
  bool axes_are_lost_ = false;
  std::vector<Made> corrections_, inspections_;  // as they were recorded
};

}  // namespace sixpoint::testing
