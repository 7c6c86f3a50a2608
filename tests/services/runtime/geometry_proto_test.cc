#include "services/runtime/geometry_proto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/runtime/stored_geometry.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::Isometry3d SomePose() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = metrology::RotationFromVector(Eigen::Vector3d(0.3, -1.1, 0.7));
  pose.translation() = Eigen::Vector3d(12.125, -300.1, 1.0 / 3);
  return pose;
}

std::string MessageOf(const absl::Status& status) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(GeometryProto, APoseComesBackToTheSameBits) {
  geometry::v1::RigidTransform wire;
  ToProto(SomePose(), &wire);
  EXPECT_EQ(wire.rotation(1), SomePose().linear()(0, 1));  // row-major
  const absl::StatusOr<Eigen::Isometry3d> back = FromProto("zero_from_part", wire);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->matrix(), SomePose().matrix());
}

TEST(GeometryProto, APoseOfSixDigitsIsMadeARotationAgain) {
  geometry::v1::RigidTransform wire;
  ToProto(SomePose(), &wire);
  for (double& value : *wire.mutable_rotation()) value = std::round(value * 1e7) / 1e7;
  const absl::StatusOr<Eigen::Isometry3d> back = FromProto("p", wire);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_LT((back->linear() * back->linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((back->linear() - SomePose().linear()).norm(), 3e-7);
}

TEST(GeometryProto, RefusesWhatIsNoPoseNamingTheField) {
  geometry::v1::RigidTransform good;
  ToProto(SomePose(), &good);
  geometry::v1::RigidTransform bad = good;
  bad.mutable_rotation()->RemoveLast();
  EXPECT_EQ(MessageOf(FromProto("p", bad).status()), "p.rotation: 8 values, want 9");
  bad = good;
  bad.set_rotation(4, kNan);
  EXPECT_EQ(MessageOf(FromProto("p", bad).status()), "p.rotation[4]: NaN, want a finite number");
  bad = good;
  for (int i = 0; i < 3; ++i) bad.set_rotation(i, -bad.rotation(i));  // a mirror image
  EXPECT_THAT(MessageOf(FromProto("p", bad).status()), HasSubstr("determinant +1"));
  bad = good;
  bad.set_rotation(0, bad.rotation(0) + 1e-4);
  EXPECT_THAT(MessageOf(FromProto("p", bad).status()), HasSubstr("p.rotation: "));
  bad = good;
  bad.clear_translation_mm();
  EXPECT_EQ(MessageOf(FromProto("p", bad).status()), "p.translation_mm: empty, want a point");
  bad = good;
  bad.mutable_translation_mm()->set_y_mm(-std::numeric_limits<double>::infinity());
  EXPECT_EQ(MessageOf(FromProto("p", bad).status()), "p.translation_mm.y_mm: -inf, want a finite number");
  EXPECT_FALSE(FromProto("p", geometry::v1::RigidTransform()).ok());  // an empty message is no identity
}

TEST(GeometryProto, ADirectionHasLengthOne) {
  geometry::v1::Direction wire;
  ToProto(Eigen::Vector3d(0, 0.6, 0.8), &wire);
  EXPECT_EQ(*FromProto("d", wire), Eigen::Vector3d(0, 0.6, 0.8));
  wire.set_x(0.01);
  EXPECT_THAT(MessageOf(FromProto("d", wire).status()), HasSubstr("d: 1.00004"));
  EXPECT_FALSE(FromProto("d", geometry::v1::Direction()).ok());
}

TEST(GeometryProto, ALineRoundTripsAndNamesItsPart) {
  geometry::v1::Line wire;
  ToProto(metrology::AxisLine{Eigen::Vector3d::UnitY(), Eigen::Vector3d(1, 2, 3)}, &wire);
  const absl::StatusOr<metrology::AxisLine> back = FromProto("a_axis", wire);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->direction, Eigen::Vector3d::UnitY());
  EXPECT_EQ(back->point_mm, Eigen::Vector3d(1, 2, 3));
  wire.mutable_point_mm()->set_z_mm(kNan);
  EXPECT_THAT(MessageOf(FromProto("a_axis", wire).status()), HasSubstr("a_axis.point_mm.z_mm: NaN"));
}

TEST(GeometryProto, ACovarianceIsSymmetricAndNotNegative) {
  metrology::PoseCovariance covariance(metrology::Matrix6d::Zero(), Eigen::Vector3d(1, 2, 3));
  Eigen::Matrix<double, 6, 6> root = Eigen::Matrix<double, 6, 6>::Random();
  root.topRows<3>() *= 1e-6;  // radians beside millimetres
  covariance.values = root * root.transpose();
  covariance.values = (covariance.values + covariance.values.transpose()).eval() / 2;
  geometry::v1::PoseCovariance wire;
  ToProto(covariance, &wire);
  const absl::StatusOr<metrology::PoseCovariance> back = FromProto("c", wire);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->values, covariance.values);
  EXPECT_EQ(back->reference_mm, covariance.reference_mm);

  geometry::v1::PoseCovariance bad = wire;
  bad.set_values(1, bad.values(1) + std::sqrt(bad.values(0) * bad.values(7)) / 2);
  EXPECT_THAT(MessageOf(FromProto("c", bad).status()), HasSubstr("symmetric"));
  bad = wire;
  bad.set_values(7, -1e-12);
  EXPECT_THAT(MessageOf(FromProto("c", bad).status()), HasSubstr("c.values[7]: -1e-12, want a variance"));
  bad = wire;
  for (const int i : {1, 6}) bad.set_values(i, 2 * std::sqrt(bad.values(0) * bad.values(7)));  // correlation 2
  EXPECT_THAT(MessageOf(FromProto("c", bad).status()), HasSubstr("negative eigenvalues"));
  bad = wire;
  bad.set_values(35, kNan);
  EXPECT_THAT(MessageOf(FromProto("c", bad).status()), HasSubstr("c.values[35]: NaN"));
}

TEST(GeometryProto, AMatrixHasTheCountsThatItClaims) {
  Eigen::MatrixXd matrix(2, 3);
  matrix << 1, 2, 3, 4, 5, 6;
  geometry::v1::Matrix wire;
  SetMatrix(RowMajor(matrix), 2, 3, &wire);
  EXPECT_EQ(wire.values(3), 4);
  EXPECT_EQ(*FromProto("m", wire), matrix);
  wire.set_row_count(3);
  EXPECT_EQ(MessageOf(FromProto("m", wire).status()), "m.values: 6 values, want 9");
  wire.set_row_count(-2);
  EXPECT_EQ(MessageOf(FromProto("m", wire).status()), "m.row_count: -2, want >= 0");
  wire.set_row_count(2'000'000'000);
  wire.set_column_count(2'000'000'000);
  EXPECT_THAT(MessageOf(FromProto("m", wire).status()), HasSubstr("at most"));
}

}  // namespace
}  // namespace sixpoint::runtime
