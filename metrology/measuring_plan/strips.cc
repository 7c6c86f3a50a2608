#include "metrology/measuring_plan/strips.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Neighbours overlap by the rest.
constexpr double kShareOfField = 0.95;
// A line of sight begins so far from its own triangle.
constexpr double kOffSurface_mm = 1e-4;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void Take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// Middles of as few windows of that size as cover the range, evenly; of more than that many only the first, and one.
std::vector<double> Windows(const Range& range, double size, std::size_t most) {
  const double extent = range.high - range.low;
  const double count = std::max(1.0, std::ceil(extent / (kShareOfField * size)));
  std::vector<double> middles;
  for (std::size_t i = 0; static_cast<double>(i) < count && i <= most; ++i)
    middles.push_back(range.low + extent * (static_cast<double>(i) + 0.5) / count);
  return middles;
}

}  // namespace

PoseView::PoseView(const PlanScene& scene, const std::vector<SurfaceSample>& samples, const RotaryPose& pose)
    : scene_(scene), samples_(samples), pose_(pose), machine_from_part_(scene.MachineFromPart(pose)) {
  const double widest_rad = scene.options.greatest_incidence_rad + scene.view.optics().line_angle_rad / 2;
  const double least = widest_rad < M_PI ? std::cos(widest_rad) : -1;
  const Vector3d beam_in_part = machine_from_part_.linear().transpose() * scene.view.machine_from_sensor().col(2);
  for (std::uint32_t i = 0; i < samples.size(); ++i)
    if (samples[i].normal.dot(beam_in_part) >= least)
      facing_.push_back({i, scene.view.ReadingAtV0Zero(machine_from_part_ * samples[i].point_mm)});
}

std::vector<Strip> PoseView::StripsOverAll(std::size_t most) const {
  std::vector<Strip> strips;
  if (facing_.empty()) return strips;
  const ScannerView& view = scene_.view;
  const double width_mm = 2 * view.HalfWidthAt_mm(view.HalfRange_mm());  // where it is narrowest
  Range across;
  for (const Facing& facing : facing_) across.Take(facing.reading_mm.y());
  for (const double y_mm : Windows(across, width_mm, most)) {
    Range depth;
    for (const Facing& facing : facing_)
      if (std::abs(facing.reading_mm.y() - y_mm) <= width_mm / 2) depth.Take(facing.reading_mm.z());
    if (!(depth.low <= depth.high)) continue;
    for (const double z_mm : Windows(depth, 2 * view.HalfRange_mm(), most - std::min(most, strips.size())))
      strips.push_back({pose_, Vector3d(0, -y_mm, -z_mm)});
    if (strips.size() > most) break;
  }
  return strips;
}

Strip PoseView::StripOver(const Vector3d& point_in_part_mm) const {
  const Vector3d reading_mm = scene_.view.ReadingAtV0Zero(machine_from_part_ * point_in_part_mm);
  return {pose_, Vector3d(0, -reading_mm.y(), -reading_mm.z())};
}

// By the part itself, or by a neighbour.
bool PoseView::IsHidden(const Vector3d& from_mm, const Vector3d& source_mm) const {
  return scene_.surface.Meets(from_mm, source_mm) ||
         std::any_of(scene_.neighbour_from_part.begin(), scene_.neighbour_from_part.end(),
                     [&](const Eigen::Isometry3d& neighbour_from_part) {
                       return scene_.surface.Meets(neighbour_from_part * from_mm, neighbour_from_part * source_mm);
                     });
}

StripSight PoseView::Look(const Strip& strip) const {
  StripSight sight{strip, {}, {}};
  const double least = std::cos(scene_.options.greatest_incidence_rad);
  const Eigen::Matrix3d part_from_machine = machine_from_part_.linear().transpose();
  for (const Facing& facing : facing_) {
    const Vector3d reading_mm = facing.reading_mm + strip.shift_mm;
    if (!scene_.view.Reads(reading_mm.y(), reading_mm.z())) continue;
    const Vector3d to_source_mm = part_from_machine * scene_.view.TowardsSource(reading_mm.y(), reading_mm.z());
    const double distance_mm = to_source_mm.norm();
    const SurfaceSample& sample = samples_[facing.sample];
    if (!(sample.normal.dot(to_source_mm) >= least * distance_mm)) continue;
    sight.faced.push_back(facing.sample);
    const Vector3d from_mm = sample.point_mm + kOffSurface_mm / distance_mm * to_source_mm;
    if (IsHidden(from_mm, sample.point_mm + to_source_mm)) continue;
    sight.seen.push_back({facing.sample, static_cast<float>(reading_mm.x())});
  }
  return sight;
}

}  // namespace sixpoint::metrology
