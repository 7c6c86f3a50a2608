// Geometry to and from its messages.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <string>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/rotary_axes.h"
#include "sixpoint/geometry/v1/geometry.pb.h"

namespace sixpoint::runtime {

void ToProto(const Eigen::Vector3d& point_mm, geometry::v1::Point* out);
void ToProto(const Eigen::Vector3d& direction, geometry::v1::Direction* out);
void ToProto(const Eigen::Isometry3d& transform, geometry::v1::RigidTransform* out);
void ToProto(const metrology::PoseCovariance& covariance, geometry::v1::PoseCovariance* out);
void ToProto(const metrology::AxisLine& line, geometry::v1::Line* out);

// Each refuses NaN, infinities and wrong counts, naming the field.
absl::StatusOr<Eigen::Vector3d> FromProto(const std::string& field, const geometry::v1::Point& in);
absl::StatusOr<Eigen::Vector3d> FromProto(const std::string& field, const geometry::v1::Direction& in);  // unit
absl::StatusOr<Eigen::Isometry3d> FromProto(const std::string& field, const geometry::v1::RigidTransform& in);
absl::StatusOr<metrology::PoseCovariance> FromProto(const std::string& field, const geometry::v1::PoseCovariance& in);
absl::StatusOr<metrology::AxisLine> FromProto(const std::string& field, const geometry::v1::Line& in);
absl::StatusOr<Eigen::MatrixXd> FromProto(const std::string& field, const geometry::v1::Matrix& in);

}  // namespace sixpoint::runtime
