// How often what is stated as 95 % holds, row by row.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::bench {

struct Row {
  std::string name;
  int count = 0;
  double coverage_percent = 0;
  // What every stated uncertainty may be multiplied by to hold in 95 % of the draws, inverted: 1.1 is a tenth too much.
  double u_over_quantile = 0;
  double median_error_um = 0, median_u_um = 0;
  double error_95_um = 0;   // 95 % of the errors lie below
  bool is_bounded = false;  // by what is only known to lie within limits
};

// Each source alone, all together, few degrees of freedom; of hole starts through the whole chain.
std::vector<Row> HoleRows(int draws);
// A pin's position and inclination, true error 0 to 6 standard uncertainties, alike and unlike across the hole.
std::vector<Row> PinRows(int draws);
// Probed spheres whose noise is seen in few residuals.
std::vector<Row> AxisRows(int draws);
// Interim checks of a scanner that was knocked by 20 um, and of one that was not.
struct KnockRow {
  std::string name;
  int count = 0;
  double found_percent = 0;          // of 20 um along any direction
  double found_by_turn_percent = 0;  // of a turn that moves the field's border by 20 um
  double false_percent = 0;          // of no knock, not accepted
};
std::vector<KnockRow> KnockRows(int draws);
// Point C's stated variance over that of its error.
double PointCVarianceRatio(int draws);

}  // namespace sixpoint::bench
