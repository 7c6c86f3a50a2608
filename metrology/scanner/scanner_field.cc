#include "metrology/scanner/scanner_field.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sixpoint::metrology {
namespace {

// Legendre's polynomials up to the third, each with a mean square of 1 over -1 to 1.
std::array<double, 4> Legendre(double t) {
  t = std::clamp(t, -1.0, 1.0);
  return {1, std::sqrt(3.0) * t, std::sqrt(5.0) * (3 * t * t - 1) / 2, std::sqrt(7.0) * (5 * t * t - 3) * t / 2};
}

}  // namespace

ScannerField ScannerField::Of(double mid_range_mm, double range_mm, double line_angle_rad) {
  return {(mid_range_mm + range_mm / 2) * std::tan(line_angle_rad / 2), range_mm / 2};
}

Eigen::Matrix<double, 1, kFieldParameterCount> ScannerField::TermsAt(double y_mm, double z_mm) const {
  Eigen::Matrix<double, 1, kFieldParameterCount> terms;
  terms.setZero();
  if (!(half_width_mm > 0 && half_range_mm > 0)) return terms;
  const auto y = Legendre(y_mm / half_width_mm), z = Legendre(z_mm / half_range_mm);
  terms << y[1], z[1], y[2], y[1] * z[1], z[2], y[3], y[2] * z[1], y[1] * z[2], z[3];
  return terms;
}

}  // namespace sixpoint::metrology
