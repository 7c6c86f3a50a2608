#include "metrology/sections/samples.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kLeastAcross = 0.5;  // of a normal, in the plane: leans of up to 60 deg

// Adds the sample, or counts why not. Section frame.
void Slide(const Vector3d& point_mm, const SurfacePoint& nearest, const Eigen::Matrix3d& section_from_part,
           SectionSamples* found) {
  if (std::isnan(nearest.signed_distance_mm)) return void(++found->far_from_surface_count);
  const Vector3d normal = section_from_part * nearest.normal;
  const double across = normal.head<2>().norm();
  if (across < kLeastAcross) return void(++found->too_flat_count);
  const double lean = -normal.z() / across;
  found->samples.push_back({point_mm.head<2>() - lean * point_mm.z() * normal.head<2>() / across, 0, lean});
}

}  // namespace

SectionSamples SamplesNear(const Points& points_mm, const Eigen::Isometry3d& part_from_section, double half_width_mm,
                           const Surface* surface, double reach_mm, int thread_count) {
  constexpr std::size_t kChunk = 16384;
  const Eigen::Isometry3d section_from_part = part_from_section.inverse();
  const Eigen::RowVector3d along = section_from_part.linear().row(2);
  const double from = section_from_part.translation().z();
  const auto parts =
      OfEachChunk<SectionSamples>(points_mm.size(), kChunk, thread_count, [&](std::size_t begin, std::size_t end) {
        SectionSamples part;
        for (std::size_t i = begin; i < end; ++i) {
          const double beyond_mm = along.dot(points_mm[i]) + from;
          if (!points_mm[i].allFinite()) ++part.not_finite_count;
          if (!(std::abs(beyond_mm) <= half_width_mm) || !points_mm[i].allFinite()) continue;
          const Vector3d point_mm = section_from_part * points_mm[i];
          if (surface == nullptr) {
            part.samples.push_back({point_mm.head<2>(), point_mm.z(), 0});
          } else {
            Slide(point_mm, surface->ClosestWithin(points_mm[i], reach_mm), section_from_part.linear(), &part);
          }
        }
        return part;
      });
  SectionSamples all;
  for (const SectionSamples& part : parts) {
    all.samples.insert(all.samples.end(), part.samples.begin(), part.samples.end());
    all.not_finite_count += part.not_finite_count;
    all.far_from_surface_count += part.far_from_surface_count;
    all.too_flat_count += part.too_flat_count;
  }
  const auto key = [](const SectionSample& s) {
    return std::make_tuple(s.point_mm.x(), s.point_mm.y(), s.beyond_mm, s.lean);
  };
  std::sort(all.samples.begin(), all.samples.end(),
            [&](const SectionSample& a, const SectionSample& b) { return key(a) < key(b); });
  return all;
}

}  // namespace sixpoint::metrology
