// The published regression: a polynomial of degree 3 along the section and 5 over the height, or one over the height alone, with what it leaves
// uncertain (docs/methods/repair.md).
//
// Thread-safe; the same inputs give the same bits.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

struct PolynomialPlace {
  double along = 0, z = 0;  // any units
};

struct PolynomialValue {
  double value = 0, standard = 0;  // standard deviation of the fitted function there, of independent residuals
};

class HeightPolynomial {
 public:
  // Terms along^i z^k of i <= degree_along, k <= degree_z and i + k <= the greater of both. As many values as places, more than terms.
  HeightPolynomial(const std::vector<PolynomialPlace>& places, const std::vector<double>& values, int degree_along,
                   int degree_z);

  PolynomialValue At(const PolynomialPlace& place) const;
  double r_squared() const { return r_squared_; }  // coefficient of determination

 private:
  Eigen::RowVectorXd RowOf(const PolynomialPlace& place) const;

  int degree_along_, degree_z_;
  double middle_along_ = 0, middle_z_ = 0, half_along_ = 1, half_z_ = 1;
  Eigen::VectorXd coefficients_;
  Eigen::MatrixXd inverse_;  // R^-1
  double sigma_ = 0, r_squared_ = 0;
};

}  // namespace sixpoint::metrology
