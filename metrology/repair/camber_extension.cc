#include "metrology/repair/camber_extension.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "metrology/repair/outline_sides.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kExtensionPoints = 16;
constexpr double kTipReachRadii = 0.5;  // so far along the outline a better tip is looked for
constexpr double kTipSettled_mm = 1e-3;
// Off the middle: what is less stays straight, for a tip that follows noise says nothing of those above it.
constexpr double kEven_mm = 2e-3;

// Where it first leaves the outline.
std::optional<double> LeavesAt(const Outline& outline, const Way& way, double longest_mm) {
  constexpr int kSteps = 200;
  const auto outside = [&](double x) {
    const OutlinePlace place = outline.Nearest(way.At(x));
    return (way.At(x) - outline.PointAt(place)).dot(outline.NormalAt(place)) > 0;
  };
  for (int k = 1; k <= kSteps; ++k) {
    double low = longest_mm * (k - 1) / kSteps, high = longest_mm * k / kSteps;
    if (!outside(high)) continue;
    for (int turn = 0; turn < 40; ++turn) (outside((low + high) / 2) ? high : low) = (low + high) / 2;
    return low;
  }
  return std::nullopt;
}

// About a round end's centre the middle turns more than places before it tell: of all tips nearby the one to which a straight way from the last
// place is least off the middle.
void EvenOut(const Outline& outline, double far_tip_mm, std::size_t last_told, double radius_mm,
             CamberExtension* extension) {
  const Vector2d from_mm = extension->points_mm[last_told];
  const std::size_t rest = extension->points_mm.size() - 1 - last_told;
  const double found_mm = outline.At(outline.Nearest(extension->tip_mm));
  const auto place = [&](const Vector2d& tip_mm, std::size_t k) {
    return Vector2d(from_mm + static_cast<double>(k) / static_cast<double>(rest) * (tip_mm - from_mm));
  };
  const auto off_mm = [&](double tip_at_mm) {
    const OutlineSides sides(outline, tip_at_mm, far_tip_mm);
    const Vector2d tip_mm = outline.PointAt(outline.PlaceAt(tip_at_mm));
    double most = 0;
    for (std::size_t k = 1; k < rest; ++k) most = std::max(most, std::abs(sides.Difference(place(tip_mm, k))));
    return most;
  };
  double best_mm = found_mm, least_mm = off_mm(found_mm);
  for (double step_mm = kTipReachRadii * radius_mm / 2; step_mm > kTipSettled_mm && least_mm > kEven_mm; step_mm /= 2) {
    for (const double at_mm : {best_mm - step_mm, best_mm + step_mm}) {
      const double off = off_mm(at_mm);
      if (off < least_mm) least_mm = off, best_mm = at_mm;
    }
  }
  extension->tip_mm = outline.PointAt(outline.PlaceAt(best_mm));
  extension->outward = (extension->tip_mm - from_mm).normalized();
  for (std::size_t k = 1; k <= rest; ++k) extension->points_mm[last_told + k] = place(extension->tip_mm, k);
}

}  // namespace

CamberExtension ExtensionAlong(Way way, const Outline& outline, double longest_mm, const SectionEnd& end) {
  auto leaves = LeavesAt(outline, way, longest_mm);
  if (!leaves) {
    const Vector2d ahead = end.tip_mm - way.from_mm;
    way = {way.from_mm, ahead.norm() > 1e-9 ? ahead.normalized() : end.outward, 0};
    leaves = ahead.norm();
  }
  CamberExtension extension;
  for (std::size_t k = 0; k <= kExtensionPoints; ++k)
    extension.points_mm.push_back(way.At(*leaves * static_cast<double>(k) / kExtensionPoints));
  extension.tip_mm = extension.points_mm.back();
  extension.outward = (way.along + 2 * way.bend * *leaves * LeftOf(way.along)).normalized();
  return extension;
}

CamberExtension BisectedExtension(CamberExtension extension, const Outline& outline, double far_tip_mm,
                                  const Vector2d& inside_mm, double radius_mm) {
  std::optional<std::size_t> last_told;
  for (int turn = 0; turn < 4; ++turn) {
    const OutlineSides sides(outline, outline.At(outline.Nearest(extension.tip_mm)), far_tip_mm);
    std::vector<Vector2d> told;
    for (std::size_t k = 0; k < extension.points_mm.size(); ++k) {
      const Vector2d ahead = extension.points_mm[std::min(k + 1, extension.points_mm.size() - 1)] -
                             extension.points_mm[k == 0 ? 0 : k - 1];
      const auto middle = sides.MiddleNear(extension.points_mm[k], LeftOf(ahead.normalized()), radius_mm / 2);
      if (middle) told.push_back(middle->centre_mm);
    }
    if (told.empty()) break;
    // Over half of what is told, or half a radius: two places next to each other would not tell a direction.
    const Vector2d along = (told.back() - (told.size() < 6 ? inside_mm : told[told.size() / 2])).normalized();
    const auto leaves = LeavesAt(outline, {told.back(), along, 0}, 4 * radius_mm);
    if (!leaves) break;
    extension.tip_mm = told.back() + *leaves * along;
    extension.outward = along;
    extension.points_mm = told;
    const int rest = std::max<int>(4, kExtensionPoints - told.size());
    for (int k = 1; k <= rest; ++k) extension.points_mm.push_back(told.back() + *leaves * k / rest * along);
    last_told = told.size() - 1;
  }
  if (last_told) EvenOut(outline, far_tip_mm, *last_told, radius_mm, &extension);
  return extension;
}

}  // namespace sixpoint::metrology
