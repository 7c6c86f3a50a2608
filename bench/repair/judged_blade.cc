#include "bench/repair/judged_blade.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::bench {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kLineWidth_mm = 1;
constexpr double kFoot_mm = 0.5, kTip_mm = 0.3;  // clear of both end faces
constexpr double kCoverage = 1.959964;           // of a normal value's 95 %

}  // namespace

DrawnBlade DrawBlade(const NominalBlade& nominal, int thread_count) {
  DrawnBlade drawn;
  drawn.nominal = nominal;
  metrology::StackOptions& options = drawn.options;
  const double span_mm = nominal.high_mm.z() - nominal.low_mm.z();
  options.heights = {nominal.low_mm.z() + kFoot_mm, nominal.low_mm.z() + kMostKept * span_mm,
                     nominal.high_mm.z() - kTip_mm, kLineWidth_mm};
  options.origin_mm = ((nominal.low_mm + nominal.high_mm) / 2).head<2>();
  options.half_width_mm = 0.25;
  options.surface = nominal.surface.get();
  options.round_ends = true;  // of plant-a's blade
  options.thread_count = thread_count;
  std::vector<double> z_mm = MeasuredHeights(options.heights, 0);
  // The same steps go on to the target, which ends them.
  for (auto k = static_cast<double>(z_mm.size());; ++k) {
    const double z = options.heights.first_mm + k * options.heights.line_width_mm;
    if (z >= options.heights.target_mm - 1e-9) break;
    z_mm.push_back(z);
  }
  z_mm.push_back(options.heights.target_mm);
  drawn.sections = *NominalSections(*nominal.surface, z_mm, options);
  return drawn;
}

std::size_t KeptSections(const DrawnBlade& drawn, double part_of_span) {
  const NominalBlade& nominal = drawn.nominal;
  const double cut_mm = nominal.low_mm.z() + part_of_span * (nominal.high_mm.z() - nominal.low_mm.z());
  std::size_t kept = 0;
  while (drawn.sections[kept].z_mm <= cut_mm) ++kept;
  return kept;
}

const metrology::BladeSection& DrawnAt(const DrawnBlade& drawn, double z_mm) {
  const auto nearer = [&](const metrology::BladeSection& a, const metrology::BladeSection& b) {
    return std::abs(a.z_mm - z_mm) < std::abs(b.z_mm - z_mm);
  };
  return *std::min_element(drawn.sections.begin(), drawn.sections.end(), nearer);
}

metrology::Outline TrueOutline(const metrology::BladeSection& nominal, const BladeWorld& world,
                               const metrology::StackOptions& options) {
  std::vector<metrology::OutlineNode> nodes = nominal.outline.nodes();
  for (metrology::OutlineNode& node : nodes) {
    const Vector3d point(node.point_mm.x() + options.origin_mm.x(), node.point_mm.y() + options.origin_mm.y(),
                         nominal.z_mm);
    // The surface's normal, of which the world displaces the part within the plane.
    const Vector3d normal = Vector3d(node.normal.x(), node.normal.y(), -node.lean).normalized();
    node.point_mm += world.Displacement(point, normal).head<2>();
  }
  std::vector<metrology::OutlineNode> turned = nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    // By how neighbouring nodes turned against each other.
    const std::size_t a = i == 0 ? nodes.size() - 1 : i - 1, b = i + 1 == nodes.size() ? 0 : i + 1;
    const Vector2d before = nominal.outline.nodes()[b].point_mm - nominal.outline.nodes()[a].point_mm;
    const Vector2d after = nodes[b].point_mm - nodes[a].point_mm;
    if (before.norm() < 1e-9 || after.norm() < 1e-9) continue;
    const double turn = std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after));
    turned[i].normal = Eigen::Rotation2Dd(turn) * nodes[i].normal;
  }
  return metrology::Outline(std::move(turned));
}

void TargetErrors::Add(const metrology::TargetSection& target, const metrology::Outline& truth) {
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Vector2d& point = truth.nodes()[i].point_mm;
    const double stands_mm =
        (truth.nodes()[truth.Next(i)].point_mm - truth.nodes()[truth.Previous(i)].point_mm).norm() / 2;
    const metrology::OutlinePlace place = target.outline.Nearest(point);
    const double error_mm = std::abs((point - target.outline.PointAt(place)).dot(target.outline.NormalAt(place)));
    const double expanded_mm = kCoverage * ((1 - place.part) * target.standard_mm[place.node] +
                                            place.part * target.standard_mm[target.outline.Next(place.node)]);
    weighted_squares_mm3 += stands_mm * error_mm * error_mm;
    weighted_expanded_mm3 += stands_mm * expanded_mm * expanded_mm;
    length_mm += stands_mm;
    worst_mm = std::max(worst_mm, error_mm);
    if (error_mm <= expanded_mm) held_mm += stands_mm;
  }
}

void TargetErrors::Add(const TargetErrors& other) {
  weighted_squares_mm3 += other.weighted_squares_mm3;
  weighted_expanded_mm3 += other.weighted_expanded_mm3;
  length_mm += other.length_mm;
  held_mm += other.held_mm;
  worst_mm = std::max(worst_mm, other.worst_mm);
}

double TargetErrors::Rms_mm() const { return std::sqrt(weighted_squares_mm3 / length_mm); }

}  // namespace sixpoint::bench
