// A plant of whose machine it is known what it is off by: blades corrected, cut and inspected, as rows.
#pragma once

#include <Eigen/Core>
#include <string>

#include "tests/support/customers_parts.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {

struct CutBlade {
  std::string serial;
  Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();  // found less predicted, machine frame, all holes
  bool inspected = true, let_go = true, reported = false, positioning_open = false, measured = true;
};

// Machine m1, whose rotary axes do not meet its origin; part p1 of two groups of two holes; nobody's customer's.
class CutBlades {
 public:
  CutBlades();
  // The names of what became of it.
  struct Names {
    std::string correction, inspection;  // an id; empty: none
  };
  Names Cut(const CutBlade& blade);
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
