// A plant of whose machine it is known what it is off by: blades corrected, cut and inspected, as rows.
#pragma once

#include <string>

#include "tests/support/customers_parts.h"
#include "tests/support/cut_blade.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {

// Machine m1, whose rotary axes do not meet its origin; part p1 of two groups of two holes; nobody's customer's.
class CutBlades {
 public:
  CutBlades();
  CutNames Cut(const CutBlade& blade);
  // Inspected once more, so much farther off.
  std::string InspectAnew(const CutBlade& blade);
  // Another calibration of the axes is in force from now on.
  void CalibrateAxesAnew();
  void Withdraw(const std::string& calibration);
  const MachinesCalibrations& calibrations() const { return calibrations_; }

  ThrowawayDatabase database;

 private:
  MachinesCalibrations calibrations_;
  int scan_count_ = 0;
};

}  // namespace sixpoint::testing
