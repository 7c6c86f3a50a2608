#include "services/runtime/geometry_proto.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <cmath>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

// What six printed digits leave of a unit vector or a rotation; beyond it the sender means something else.
constexpr double kUnitTolerance = 1e-6;
// Values at rounding level stay as sent, so that what was stored comes back to the same bits.
constexpr double kExactEnough = 1e-12;
constexpr std::int64_t kMostMatrixValues = 1'000'000;

template <typename Values>
absl::Status CheckValues(const std::string& field, const Values& values, std::int64_t wanted_count) {
  if (values.size() != wanted_count) {
    return Refuse(field, std::to_string(values.size()) + " values", std::to_string(wanted_count));
  }
  for (int i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return Refuse(field + "[" + std::to_string(i) + "]", values[i], "a finite number");
  }
  return absl::OkStatus();
}

absl::Status CheckFinite(const std::string& field, double value) {
  return std::isfinite(value) ? absl::OkStatus() : Refuse(field, value, "a finite number");
}

}  // namespace

void ToProto(const Eigen::Vector3d& point_mm, geometry::v1::Point* out) {
  out->set_x_mm(point_mm.x());
  out->set_y_mm(point_mm.y());
  out->set_z_mm(point_mm.z());
}

void ToProto(const Eigen::Vector3d& direction, geometry::v1::Direction* out) {
  out->set_x(direction.x());
  out->set_y(direction.y());
  out->set_z(direction.z());
}

void ToProto(const Eigen::Isometry3d& transform, geometry::v1::RigidTransform* out) {
  out->clear_rotation();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out->add_rotation(transform.linear()(row, column));
  }
  ToProto(Eigen::Vector3d(transform.translation()), out->mutable_translation_mm());
}

void ToProto(const metrology::PoseCovariance& covariance, geometry::v1::PoseCovariance* out) {
  out->clear_values();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) out->add_values(covariance.values(row, column));
  }
  ToProto(covariance.reference_mm, out->mutable_reference_mm());
}

void ToProto(const metrology::AxisLine& line, geometry::v1::Line* out) {
  ToProto(line.direction, out->mutable_direction());
  ToProto(line.point_mm, out->mutable_point_mm());
}

absl::StatusOr<Eigen::Vector3d> FromProto(const std::string& field, const geometry::v1::Point& in) {
  for (const auto& [name, value] : {std::pair{".x_mm", in.x_mm()}, {".y_mm", in.y_mm()}, {".z_mm", in.z_mm()}}) {
    if (const absl::Status finite = CheckFinite(field + name, value); !finite.ok()) return finite;
  }
  return Eigen::Vector3d(in.x_mm(), in.y_mm(), in.z_mm());
}

absl::StatusOr<Eigen::Vector3d> FromProto(const std::string& field, const geometry::v1::Direction& in) {
  for (const auto& [name, value] : {std::pair{".x", in.x()}, {".y", in.y()}, {".z", in.z()}}) {
    if (const absl::Status finite = CheckFinite(field + name, value); !finite.ok()) return finite;
  }
  const Eigen::Vector3d direction(in.x(), in.y(), in.z());
  const double length = direction.norm();
  if (!(std::abs(length - 1) <= kUnitTolerance)) return Refuse(field, length, "a direction of length 1 within 1e-6");
  if (std::abs(length - 1) <= kExactEnough) return direction;
  return Eigen::Vector3d(direction / length);
}

absl::StatusOr<Eigen::Isometry3d> FromProto(const std::string& field, const geometry::v1::RigidTransform& in) {
  const absl::Status values = CheckValues(field + ".rotation", in.rotation(), 9);
  if (!values.ok()) return values;
  if (!in.has_translation_mm()) return Refuse(field + ".translation_mm", "", "a point");
  const absl::StatusOr<Eigen::Vector3d> translation_mm = FromProto(field + ".translation_mm", in.translation_mm());
  if (!translation_mm.ok()) return translation_mm.status();
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = in.rotation(i);
  const double defect = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(defect <= kUnitTolerance)) {
    return Refuse(field + ".rotation", defect, "orthonormal rows: |R R^T - 1| at most 1e-6");
  }
  if (rotation.determinant() < 0) return Refuse(field + ".rotation", rotation.determinant(), "determinant +1");
  if (defect > kExactEnough) {  // the nearest rotation
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
  }
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.linear() = rotation;
  transform.translation() = *translation_mm;
  return transform;
}

absl::StatusOr<metrology::PoseCovariance> FromProto(const std::string& field, const geometry::v1::PoseCovariance& in) {
  const absl::Status values = CheckValues(field + ".values", in.values(), 36);
  if (!values.ok()) return values;
  const absl::StatusOr<Eigen::Vector3d> reference_mm = FromProto(field + ".reference_mm", in.reference_mm());
  if (!reference_mm.ok()) return reference_mm.status();
  metrology::PoseCovariance covariance(metrology::Matrix6d::Zero(), *reference_mm);
  for (int i = 0; i < 36; ++i) covariance.values(i / 6, i % 6) = in.values(i);
  metrology::Vector6d inverse_deviation = metrology::Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const double variance = covariance.values(i, i);
    if (variance < 0) return Refuse(field + ".values[" + std::to_string(7 * i) + "]", variance, "a variance >= 0");
    if (variance > 0) inverse_deviation(i) = 1 / std::sqrt(variance);
  }
  // As correlations, for variances of rad^2 and mm^2 differ by orders of magnitude.
  const metrology::Matrix6d correlation =
      inverse_deviation.asDiagonal() * covariance.values * inverse_deviation.asDiagonal();
  const double asymmetry = (correlation - correlation.transpose()).cwiseAbs().maxCoeff();
  if (!(asymmetry <= 1e-6))
    return Refuse(field + ".values", asymmetry, "a symmetric matrix within 1e-6 of correlation");
  const double least =
      Eigen::SelfAdjointEigenSolver<metrology::Matrix6d>(correlation, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
  if (!(least >= -1e-6)) return Refuse(field + ".values", least, "a matrix without negative eigenvalues");
  return covariance;
}

absl::StatusOr<metrology::AxisLine> FromProto(const std::string& field, const geometry::v1::Line& in) {
  const absl::StatusOr<Eigen::Vector3d> direction = FromProto(field + ".direction", in.direction());
  if (!direction.ok()) return direction.status();
  const absl::StatusOr<Eigen::Vector3d> point_mm = FromProto(field + ".point_mm", in.point_mm());
  if (!point_mm.ok()) return point_mm.status();
  return metrology::AxisLine{*direction, *point_mm};
}

absl::StatusOr<Eigen::MatrixXd> FromProto(const std::string& field, const geometry::v1::Matrix& in) {
  if (in.row_count() < 0) return Refuse(field + ".row_count", in.row_count(), ">= 0");
  if (in.column_count() < 0) return Refuse(field + ".column_count", in.column_count(), ">= 0");
  const std::int64_t count = static_cast<std::int64_t>(in.row_count()) * in.column_count();
  if (count > kMostMatrixValues) return Refuse(field, std::to_string(count) + " values", "at most 1000000");
  const absl::Status values = CheckValues(field + ".values", in.values(), count);
  if (!values.ok()) return values;
  Eigen::MatrixXd matrix(in.row_count(), in.column_count());
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      matrix(row, column) = in.values(static_cast<int>(row * matrix.cols() + column));
    }
  }
  return matrix;
}

}  // namespace sixpoint::runtime
