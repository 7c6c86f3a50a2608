#include "metrology/sections/profile.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

ProfileBand BandOf(const std::vector<double>& deviations_mm) {
  ProfileBand band{deviations_mm.front(), deviations_mm.front(), 0, 0};
  for (std::size_t i = 1; i < deviations_mm.size(); ++i) {
    if (deviations_mm[i] < band.least_mm) band.least_mm = deviations_mm[i], band.least_node = i;
    if (deviations_mm[i] > band.greatest_mm) band.greatest_mm = deviations_mm[i], band.greatest_node = i;
  }
  return band;
}

std::vector<double> Distances(const Outline& nominal, const Outline& measured, const Eigen::Isometry2d& moved) {
  std::vector<double> distances_mm;
  for (const OutlineNode& node : measured.nodes())
    distances_mm.push_back(SignedDistance(nominal, moved * node.point_mm, nullptr));
  return distances_mm;
}

// The length of outline that a node stands for; gaps count for nothing.
double ShareOf(const Outline& outline, std::size_t i) {
  const auto reach = [&](std::size_t from) {
    if (outline.JoinAfter(from) != Join::kSmooth) return 0.0;
    return (outline.nodes()[outline.Next(from)].point_mm - outline.nodes()[from].point_mm).norm() / 2;
  };
  return reach(i) + reach(outline.Previous(i));
}

}  // namespace

double SignedDistance(const Outline& outline, const Vector2d& point_mm, Vector2d* normal) {
  const OutlinePlace place = outline.Nearest(point_mm);
  const Vector2d off = point_mm - outline.PointAt(place);
  const Vector2d there = outline.NormalAt(place);
  if (normal != nullptr) *normal = there;
  const double along = off.dot(there);
  return along < 0 ? -off.norm() : off.norm();
}

ProfileDeviation DeviationFrom(const Outline& nominal, const Outline& measured) {
  ProfileDeviation found;
  found.location_mm = Distances(nominal, measured, Eigen::Isometry2d::Identity());
  found.location = BandOf(found.location_mm);
  Vector2d middle = Vector2d::Zero();
  for (const OutlineNode& node : measured.nodes()) middle += node.point_mm / static_cast<double>(measured.size());
  for (int turn = 0; turn < 12; ++turn) {
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < measured.size(); ++i) {
      const Vector2d point = found.nominal_from_measured * measured.nodes()[i].point_mm;
      Vector2d normal;
      const double off = SignedDistance(nominal, point, &normal), share = ShareOf(measured, i);
      const Vector2d lever = LeftOf(Vector2d(point - found.nominal_from_measured * middle));
      const Eigen::Vector3d row(normal.x(), normal.y(), normal.dot(lever));
      squares += share * row * row.transpose();
      right -= share * off * row;
    }
    const Eigen::Vector3d by = squares.ldlt().solve(right);
    if (!by.allFinite()) break;
    const Vector2d about = found.nominal_from_measured * middle;
    found.nominal_from_measured = Eigen::Translation2d(about + by.head<2>()) * Eigen::Rotation2Dd(by[2]) *
                                  Eigen::Translation2d(-about) * found.nominal_from_measured;
    if (by.head<2>().norm() < 1e-7 && std::abs(by[2]) < 1e-9) break;
  }
  found.form_mm = Distances(nominal, measured, found.nominal_from_measured);
  found.form = BandOf(found.form_mm);
  return found;
}

}  // namespace sixpoint::metrology
