#include "tests/services/correction/blank_plant.h"

#include <cmath>

namespace sixpoint::testing {
namespace {

using Eigen::Vector3d;

// Above the foot the leading edge is short by so much at mid span and has stock elsewhere.
Vector3d OnBlank(double lacking_mm, const Vector3d& x, const Vector3d& normal) {
  const double in_edge = Ramp((x.x() - kEdge_mm) / 5) * Ramp((x.z() + 6) / 5);
  const double lacks = std::exp(-x.z() * x.z() / 40);
  return x + in_edge * (-lacking_mm * lacks * Vector3d::UnitX() + 0.3 * (1 - lacks) * normal);
}

}  // namespace

BlankPlant::BlankPlant(double lacking_mm) : ScannedPlant(LensBlade({10, 2.5, 12}, 90)) {
  AddRegion("leading edge", plant::v1::SHAPE_REGION_KIND_MACHINED)->mutable_minimum_in_part_mm()->set_x_mm(kEdge_mm);
  plant::v1::ShapeRegion& edge = *plant.part.mutable_shape_regions(0);
  edge.mutable_minimum_in_part_mm()->set_y_mm(-100);
  edge.mutable_minimum_in_part_mm()->set_z_mm(-6);
  edge.set_allowance_mm(kAllowance_mm);
  edge.set_lower_mm(-0.9);
  edge.set_upper_mm(0.9);
  plant::v1::ShapeRegion& foot = *AddRegion("foot", plant::v1::SHAPE_REGION_KIND_DATUM);
  for (auto set : {&geometry::v1::Point::set_x_mm, &geometry::v1::Point::set_y_mm})
    (foot.mutable_maximum_in_part_mm()->*set)(100);
  foot.mutable_maximum_in_part_mm()->set_z_mm(-9);
  plant::v1::ShapeRegion& body = *AddRegion("body", plant::v1::SHAPE_REGION_KIND_FIXED);
  body.set_rest(true);
  body.set_lower_mm(-0.5);
  body.set_upper_mm(0.5);
  const auto places = metrology::SampleDesign(design, 0.12, 2);
  truth = BlankPoints(*design, places->places, [lacking_mm](const Vector3d& x, const Vector3d& normal) {
    return OnBlank(lacking_mm, x, normal);
  });
  ScanAll();
}

void BlankPlant::ScanAll() { ScanAt({90, -90, 50, -130}); }

void BlankPlant::Become(const std::function<BlankPoint(const BlankPoint&)>& machined) {
  for (BlankPoint& point : truth) point = machined(point);
  ScanAll();
}

plant::v1::ShapeRegion* BlankPlant::AddRegion(const std::string& name, plant::v1::ShapeRegionKind kind) {
  plant::v1::ShapeRegion* region = plant.part.add_shape_regions();
  region->set_region(name);
  region->set_kind(kind);
  return region;
}

}  // namespace sixpoint::testing
