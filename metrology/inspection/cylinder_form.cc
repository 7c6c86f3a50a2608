#include "metrology/inspection/cylinder_form.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kSectors = 12,
                      kLayers = 10;  // cells, and blocks of two by two of them: a wave may be longer than a cell
constexpr int kLeastPoints = 5;      // of a cell, for its mean
constexpr double kChance = 0.99;     // what noise seldom exceeds
constexpr int kFittedParameters = 5;
using Vector5 = Eigen::Matrix<double, 5, 1>;

struct Sums {
  int count = 0;
  double sum = 0, squares = 0;
  Vector5 pull = Vector5::Zero();  // of all its points pushed outward alike
  void Add(const Sums& more) {
    count += more.count;
    sum += more.sum;
    squares += more.squares;
    pull += more.pull;
  }
  double mean() const { return sum / count; }
};

// By sector, then by layer.
using Cells = std::vector<std::vector<Sums>>;

struct Heights {
  double lowest_mm, highest_mm;
};
Heights HeightsOf(const PinFit& fit) {
  const auto [lowest, highest] =
      std::minmax_element(fit.residuals.begin(), fit.residuals.end(),
                          [](const PinResidual& a, const PinResidual& b) { return a.height_mm < b.height_mm; });
  return {lowest->height_mm, highest->height_mm};
}

Cells CellsOf(const PinFit& fit, const Eigen::VectorXd& residuals_mm) {
  const Heights heights = HeightsOf(fit);
  const double layer_mm = std::max(1e-9, (heights.highest_mm - heights.lowest_mm) / kLayers);
  Cells cells(kSectors, std::vector<Sums>(kLayers));
  for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
    const PinResidual& at = fit.residuals[i];
    const double sector = (at.around_rad + kPi) / (2 * kPi) * kSectors;
    const double layer = (at.height_mm - heights.lowest_mm) / layer_mm;
    Sums one;
    one.count = 1;
    one.sum = residuals_mm[static_cast<Eigen::Index>(i)];
    one.squares = one.sum * one.sum;
    one.pull = fit.gain[i] * at.outward_in_part;
    cells[std::min(kSectors - 1, static_cast<std::size_t>(std::max(0.0, sector)))]
         [std::min(kLayers - 1, static_cast<std::size_t>(std::max(0.0, layer)))]
             .Add(one);
  }
  return cells;
}

Cells BlocksOf(const Cells& cells) {
  Cells blocks(kSectors / 2, std::vector<Sums>(kLayers / 2));
  for (std::size_t sector = 0; sector < kSectors; ++sector)
    for (std::size_t layer = 0; layer < kLayers; ++layer) blocks[sector / 2][layer / 2].Add(cells[sector][layer]);
  return blocks;
}

// Range and rms of means, the rms without what noise puts in.
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
  double range() const { return greatest - least; }
  double rms() const { return count > 0 ? std::sqrt(std::max(0.0, squares - noise) / count) : 0; }
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

// What cells are off beyond noise, each for itself.
struct Waver {
  double ratio = 1;      // of their squares over what noise lets expect
  bool exceeds = false;  // by more than chance
  Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma;
};
Waver WaverOf(const Cells& cells, double noise) {
  Waver waver;
  waver.per_sigma.resize(5, 0);
  Spread all;
  double chi_squared = 0;
  std::vector<Vector5> pulls;
  for (const auto& sector : cells)
    for (const Sums& cell : sector) {
      if (cell.count > 0) pulls.push_back(cell.pull);
      if (cell.count < kLeastPoints) continue;
      all.Add(cell.mean(), noise / cell.count);
      chi_squared += cell.mean() * cell.mean() * cell.count / noise;
    }
  const int freedom = all.count - kFittedParameters;
  if (!(noise > 0) || freedom < 1) return waver;
  waver.ratio = std::max(1.0, chi_squared / freedom);
  waver.exceeds = chi_squared > ChiSquaredQuantile(kChance, freedom);
  if (!waver.exceeds) return waver;
  // The fit has taken up its share of what cells are off.
  const double rms = all.rms() * std::sqrt(static_cast<double>(all.count) / freedom);
  waver.per_sigma.resize(5, static_cast<Eigen::Index>(pulls.size()));
  for (std::size_t k = 0; k < pulls.size(); ++k) waver.per_sigma.col(static_cast<Eigen::Index>(k)) = rms * pulls[k];
  return waver;
}

// In cells or in blocks of them, whichever moves the axis and the radius more.
Waver GreaterWaver(const Cells& cells, double noise) {
  Waver fine = WaverOf(cells, noise), coarse = WaverOf(BlocksOf(cells), noise);
  const auto moves = [](const Waver& waver) {
    return waver.per_sigma.topRows<2>().squaredNorm() + waver.per_sigma.row(4).squaredNorm();
  };
  return moves(coarse) > moves(fine) ? coarse : fine;
}

// A bent axis: c + s z + k z^2.
struct Bend {
  Vector5 change = Vector5::Zero();                // of the straight cylinder's parameters, where the axis is let bend
  Eigen::Vector2d bend = Eigen::Vector2d::Zero();  // 1/mm
  double squared = 0;                              // its square over its variance from noise of variance 1 mm^2
  Eigen::VectorXd left_mm;                         // residuals about the bent one
};
std::optional<Bend> BendOf(const PinFit& fit, const Eigen::VectorXd& residuals_mm) {
  const Eigen::Index count = residuals_mm.size();
  if (count < 20) return std::nullopt;
  Eigen::MatrixXd rows(count, 7);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PinResidual& at = fit.residuals[static_cast<std::size_t>(i)];
    const double x = std::cos(at.around_rad), y = std::sin(at.around_rad), z = at.height_mm;
    rows.row(i) << -x, -y, -z * x, -z * y, -1, -z * z * x, -z * z * y;
  }
  const Eigen::VectorXd change = LeastSquares(rows, -residuals_mm);
  const Eigen::MatrixXd triangle = InverseTriangle(rows);
  const Eigen::Matrix2d covariance = (triangle * triangle.transpose()).bottomRightCorner<2, 2>();
  const double determinant = covariance(0, 0) * covariance(1, 1) - covariance(0, 1) * covariance(1, 0);
  if (!(determinant > 0)) return std::nullopt;
  Bend bend;
  bend.change = change.head<5>();
  bend.bend = change.tail<2>();
  bend.squared =
      (bend.bend.x() * bend.bend.x() * covariance(1, 1) - 2 * bend.bend.x() * bend.bend.y() * covariance(0, 1) +
       bend.bend.y() * bend.bend.y() * covariance(0, 0)) /
      determinant;
  bend.left_mm = residuals_mm + rows * change;
  return bend;
}

void Describe(const Cells& cells, double noise, CylinderForm* form) {
  Spread around, along;
  for (const auto& sector : cells) {
    Sums whole;
    for (const Sums& cell : sector) whole.Add(cell);
    if (whole.count < kLeastPoints) continue;
    around.Add(whole.mean(), noise / whole.count);
    for (const Sums& cell : sector)
      if (cell.count >= kLeastPoints)
        along.Add(cell.mean() - whole.mean(), noise * std::max(0.0, 1.0 / cell.count - 1.0 / whole.count));
  }
  form->around_range_um = 1e3 * around.range();
  form->around_rms_um = 1e3 * around.rms();
  form->along_range_um = 1e3 * along.range();
  form->along_rms_um = 1e3 * along.rms();
}

}  // namespace

CylinderForm FormOf(const PinFit& fit) {
  CylinderForm form;
  form.per_sigma.resize(5, 0);
  if (fit.residuals.empty()) return form;
  Eigen::VectorXd residuals_mm(static_cast<Eigen::Index>(fit.residuals.size()));
  for (std::size_t i = 0; i < fit.residuals.size(); ++i)
    residuals_mm[static_cast<Eigen::Index>(i)] = fit.residuals[i].residual_mm;
  const Cells cells = CellsOf(fit, residuals_mm);
  const double noise = NoiseOf(cells);
  Describe(cells, noise, &form);
  Waver waver = GreaterWaver(cells, noise);
  if (const std::optional<Bend> bend = BendOf(fit, residuals_mm); bend && noise > 0) {
    // A wall that wavers seems bent: what it wavers about the bent axis counts as noise.
    const Waver about_bent = GreaterWaver(CellsOf(fit, bend->left_mm), noise);
    if (bend->squared > noise * about_bent.ratio * ChiSquaredQuantile(kChance, 2)) {
      const Heights heights = HeightsOf(fit);
      form.bend_um = 1e3 * bend->bend.norm() * std::pow((heights.highest_mm - heights.lowest_mm) / 2, 2);
      waver = about_bent;
      // Which of both axes the hole follows nobody knows: what they differ by, whole.
      form.per_sigma = bend->change;
    }
  }
  form.exceeds_noise = form.bend_um > 0 || waver.exceeds;
  const Eigen::Index before = form.per_sigma.cols();
  form.per_sigma.conservativeResize(5, before + waver.per_sigma.cols());
  form.per_sigma.rightCols(waver.per_sigma.cols()) = waver.per_sigma;
  return form;
}

}  // namespace sixpoint::metrology
