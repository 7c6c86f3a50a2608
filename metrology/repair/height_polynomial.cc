#include "metrology/repair/height_polynomial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "metrology/linear_algebra/least_squares.h"

namespace sixpoint::metrology {

HeightPolynomial::HeightPolynomial(const std::vector<PolynomialPlace>& places, const std::vector<double>& values,
                                   int degree_along, int degree_z)
    : degree_along_(degree_along), degree_z_(degree_z) {
  // Centred and scaled: powers of heights in mm would lose their digits.
  const auto by_along = [](const auto& a, const auto& b) { return a.along < b.along; };
  const auto by_z = [](const auto& a, const auto& b) { return a.z < b.z; };
  const auto along = std::minmax_element(places.begin(), places.end(), by_along);
  const auto z = std::minmax_element(places.begin(), places.end(), by_z);
  middle_along_ = (along.first->along + along.second->along) / 2;
  middle_z_ = (z.first->z + z.second->z) / 2;
  half_along_ = std::max(1e-12, (along.second->along - along.first->along) / 2);
  half_z_ = std::max(1e-12, (z.second->z - z.first->z) / 2);
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd rows(count, RowOf(places[0]).size());
  Eigen::VectorXd right(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    rows.row(i) = RowOf(places[static_cast<std::size_t>(i)]);
    right[i] = values[static_cast<std::size_t>(i)];
  }
  coefficients_ = LeastSquares(rows, right);
  inverse_ = InverseTriangle(rows);
  const double squares = (rows * coefficients_ - right).squaredNorm();
  sigma_ = std::sqrt(squares / static_cast<double>(std::max<Eigen::Index>(1, count - rows.cols())));
  const double about_mean = (right.array() - right.mean()).matrix().squaredNorm();
  r_squared_ = about_mean > 0 ? 1 - squares / about_mean : 0;
}

Eigen::RowVectorXd HeightPolynomial::RowOf(const PolynomialPlace& place) const {
  const double x = (place.along - middle_along_) / half_along_, z = (place.z - middle_z_) / half_z_;
  std::vector<double> row;
  for (int i = 0; i <= degree_along_; ++i)
    for (int k = 0; k <= degree_z_; ++k)
      if (i + k <= std::max(degree_along_, degree_z_)) row.push_back(std::pow(x, i) * std::pow(z, k));
  return Eigen::Map<const Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(row.size()));
}

PolynomialValue HeightPolynomial::At(const PolynomialPlace& place) const {
  const Eigen::RowVectorXd row = RowOf(place);
  return {row.dot(coefficients_), sigma_ * (row * inverse_).norm()};
}

}  // namespace sixpoint::metrology
