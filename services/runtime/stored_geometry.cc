#include "services/runtime/stored_geometry.h"

namespace sixpoint::runtime {

std::vector<double> RowMajor(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  std::vector<double> values;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) values.push_back(matrix(row, column));
  return values;
}

void SetPoint(absl::Span<const double> xyz_mm, geometry::v1::Point* out) {
  out->set_x_mm(xyz_mm.at(0));
  out->set_y_mm(xyz_mm.at(1));
  out->set_z_mm(xyz_mm.at(2));
}

void SetDirection(absl::Span<const double> xyz, geometry::v1::Direction* out) {
  out->set_x(xyz.at(0));
  out->set_y(xyz.at(1));
  out->set_z(xyz.at(2));
}

void SetLine(absl::Span<const double> direction, absl::Span<const double> point_mm, geometry::v1::Line* out) {
  SetDirection(direction, out->mutable_direction());
  SetPoint(point_mm, out->mutable_point_mm());
}

void SetTransform(absl::Span<const double> upper_rows, geometry::v1::RigidTransform* out) {
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) out->add_rotation(upper_rows.at(4 * row + column));
  SetPoint({upper_rows.at(3), upper_rows.at(7), upper_rows.at(11)}, out->mutable_translation_mm());
}

void SetMatrix(absl::Span<const double> values, int row_count, int column_count, geometry::v1::Matrix* out) {
  out->set_row_count(row_count);
  out->set_column_count(column_count);
  out->mutable_values()->Assign(values.begin(), values.end());
}

void SetCovariance(absl::Span<const double> values, absl::Span<const double> reference_mm,
                   geometry::v1::PoseCovariance* out) {
  out->mutable_values()->Assign(values.begin(), values.end());
  SetPoint(reference_mm, out->mutable_reference_mm());
}

}  // namespace sixpoint::runtime
