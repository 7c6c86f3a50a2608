// Components of variance of nested data: value = mean + outer + inner within outer + repeat
// (docs/methods/studies.md, nested variance).
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace sixpoint::metrology {

struct NestedObservation {
  std::string outer, inner;  // levels; an inner level belongs to its outer one only
  double value = 0;
};

struct NestedOptions {
  double confidence = 0.95;
  bool balanced_only = false;
  bool part_is_outer = false;  // else the inner factor is the part
};

// Between two bounds, a component of variance or a standard deviation.
struct Interval {
  double lower = 0, upper = 0;
};

struct VarianceLine {
  int degrees_of_freedom = 0;
  double sum_of_squares = 0;
  double mean_square = 0;
  std::optional<double> f, p;  // of outer and inner, where their denominator is not 0
  double variance = 0;         // component, not below 0
  Interval interval;
  bool negative = false;  // it came out below 0
  double percent = 0;     // of the sum of the components
};

struct NestedVariance {
  bool balanced = true;
  double mean = 0;
  double mean_standard_uncertainty = 0;
  VarianceLine outer, inner, repeat;
  int total_degrees_of_freedom = 0;
  double total_sum_of_squares = 0;
  // Repeatability and reproducibility: everything but the part.
  double gauge_rr_variance = 0;
  Interval gauge_rr_interval;   // of the variance
  double gauge_rr_percent = 0;  // of the total standard deviation
  std::optional<int> distinct_categories;
};

// Analysis of variance; for data that are not balanced with the exact coefficients of the expected mean squares
// (Satterthwaite's synthesis for the outer F). Intervals by the modified large-sample method (Ting et al. 1990; for one mean
// square the exact chi-squared interval); they are approximate where the data are not balanced. INVALID_ARGUMENT for values
// that are not finite, fewer than two outer levels, no outer level with two inner ones, no inner level with two values, or
// data that are not balanced where that was wanted.
absl::StatusOr<NestedVariance> AnalyseNested(const std::vector<NestedObservation>& observations,
                                             const NestedOptions& options);

}  // namespace sixpoint::metrology
