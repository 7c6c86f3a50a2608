// A question asked of the product and in SQL as a person would write it by hand, by turns.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

namespace sixpoint::bench {

struct Took {
  double s = 0;
  std::int64_t rows = 0;
};
template <typename Work>
Took Time(const Work& work) {
  const auto began = std::chrono::steady_clock::now();
  const std::int64_t rows = work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(), rows};
}

inline double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Both by turns, the median of each; ends the program where they do not give as many rows.
template <typename Ours, typename Sql>
nlohmann::json Beside(const Ours& ours, const Sql& sql, int round_count = 7) {
  std::vector<double> ours_s, sql_s;
  std::int64_t rows = 0;
  for (int round = 0; round < round_count; ++round) {
    const Took first = Time(ours), second = Time(sql);
    if (first.rows != second.rows) {
      std::fprintf(stderr, "ours gives %ld rows, SQL %ld\n", static_cast<long>(first.rows),
                   static_cast<long>(second.rows));
      std::exit(2);
    }
    rows = first.rows;
    ours_s.push_back(first.s);
    sql_s.push_back(second.s);
  }
  return {
      {"rows", rows}, {"ours_s", Median(ours_s)}, {"sql_s", Median(sql_s)}, {"over", Median(ours_s) / Median(sql_s)}};
}

}  // namespace sixpoint::bench
