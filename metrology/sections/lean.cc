#include "metrology/sections/lean.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "metrology/sections/outline.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Row = Eigen::Matrix<double, 6, 1>;

constexpr std::size_t kLeanPieces = 200;
constexpr double kHalfPiece = 0.008;  // of the outline's length

struct LeanPiece {
  Vector2d point_mm, normal;
  double lean, variance_mm2;
};

std::vector<LeanPiece> PiecesOf(const PointChain& chain, const LocalFit& fit) {
  std::vector<LeanPiece> pieces;
  const std::size_t n = chain.points_mm.size();
  for (std::size_t k = 0; k < kLeanPieces; ++k) {
    const std::size_t i = k * n / kLeanPieces;
    const double half_mm = kHalfPiece * chain.length_mm;
    const Vector2d along = chain.points_mm[(i + 1) % n] - chain.points_mm[(i + n - 1) % n];
    const auto curve = fit.At({chain.at_mm[i], half_mm, half_mm, 4}, chain.points_mm[i], along);
    if (curve && curve->freedom > 10)
      pieces.push_back({curve->point_mm, curve->normal, curve->lean, curve->sample_variance_mm2});
  }
  return pieces;
}

Row RowOf(const LeanPiece& piece, const Vector2d& about_mm) {
  const Vector2d off = piece.point_mm - about_mm;
  Row row;
  row << piece.normal, piece.normal.x() * off, piece.normal.y() * off;
  return row;
}

}  // namespace

LeanField LeanOf(const PointChain& chain, const LocalFit& fit) {
  LeanField field;
  const std::vector<LeanPiece> pieces = PiecesOf(chain, fit);
  if (pieces.size() < 20) return field;
  std::vector<double> variances;
  for (const LeanPiece& piece : pieces) {
    field.about_mm += piece.point_mm / static_cast<double>(pieces.size());
    variances.push_back(piece.variance_mm2);
  }
  field.noise_mm = std::sqrt(Median(variances));
  // About a tip a piece's curve does not follow its points; its lean counts the less.
  std::vector<double> weights;
  for (const LeanPiece& piece : pieces)
    weights.push_back(1 / std::max(1.0, std::pow(piece.variance_mm2 / std::pow(field.noise_mm, 2), 2)));
  std::vector<double> robust(pieces.size(), 1);
  Row solved = Row::Zero();
  for (int turn = 0; turn < 5; ++turn) {
    // Where one side alone was seen, the map stays what it must be at the least.
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
    Row right = Row::Zero();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const Row row = RowOf(pieces[i], field.about_mm);
      normal += weights[i] * robust[i] * row * row.transpose();
      right += weights[i] * robust[i] * pieces[i].lean * row;
    }
    solved = normal.ldlt().solve(right);
    std::vector<double> off;
    for (const LeanPiece& piece : pieces)
      off.push_back(std::abs(piece.lean - RowOf(piece, field.about_mm).dot(solved)));
    field.scatter = RobustSigmaOfMagnitudes(off);
    for (std::size_t i = 0; i < pieces.size(); ++i)
      robust[i] = 1 / (1 + std::pow(off[i] / std::max(1e-9, 2.385 * field.scatter), 2));
  }
  field.shift = solved.head<2>();
  field.by_place.row(0) = solved.segment<2>(2).transpose();
  field.by_place.row(1) = solved.segment<2>(4).transpose();
  constexpr double kSteepestLean = 1.7;  // 60 deg, as with a surface (samples.h)
  if (!solved.allFinite() || field.shift.norm() > kSteepestLean) {
    field.shift.setZero();
    field.by_place.setZero();
  }
  return field;
}

}  // namespace sixpoint::metrology
