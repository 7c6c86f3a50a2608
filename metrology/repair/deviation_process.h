// A value known at some heights, told at others: a Gaussian process whose hyperparameters are averaged, not chosen (docs/methods/repair.md).
//
// Heights in mm; values in any unit. Thread-safe; the same inputs give the same bits.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

struct ProcessValue {
  double mean = 0;
  double variance = 0;        // of the value itself, measurement noise left out
  double noise_variance = 0;  // which a measured value there would have beside it
};

// Values in the order of heights, a few of them wild: one that is farther from the parabola through its neighbours than five times what most are
// is replaced by it.
Eigen::VectorXd WithoutWild(const std::vector<double>& z_mm, const Eigen::VectorXd& values);

// Covariances that a series may have over given heights, prepared once for all series. A line in z is free. On it stand a slow part, as long as
// the span or longer (bend, twist), and a wave; both lengths, their ratio and the noise are those of a grid, each weighted by its likelihood.
class HeightProcess {
 public:
  // At least 8 known heights that differ.
  HeightProcess(const std::vector<double>& known_mm, const std::vector<double>& asked_mm);

  // values: at the known heights. One for each height asked.
  std::vector<ProcessValue> Predict(const Eigen::VectorXd& values) const;

 private:
  // One kernel of the grid: its contrasts' eigenvalues, and what the asked values owe to each contrast.
  struct Kernel {
    Eigen::VectorXd eigenvalues;
    Eigen::MatrixXd contrasts;  // rows: of the values, each free of a line in z
    Eigen::MatrixXd weights;    // asked x contrasts: covariance with them
    Eigen::VectorXd variance;   // of each asked value less the line through the known ones
  };
  Eigen::MatrixXd by_line_;      // asked x known: the line's own prediction
  Eigen::VectorXd line_growth_;  // of each row, its sum of squares
  std::vector<Kernel> kernels_;
};

// Whether the process foresees what is known: the upper known heights, told from those below them, as far ahead for what is known as those asked are.
class Foresight {
 public:
  // At least 11 known heights, by z; asked_mm: the highest one asked, above all of them.
  Foresight(const std::vector<double>& known_mm, double asked_mm);

  // By how much variances of series of one kind have to grow (1 at least) so that they hold what came. series: a column each, by known heights.
  // Each counts by what it was off, squared, over what was told of it; some more are taken to have come as told.
  double Growth(const Eigen::MatrixXd& series) const;

 private:
  Eigen::Index below_;
  HeightProcess process_;
};

}  // namespace sixpoint::metrology
