#include "metrology/registration/direction_words.h"

#include <cmath>
#include <cstdio>

#include "metrology/linear_algebra/pose_directions.h"
#include "metrology/linear_algebra/singular_values.h"
#include "metrology/registration/patch_sums.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kAlongAnAxis = 0.95;  // cosine, from which on an axis is named
constexpr double kWorthASecond = 0.5;  // of a direction's length: less of turn or shift is not said

std::string AxisWords(const Vector3d& direction) {
  const Vector3d unit = direction.normalized();
  Eigen::Index axis = 0;
  if (unit.cwiseAbs().maxCoeff(&axis) > kAlongAnAxis) return std::string("the part's ") + "xyz"[axis];
  const Vector3d shown = unit[axis] < 0 ? Vector3d(-unit) : unit;
  const Vector3d rounded = (100 * shown).array().round() / 100 + 0.0;  // + 0.0: no "-0.00"
  char text[64];
  std::snprintf(text, sizeof text, "the part's (%.2f %.2f %.2f)", rounded.x(), rounded.y(), rounded.z());
  return text;
}

// Part frame.
std::string Words(const Vector6d& direction) {
  const double turn = direction.head<3>().norm(), shift = direction.tail<3>().norm();
  if (!(turn + shift > 0)) return "";
  const std::string about = "turn about " + AxisWords(direction.head<3>());
  const std::string along = "shift along " + AxisWords(direction.tail<3>());
  if (shift >= turn) return turn > kWorthASecond * shift ? along + " with a " + about : along;
  return shift > kWorthASecond * turn ? about + " with a " + along : about;
}

// An orthonormal basis of the columns' space, each vector as near to one of the axes as it can be.
Eigen::MatrixXd AlongAxes(Eigen::MatrixXd space) {
  Eigen::MatrixXd basis(space.rows(), 0);
  while (space.cols() > 0) {
    Eigen::Index axis = 0;
    space.rowwise().norm().maxCoeff(&axis);
    const Eigen::VectorXd nearest = (space * space.row(axis).transpose()).normalized();
    basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
    basis.rightCols(1) = nearest;
    const Eigen::MatrixXd rest = space - nearest * (nearest.transpose() * space);
    space = Eigen::MatrixXd(LeftSingularVectors(rest).leftCols(space.cols() - 1));
  }
  return basis;
}

}  // namespace

std::string DirectionInWords(const Vector6d& direction, const Eigen::Isometry3d& zero_from_part) {
  Vector6d in_part;
  in_part << zero_from_part.linear().transpose() * direction.head<3>(),
      zero_from_part.linear().transpose() * direction.tail<3>();
  return Words(in_part);
}

absl::StatusOr<std::string> FreeDirectionsInWords(const Surface& surface, const std::vector<ScanPortion>& portions,
                                                  const Eigen::Isometry3d& zero_from_part, double reach_mm,
                                                  const FitOptions& options) {
  const double patch_mm = PatchWidthMm(surface.radius_of_gyration_mm());
  const auto sums = SumPatches(surface, portions, zero_from_part, {reach_mm, patch_mm}, options);
  if (!sums.ok()) return sums.status();
  Matrix6d normal = Matrix6d::Zero();
  for (const Patch& patch : sums->patches) normal += patch.Matrix();
  PoseDirections movable(6, 0);
  for (int k = 0; k < 6; ++k)
    if (options.free[static_cast<std::size_t>(k)]) {
      movable.conservativeResize(Eigen::NoChange, movable.cols() + 1);
      movable.rightCols(1) = Vector6d::Unit(k);
    }
  const EigenSystem eigen = EigenSystemOf(Restricted(normal, movable));
  const double held = eigen.values[movable.cols() - 1] / (options.condition_limit * options.condition_limit);
  Eigen::Index count = 0;
  while (count < movable.cols() && eigen.values[count] <= held) ++count;
  const Eigen::MatrixXd basis = AlongAxes(movable * eigen.vectors.leftCols(count));
  std::string listed;
  for (Eigen::Index k = basis.cols(); k-- > 0;) listed = Words(basis.col(k)) + (listed.empty() ? "" : ", ") + listed;
  return listed;
}

}  // namespace sixpoint::metrology
