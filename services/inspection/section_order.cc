#include "services/inspection/section_order.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "refusal/refusal.h"
#include "services/inspection/order_checks.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

constexpr int kMostSections = 32;
constexpr double kGreatestPitchUncertainty_um = 1e6;

absl::StatusOr<SectionOrder::Section> OrderedSectionOf(const std::string& field, const v1::SectionPlane& in) {
  SectionOrder::Section section;
  section.name = in.section();
  runtime::Refusals refusals;
  const auto point = [&](const char* which, const geometry::v1::Point& from) {
    const auto read = runtime::FromProto(field + which, from);
    refusals.Add(read.status());
    refusals.Add(CheckCorner(field + which, read));
    return read.ok() ? *read : Eigen::Vector3d(0, 0, 0);
  };
  const auto direction = [&](const char* which, const geometry::v1::Direction& from, Eigen::Vector3d* to) {
    const auto read = runtime::FromProto(field + which, from);
    refusals.Add(read.status());
    if (read.ok()) *to = *read;
  };
  if (in.has_origin_in_part_mm())
    section.plane.origin_mm = point(".origin_in_part_mm", in.origin_in_part_mm());
  else
    refusals.Add(runtime::Refuse(field + ".origin_in_part_mm", "not stated", "a point of the plane"));
  if (in.has_normal_in_part()) direction(".normal_in_part", in.normal_in_part(), &section.plane.normal);
  if (in.has_reference_in_part()) direction(".reference_in_part", in.reference_in_part(), &section.plane.reference);
  if (in.has_leading_in_part_mm()) section.leading_mm = point(".leading_in_part_mm", in.leading_in_part_mm());
  if (in.has_near_in_part_mm()) section.near_mm = point(".near_in_part_mm", in.near_in_part_mm());
  if (!refusals.status().ok()) return refusals.status();
  const auto placed = metrology::PartFromSection(section.plane);
  if (!placed.ok()) return Under(field + ".", placed.status());
  section.part_from_section = *placed;
  return section;
}

absl::StatusOr<SectionOrder::Neighbour> NeighbourOf(const v1::Neighbour& in) {
  runtime::Refusals refusals;
  const auto offset = runtime::FromProto("neighbour.offset_in_part_mm", in.offset_in_part_mm());
  refusals.Add(offset.status());
  refusals.Add(CheckCorner("neighbour.offset_in_part_mm", offset));
  if (offset.ok() && !(offset->norm() > 0))
    refusals.Add(runtime::Refuse("neighbour.offset_in_part_mm", "0", "the way from this blade to its neighbour"));
  if (!in.has_standard_uncertainty_um())
    refusals.Add(runtime::Refuse("neighbour.standard_uncertainty_um", "not stated", "0 or more"));
  else if (!(in.standard_uncertainty_um() >= 0 && in.standard_uncertainty_um() <= kGreatestPitchUncertainty_um))
    refusals.Add(runtime::Refuse("neighbour.standard_uncertainty_um", in.standard_uncertainty_um(), "0 to 1000000 um"));
  if (!refusals.status().ok()) return refusals.status();
  return SectionOrder::Neighbour{*offset, 1e-3 * in.standard_uncertainty_um()};
}

}  // namespace

absl::StatusOr<SectionOrder> OrderOf(const v1::MeasureSectionsRequest& request) {
  SectionOrder order;
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("registration", "registrations", request.registration()).status());
  if (request.has_half_width_mm()) order.half_width_mm = request.half_width_mm();
  if (!(order.half_width_mm >= 0.01 && order.half_width_mm <= 2))
    refusals.Add(runtime::Refuse("half_width_mm", order.half_width_mm, "0.01 to 2"));
  if (request.sections().empty() || request.sections_size() > kMostSections)
    refusals.Add(runtime::Refuse("sections", request.sections_size(), "1 to 32 of them"));
  std::set<std::string> names;
  for (int i = 0; i < request.sections_size(); ++i) {
    refusals.Add(CheckCalled(At("sections", i) + ".section", request.sections(i).section(), &names));
    auto section = OrderedSectionOf(At("sections", i), request.sections(i));
    refusals.Add(section.status());
    if (section.ok()) order.sections.push_back(*std::move(section));
  }
  if (!request.reference_section().empty()) {
    const auto found = std::find_if(order.sections.begin(), order.sections.end(),
                                    [&](const auto& section) { return section.name == request.reference_section(); });
    if (found != order.sections.end())
      order.reference = static_cast<std::size_t>(found - order.sections.begin());
    else if (names.count(request.reference_section()) == 0)
      refusals.Add(runtime::Refuse("reference_section", request.reference_section(), "one of `sections`, or none"));
  }
  if (request.has_neighbour()) {
    const auto neighbour = NeighbourOf(request.neighbour());
    refusals.Add(neighbour.status());
    if (neighbour.ok()) order.neighbour = *neighbour;
  }
  if (!refusals.status().ok()) return refusals.status();
  return order;
}

}  // namespace sixpoint::inspection
