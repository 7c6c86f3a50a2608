#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/goals.h"
#include "bench/uncertainty/rows.h"

namespace sixpoint::bench {
namespace {

constexpr int kDraws = 2000;
constexpr int kPinDraws = 10;  // as many: they cost nothing, and of 57 rows the greatest is a matter of luck

std::vector<Goal> Goals() {
  return {{"rows", "coverage_low_percent", "95 % covers in the least of the rows, %", 93.0, {}, Goal::Counts::kInFull},
          {"rows", "coverage_high_percent", "and in the greatest, %", {}, 97.5, Goal::Counts::kInFull},
          {"rows", "u_over_quantile_low", "U over what it need be, least of the rows", 0.9, {}, Goal::Counts::kInFull},
          {"rows", "u_over_quantile_high", "and greatest", {}, 1.25, Goal::Counts::kInFull},
          {"point_c",
           "point_c_variance_ratio_low",
           "Point C's stated variance over its error's",
           0.97,
           {},
           Goal::Counts::kInFull},
          {"point_c", "point_c_variance_ratio", "the same", {}, 1.03, Goal::Counts::kInFull},
          {"knock", "knock_found_percent", "20 um knocks found, least of the rows, %", 95.0, {}, Goal::Counts::kInFull},
          {"knock", "knock_false_percent", "no knock, and not accepted: greatest, %", {}, 1.0, Goal::Counts::kInFull},
          {"remapped", "silently_remapped", "tests of scans mapped by a later mounting: wrong", {}, 0.0},
          // A rectangle has no tails: it is covered, and by more.
          {"rows",
           "bounded_covered_percent",
           "covered where a temperature is only bounded, %",
           95.0,
           {},
           Goal::Counts::kInFull},
          {"rows", "warm_hole_um", "95 % of holes at +-5 K, temperature measured, um", {}, 1.5, Goal::Counts::kInFull}};
}

// silently_remapped: tests in which a scan was mapped by a later mounting that nobody asked for; none: not looked at.
int Run(int draws, std::optional<int> silently_remapped) {
  std::vector<Row> rows;
  for (const std::vector<Row>& more : {HoleRows(draws), PinRows(kPinDraws * draws), AxisRows(draws)})
    rows.insert(rows.end(), more.begin(), more.end());
  std::printf("%-44s %7s %9s %11s %13s %9s %9s\n", "row", "draws", "covers %", "U/quantile", "median error", "95 %",
              "median U");
  double low = 100, high = 0, u_low = std::numeric_limits<double>::infinity(), u_high = 0, warm = 0, bounded = 100;
  for (const Row& row : rows) {
    std::printf("%-44s %7d %9.1f %11.2f %13.3f %9.3f %9.3f\n", row.name.c_str(), row.count, row.coverage_percent,
                row.u_over_quantile, row.median_error_um, row.error_95_um, row.median_u_um);
    low = std::min(low, row.coverage_percent);
    if (row.is_bounded)
      bounded = std::min(bounded, row.coverage_percent);
    else
      high = std::max(high, row.coverage_percent);
    u_low = std::min(u_low, row.u_over_quantile);
    u_high = std::max(u_high, row.u_over_quantile);
    if (row.name.find("5 K") == 0 && row.name.find("measured") != std::string::npos)
      warm = std::max(warm, row.error_95_um);
  }
  std::printf("%-44s %7s %9s %11s %13s\n", "interim check, 20 um", "draws", "found %", "by turn %", "false %");
  double found = 100, falsely = 0;
  for (const KnockRow& row : KnockRows(draws)) {
    std::printf("%-44s %7d %9.2f %11.2f %13.2f\n", row.name.c_str(), row.count, row.found_percent,
                row.found_by_turn_percent, row.false_percent);
    found = std::min({found, row.found_percent, row.found_by_turn_percent});
    falsely = std::max(falsely, row.false_percent);
  }
  const double ratio = PointCVarianceRatio(25 * draws);
  nlohmann::json figures = {{"coverage_low_percent", low},
                            {"coverage_high_percent", high},
                            {"u_over_quantile_low", u_low},
                            {"u_over_quantile_high", u_high},
                            {"point_c_variance_ratio", ratio},
                            {"point_c_variance_ratio_low", ratio},
                            {"warm_hole_um", warm},
                            {"bounded_covered_percent", bounded},
                            {"knock_found_percent", found},
                            {"knock_false_percent", falsely},
                            {"rows", rows.size()},
                            {"draws", draws}};
  std::vector<std::string> parts = {"rows", "point_c", "knock"};
  if (silently_remapped.has_value()) {
    figures["silently_remapped"] = *silently_remapped;
    parts.emplace_back("remapped");
  }
  const int missed = PrintGoals(Goals(), {parts, draws >= kDraws, true}, figures);
  std::printf("%s\n", nlohmann::json({{"bench", "uncertainty"}, {"figures", figures}}).dump().c_str());
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  int draws = sixpoint::bench::kDraws;
  std::optional<int> silently_remapped;
  bool sound = argc % 2 == 1;
  for (int i = 1; sound && i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--draws") == 0)
      draws = std::atoi(argv[i + 1]);
    else if (std::strcmp(argv[i], "--silently-remapped") == 0)
      silently_remapped = std::atoi(argv[i + 1]);
    else
      sound = false;
  }
  if (!sound || draws < 100) {
    std::fprintf(stderr, "usage: bench/run uncertainty [--draws N]      N at least 100; %d without it\n",
                 sixpoint::bench::kDraws);
    return 2;
  }
  return sixpoint::bench::Run(draws, silently_remapped);
}
