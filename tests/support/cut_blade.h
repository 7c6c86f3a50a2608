// A blade whose holes machine m1 cut, all off by the same that a test knows: what the record has of it, in PostgreSQL (cut_blades.h) and in
// memory (fake_outcomes.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace sixpoint::testing {

struct CutBlade {
  std::string serial;
  Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();  // found less predicted, machine frame, all holes
  bool inspected = true, let_go = true, reported = false, positioning_open = false, measured = true;
};

// What became of it.
struct CutNames {
  std::string correction, inspection;  // an id; empty: none
};

// One hole of part p1, which has two groups of two. Part frame; the part stands as its CAD does.
struct CutHole {
  std::string group, hole;
  double a_deg = 0, b_deg = 0;
  std::array<double, 3> predicted_start_mm{}, found_start_mm{}, axis{};  // the axis is found as predicted
};
// In the part's order.
std::vector<CutHole> HolesOf(const CutBlade& blade);

// What an inspection says of each measured hole beside.
inline constexpr double kCutExpandedUncertainty_um = 10, kCutExpandedUncertainty_deg = 0.1;
std::vector<std::string> CutBudgetSources();
std::vector<double> CutBudget_um();  // of each source

}  // namespace sixpoint::testing
