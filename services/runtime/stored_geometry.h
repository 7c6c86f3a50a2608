// Geometry as rows keep it, numbers in lists: points and directions x, y, z, matrices row by row, rigid transforms as the upper
// three rows of their matrix. The database holds them to their lengths; std::out_of_range where one is shorter.
#pragma once

#include <absl/types/span.h>

#include <Eigen/Core>
#include <vector>

#include "sixpoint/geometry/v1/geometry.pb.h"

namespace sixpoint::runtime {

std::vector<double> RowMajor(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

void SetPoint(absl::Span<const double> xyz_mm, geometry::v1::Point* out);
void SetDirection(absl::Span<const double> xyz, geometry::v1::Direction* out);
void SetLine(absl::Span<const double> direction, absl::Span<const double> point_mm, geometry::v1::Line* out);
void SetTransform(absl::Span<const double> upper_rows, geometry::v1::RigidTransform* out);
void SetMatrix(absl::Span<const double> values, int row_count, int column_count, geometry::v1::Matrix* out);
void SetCovariance(absl::Span<const double> values, absl::Span<const double> reference_mm,
                   geometry::v1::PoseCovariance* out);

}  // namespace sixpoint::runtime
