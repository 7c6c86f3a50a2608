#include "metrology/inspection/cylinder_form.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kSectors = 12, kLayers = 10;
constexpr int kLeastPoints = 5;   // of a cell, for its mean
constexpr double kChance = 0.99;  // what noise seldom exceeds
constexpr int kFittedParameters = 5;

struct Sums {
  int count = 0;
  double sum = 0, squares = 0;
  Eigen::Matrix<double, 5, 1> pull = Eigen::Matrix<double, 5, 1>::Zero();  // of all its points pushed outward alike
  void Add(const Sums& more) {
    count += more.count;
    sum += more.sum;
    squares += more.squares;
    pull += more.pull;
  }
  double mean() const { return sum / count; }
};
using Cells = std::array<std::array<Sums, kLayers>, kSectors>;

Cells CellsOf(const PinFit& fit) {
  double lowest = fit.residuals.front().height_mm, highest = lowest;
  for (const PinResidual& at : fit.residuals) {
    lowest = std::min(lowest, at.height_mm);
    highest = std::max(highest, at.height_mm);
  }
  const double layer_mm = std::max(1e-9, (highest - lowest) / kLayers);
  Cells cells;
  for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
    const PinResidual& at = fit.residuals[i];
    const double sector = (at.around_rad + kPi) / (2 * kPi) * kSectors, layer = (at.height_mm - lowest) / layer_mm;
    Sums one;
    one.count = 1;
    one.sum = at.residual_mm;
    one.squares = at.residual_mm * at.residual_mm;
    one.pull = fit.gain[i] * at.outward_in_part;
    cells[std::min(kSectors - 1, static_cast<std::size_t>(std::max(0.0, sector)))]
         [std::min(kLayers - 1, static_cast<std::size_t>(std::max(0.0, layer)))]
             .Add(one);
  }
  return cells;
}

// Range and rms of means, the rms without what noise of this variance of a point puts in.
struct Spread {
  double least = 0, greatest = 0, squares = 0, noise = 0;
  int count = 0;
  void Add(double mean, double variance) {
    least = count == 0 ? mean : std::min(least, mean);
    greatest = count == 0 ? mean : std::max(greatest, mean);
    squares += mean * mean;
    noise += variance;
    ++count;
  }
  double range_um() const { return 1e3 * (greatest - least); }
  double rms_um() const { return count > 0 ? 1e3 * std::sqrt(std::max(0.0, squares - noise) / count) : 0; }
};

// Variance of a point within its cell.
double NoiseOf(const Cells& cells) {
  double squares = 0;
  int freedom = 0;
  for (const auto& sector : cells)
    for (const Sums& cell : sector)
      if (cell.count >= kLeastPoints) {
        squares += cell.squares - cell.count * cell.mean() * cell.mean();
        freedom += cell.count - 1;
      }
  return freedom > 0 ? squares / freedom : 0;
}

// Cells that are off beyond noise, each for itself: a column each.
void AddCells(const Cells& cells, double noise, CylinderForm* form) {
  Spread around, along, all;
  double chi_squared = 0;
  std::vector<Eigen::Matrix<double, 5, 1>> pulls;
  for (const auto& sector : cells) {
    Sums whole;
    for (const Sums& cell : sector) whole.Add(cell);
    if (whole.count < kLeastPoints) continue;
    around.Add(whole.mean(), noise / whole.count);
    for (const Sums& cell : sector) {
      if (cell.count > 0) pulls.push_back(cell.pull);
      if (cell.count < kLeastPoints) continue;
      along.Add(cell.mean() - whole.mean(), noise * std::max(0.0, 1.0 / cell.count - 1.0 / whole.count));
      all.Add(cell.mean(), noise / cell.count);
      chi_squared += cell.mean() * cell.mean() * cell.count / noise;
    }
  }
  form->around_range_um = around.range_um();
  form->around_rms_um = around.rms_um();
  form->along_range_um = along.range_um();
  form->along_rms_um = along.rms_um();
  const int freedom = all.count - kFittedParameters;
  if (!(noise > 0) || freedom < 1 || chi_squared <= ChiSquaredQuantile(kChance, freedom)) return;
  form->exceeds_noise = true;
  const Eigen::Index before = form->per_sigma.cols();
  form->per_sigma.conservativeResize(5, before + static_cast<Eigen::Index>(pulls.size()));
  for (std::size_t k = 0; k < pulls.size(); ++k)
    form->per_sigma.col(before + static_cast<Eigen::Index>(k)) = all.rms_um() / 1e3 * pulls[k];
}

// A bent axis: c + s z + k z^2. What the straight one is off at the start is what the bent one says otherwise, whole: which of both the
// hole follows nobody knows.
void AddBend(const PinFit& fit, double noise, CylinderForm* form) {
  const auto count = static_cast<Eigen::Index>(fit.residuals.size());
  if (count < 20 || !(noise > 0)) return;
  Eigen::MatrixXd rows(count, 7);
  Eigen::VectorXd residuals(count);
  double lowest = fit.residuals.front().height_mm, highest = lowest;
  for (Eigen::Index i = 0; i < count; ++i) {
    const PinResidual& at = fit.residuals[static_cast<std::size_t>(i)];
    const double x = std::cos(at.around_rad), y = std::sin(at.around_rad), z = at.height_mm;
    rows.row(i) << -x, -y, -z * x, -z * y, -1, -z * z * x, -z * z * y;
    residuals[i] = -at.residual_mm;
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  const Eigen::VectorXd change = LeastSquares(rows, residuals);
  const Eigen::MatrixXd triangle = InverseTriangle(rows);
  const Eigen::Matrix2d covariance = noise * (triangle * triangle.transpose()).bottomRightCorner<2, 2>();
  const Eigen::Vector2d bend = change.tail<2>();
  const double determinant = covariance.determinant();
  if (!(determinant > 0)) return;
  const double squared = (bend.x() * bend.x() * covariance(1, 1) - 2 * bend.x() * bend.y() * covariance(0, 1) +
                          bend.y() * bend.y() * covariance(0, 0)) /
                         determinant;
  if (!(squared > ChiSquaredQuantile(kChance, 2))) return;
  form->exceeds_noise = true;
  form->bend_um = 1e3 * bend.norm() * std::pow((highest - lowest) / 2, 2);
  const Eigen::Index before = form->per_sigma.cols();
  form->per_sigma.conservativeResize(5, before + 1);
  form->per_sigma.col(before) = change.head<5>();
}

}  // namespace

CylinderForm FormOf(const PinFit& fit) {
  CylinderForm form;
  form.per_sigma.resize(5, 0);
  if (fit.residuals.empty()) return form;
  const Cells cells = CellsOf(fit);
  const double noise = NoiseOf(cells);
  AddCells(cells, noise, &form);
  AddBend(fit, noise, &form);
  return form;
}

}  // namespace sixpoint::metrology
