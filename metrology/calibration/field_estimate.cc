#include "metrology/calibration/field_estimate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "metrology/statistics/legendre.h"

namespace sixpoint::metrology {
namespace {

constexpr int kTermCount = kFieldSeriesCount + kFlatnessTermCount;
using FieldTerms = Eigen::Matrix<double, kTermCount, 1>;
using FieldTermsSquared = Eigen::Matrix<double, kTermCount, kTermCount>;

// Root mean square of what lies in the orders 4, 5 and 6, of 1 in the nine terms: waves of 20 to 60 mm have 0.10 to 0.27, 0.03 to 0.13 and
// 0.01 to 0.06 there.
constexpr std::array<double, 3> kBeyond = {0.2, 0.1, 0.05};
// Of a face's form in the orders 2 to 6: waves from half its side on.
constexpr std::array<double, 5> kOfFlatness = {0.7, 0.5, 0.4, 0.25, 0.15};
constexpr double kLeastOfPlaceMm = 2e-5, kMostOfPlaceMm = 0.1;

// Prior precision of each term; beyond_mm: the root mean square that the orders beyond go with. A flatness of 0 is none.
FieldTerms Precision(double stated_mm, double beyond_mm, double flatness_mm) {
  FieldTerms sigma;
  sigma.head<kFieldParameterCount>() = FieldCovarianceOf(stated_mm, std::nullopt).diagonal().cwiseSqrt();
  int at = kFieldParameterCount;
  for (int order = 4; order <= kFieldSeriesOrder; ++order)
    for (int i = 0; i <= order; ++i)
      sigma[at++] = beyond_mm * kBeyond[static_cast<std::size_t>(order - 4)] / std::sqrt(order + 1.0);
  for (int order = 2; order <= 6; ++order)
    for (int i = 0; i <= order; ++i)
      sigma[at++] = flatness_mm * kOfFlatness[static_cast<std::size_t>(order - 2)] / std::sqrt(order + 1.0);
  return sigma.cwiseMax(1e-9).cwiseAbs2().cwiseInverse();
}

struct Solved {
  FieldTerms terms;
  FieldTermsSquared covariance;
  double chi_squared = 0, freedom = 0;  // of laser readings
};

Solved Solve(const std::vector<FieldResidual>& residuals, const FieldTerms& precision, double of_place_mm) {
  const auto count = static_cast<Eigen::Index>(residuals.size());
  Eigen::MatrixXd design(count, kTermCount);
  Eigen::VectorXd off_mm(count), weights(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const FieldResidual& one = residuals[static_cast<std::size_t>(k)];
    design.row(k) << one.by_field, one.by_flatness;
    off_mm[k] = one.off_mm;
    weights[k] = 1 / (one.variance_mm2 + (one.is_laser ? of_place_mm * of_place_mm : 0));
  }
  const Eigen::MatrixXd weighted = weights.asDiagonal() * design;
  FieldTermsSquared information = design.transpose() * weighted;
  information.diagonal() += precision;
  // In units in which all are alike: one that the prior alone holds beside one that the readings hold to nanometres.
  const FieldTerms unit = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<FieldTermsSquared> solver(FieldTermsSquared(unit.asDiagonal() * information * unit.asDiagonal()));
  Solved solved;
  solved.terms = unit.cwiseProduct(solver.solve(FieldTerms(unit.cwiseProduct(weighted.transpose() * off_mm))));
  solved.covariance = unit.asDiagonal() * solver.solve(FieldTermsSquared::Identity()) * unit.asDiagonal();
  const Eigen::VectorXd left = off_mm - design * solved.terms;
  for (Eigen::Index k = 0; k < count; ++k) {
    if (!residuals[static_cast<std::size_t>(k)].is_laser) continue;
    solved.chi_squared += weights[k] * left[k] * left[k];
    solved.freedom += 1 - weights[k] * design.row(k).dot(solved.covariance * design.row(k).transpose());
  }
  return solved;
}

// With what none explains of laser readings as noise of their places.
Solved Settle(const std::vector<FieldResidual>& residuals, const FieldTerms& precision) {
  double of_place_mm = kLeastOfPlaceMm;
  Solved solved = Solve(residuals, precision, of_place_mm);
  while (solved.chi_squared > std::max(1.0, solved.freedom) && of_place_mm < kMostOfPlaceMm) {
    of_place_mm *= 1.2;
    solved = Solve(residuals, precision, of_place_mm);
  }
  return solved;
}

}  // namespace

FlatnessTerms FlatnessTermsAt(const Eigen::Vector2d& at) {
  const auto x = Legendre<6>(at.x()), y = Legendre<6>(at.y());
  FlatnessTerms terms;
  int k = 0;
  for (std::size_t order = 2; order <= 6; ++order)
    for (std::size_t of_y = 0; of_y <= order; ++of_y) terms[k++] = x[order - of_y] * y[of_y];
  return terms;
}

MeasuredField EstimateField(const std::vector<FieldResidual>& residuals, double stated_mm, double flatness_mm) {
  Solved solved = Settle(residuals, Precision(stated_mm, stated_mm, flatness_mm));
  // A field that is found to be a tenth of what was stated has a tenth beyond its nine terms.
  const double found_mm =
      std::sqrt(solved.terms.head<kFieldParameterCount>().squaredNorm() +
                solved.covariance.topLeftCorner<kFieldParameterCount, kFieldParameterCount>().trace());
  solved = Settle(residuals, Precision(stated_mm, found_mm, flatness_mm));
  constexpr int kBeyondCount = kFieldSeriesCount - kFieldParameterCount;
  const double beyond_mm2 =
      solved.terms.segment<kBeyondCount>(kFieldParameterCount).squaredNorm() +
      solved.covariance.block<kBeyondCount, kBeyondCount>(kFieldParameterCount, kFieldParameterCount).trace();
  MeasuredField field;
  field.terms_mm = solved.terms.head<kFieldParameterCount>();
  field.covariance_mm2 = solved.covariance.topLeftCorner<kFieldParameterCount, kFieldParameterCount>();
  field.covariance_mm2 = (field.covariance_mm2 + field.covariance_mm2.transpose().eval()) / 2;
  field.covariance_mm2 += beyond_mm2 / kFieldParameterCount * FieldCovariance::Identity();
  field.stated_mm = stated_mm;
  return field;
}

}  // namespace sixpoint::metrology
