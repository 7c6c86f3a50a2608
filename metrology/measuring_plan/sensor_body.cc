#include "metrology/measuring_plan/sensor_body.h"

#include <cmath>
#include <vector>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
constexpr int kMostLooksAtSurface = 20'000;

TurnedBox Widened(const SensorBody& body, const Eigen::Matrix3d& axes, const Vector3d& middle_mm,
                  const Vector3d& by_mm) {
  return {middle_mm + axes * (0.5 * (body.low_mm + body.high_mm)), axes, 0.5 * (body.high_mm - body.low_mm) + by_mm};
}

}  // namespace

TurnedBox SweptBody(const SensorBody& body, const Eigen::Matrix3d& axes, const Vector3d& from_mm,
                    const Vector3d& to_mm) {
  return Widened(body, axes, 0.5 * (from_mm + to_mm), (axes.transpose() * (0.5 * (to_mm - from_mm))).cwiseAbs());
}

TurnedBox BodyBetween(const SensorBody& body, const Eigen::Matrix3d& axes, const Vector3d& from_mm,
                      const Vector3d& to_mm) {
  const Vector3d half_mm = (0.5 * (to_mm - from_mm)).cwiseAbs();
  return Widened(body, axes, 0.5 * (from_mm + to_mm), axes.transpose().cwiseAbs() * half_mm);
}

bool IsClear(const TurnedBox& box, const Surface& surface, double clearance_mm) {
  const bool closed = surface.mesh().closed;
  struct Piece {
    Vector3d middle, half;  // along the axes, from the centre
  };
  std::vector<Piece> pieces = {{Vector3d::Zero(), box.half_mm}};
  std::uint32_t hint = Surface::kNoTriangle;
  for (int looks = 0; !pieces.empty(); ++looks) {
    if (looks >= kMostLooksAtSurface) return false;
    const Piece piece = pieces.back();
    pieces.pop_back();
    const SurfacePoint nearest = surface.Closest(box.centre_mm + box.axes * piece.middle, hint);
    hint = nearest.triangle;
    const double distance_mm = closed ? nearest.signed_distance_mm : std::abs(nearest.signed_distance_mm);
    if (!(distance_mm >= clearance_mm)) return false;
    if (distance_mm - piece.half.norm() >= clearance_mm) continue;
    int longest = 0;
    piece.half.maxCoeff(&longest);
    Piece first = piece, second = piece;
    first.half[longest] = second.half[longest] = piece.half[longest] / 2;
    first.middle[longest] -= first.half[longest];
    second.middle[longest] += second.half[longest];
    pieces.push_back(first);
    pieces.push_back(second);
  }
  return true;
}

}  // namespace sixpoint::metrology
