#include "metrology/sections/throat.h"

#include <cmath>
#include <limits>
#include <vector>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

// By the crossings of a ray with the polygon of nodes.
bool Inside(const Outline& outline, const Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d &a = outline.nodes()[i].point_mm, &b = outline.nodes()[outline.Next(i)].point_mm;
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

bool BesideGap(const Outline& outline, const OutlinePlace& place) {
  return outline.JoinAfter(place.node) == Join::kGap ||
         (place.part == 0 && outline.nodes()[place.node].before == Join::kGap);
}

double NoiseVariance(const FittedOutline& fitted, const OutlinePlace& place) {
  const NodeNoise& noise = fitted.noise[place.part < 0.5 ? place.node : fitted.outline.Next(place.node)];
  double variance = 0;
  for (std::size_t k = 0; k < noise.by_offset.size(); ++k)
    variance += std::pow(
        static_cast<double>(noise.by_offset[k]) * fitted.mean_sigma_mm[(noise.first + k) % fitted.mean_sigma_mm.size()],
        2);
  return variance;
}

}  // namespace

absl::StatusOr<Throat> ThroatOf(const Outline& outline, const Outline& neighbour,
                                const Eigen::Isometry2d& section_from_neighbour) {
  if (!section_from_neighbour.matrix().allFinite()) return Refuse("pitch", "not finite", "a finite place");
  const Eigen::Isometry2d neighbour_from_section = section_from_neighbour.inverse();
  const auto width = [&](const OutlinePlace& here, const OutlinePlace& there) {
    return (section_from_neighbour * neighbour.PointAt(there) - outline.PointAt(here)).norm();
  };
  std::vector<Throat> from_nodes(neighbour.size());
  for (std::size_t j = 0; j < neighbour.size(); ++j) {
    from_nodes[j].other_place = {j, 0};
    from_nodes[j].place = outline.Nearest(section_from_neighbour * neighbour.nodes()[j].point_mm);
    from_nodes[j].width_mm = width(from_nodes[j].place, from_nodes[j].other_place);
  }
  Throat throat;
  throat.width_mm = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < neighbour.size(); ++j) {
    Throat tried = from_nodes[j];
    if (tried.width_mm > from_nodes[neighbour.Next(j)].width_mm ||
        tried.width_mm > from_nodes[neighbour.Previous(j)].width_mm)
      continue;
    // Of each least one among the nodes: each place in turn the nearest to the other.
    for (double last = INFINITY; last - tried.width_mm > 1e-12;) {
      last = tried.width_mm;
      tried.other_place = neighbour.Nearest(neighbour_from_section * outline.PointAt(tried.place));
      tried.place = outline.Nearest(section_from_neighbour * neighbour.PointAt(tried.other_place));
      tried.width_mm = width(tried.place, tried.other_place);
    }
    if (tried.width_mm < throat.width_mm) throat = tried;
  }
  const Vector2d here = outline.PointAt(throat.place),
                 beyond = section_from_neighbour * neighbour.PointAt(throat.other_place);
  if (Inside(outline, beyond) || Inside(neighbour, neighbour_from_section * here) || throat.width_mm < 1e-6)
    return Refuse("pitch", "outlines that meet", "a passage between them");
  throat.beside_gap = BesideGap(outline, throat.place) || BesideGap(neighbour, throat.other_place);
  return throat;
}

double ThroatStandardUncertainty(const Throat& throat, const FittedOutline& outline, const FormError& form,
                                 const FittedOutline& neighbour, const FormError& neighbour_form,
                                 double pitch_standard_uncertainty_mm) {
  return std::sqrt(NoiseVariance(outline, throat.place) + NoiseVariance(neighbour, throat.other_place) +
                   form.sigma_mm * form.sigma_mm + neighbour_form.sigma_mm * neighbour_form.sigma_mm +
                   pitch_standard_uncertainty_mm * pitch_standard_uncertainty_mm);
}

}  // namespace sixpoint::metrology
