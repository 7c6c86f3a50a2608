#include "metrology/scanner/scanner_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "metrology/statistics/legendre.h"

namespace sixpoint::metrology {
namespace {

// Each term's share of the mean square, by order: waves of 20 to 100 mm, all together, have 0.55, 0.33 and 0.12 in the three orders.
constexpr std::array<double, 3> kOfOrder = {0.55 / 2, 0.33 / 3, 0.12 / 4};

// Order by order, within one from y on to z.
template <int kOrder>
Eigen::Matrix<double, 1, (kOrder + 1) * (kOrder + 2) / 2 - 1> ProductsAt(const ScannerField& field, double y_mm,
                                                                         double z_mm) {
  Eigen::Matrix<double, 1, (kOrder + 1) * (kOrder + 2) / 2 - 1> products;
  products.setZero();
  if (!(field.half_width_mm > 0 && field.half_range_mm > 0)) return products;
  const auto y = Legendre<kOrder>(y_mm / field.half_width_mm), z = Legendre<kOrder>(z_mm / field.half_range_mm);
  int at = 0;
  for (int order = 1; order <= kOrder; ++order)
    for (int of_z = 0; of_z <= order; ++of_z) products[at++] = y[order - of_z] * z[of_z];
  return products;
}

}  // namespace

ScannerField ScannerField::Of(double mid_range_mm, double range_mm, double line_angle_rad) {
  return {(mid_range_mm + range_mm / 2) * std::tan(line_angle_rad / 2), range_mm / 2};
}

ScannerField ScannerField::OfSnapshot(double mid_range_mm, double range_mm, double view_angle_rad) {
  const double half_width_mm = Of(mid_range_mm, range_mm, view_angle_rad).half_width_mm;
  return {half_width_mm, half_width_mm};
}

Eigen::Matrix<double, 1, kFieldParameterCount> ScannerField::TermsAt(double y_mm, double z_mm) const {
  return ProductsAt<3>(*this, y_mm, z_mm);
}

FieldSeries ScannerField::SeriesAt(double y_mm, double z_mm) const {
  return ProductsAt<kFieldSeriesOrder>(*this, y_mm, z_mm);
}

FieldCovariance FieldCovarianceOf(double stated_mm, const std::optional<MeasuredField>& measured) {
  if (!measured) {
    FieldTerms shares;
    shares << kOfOrder[0], kOfOrder[0], kOfOrder[1], kOfOrder[1], kOfOrder[1], kOfOrder[2], kOfOrder[2], kOfOrder[2],
        kOfOrder[2];
    return stated_mm * stated_mm * FieldCovariance(shares.asDiagonal());
  }
  const double wider = measured->stated_mm > 0 ? std::max(1.0, stated_mm / measured->stated_mm) : 1;
  return wider * wider * measured->covariance_mm2;
}

}  // namespace sixpoint::metrology
