#include "tests/services/correction/blank_plant.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "storage/blobs.h"

namespace sixpoint::testing {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

// Above the foot the leading edge is short by so much at mid span and has stock elsewhere.
Vector3d OnBlank(double lacking_mm, const Vector3d& x, const Vector3d& normal) {
  const double in_edge = Ramp((x.x() - kEdge_mm) / 5) * Ramp((x.z() + 6) / 5);
  const double lacks = std::exp(-x.z() * x.z() / 40);
  return x + in_edge * (-lacking_mm * lacks * Vector3d::UnitX() + 0.3 * (1 - lacks) * normal);
}

}  // namespace

BlankPlant::BlankPlant(double lacking_mm) : design(LensBlade({10, 2.5, 12}, 90)) {
  for (const std::string& scan : scans) registration.registration.add_scans(scan);
  plant.surface_bytes = metrology::MeshBytes(design->mesh());
  plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant.surface_bytes));
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

void BlankPlant::ScanAll() {
  std::mt19937_64 random(11);
  const double b_deg[] = {90, -90, 50, -130};
  for (std::size_t scan = 0; scan < scans.size(); ++scan) Scan(scan, b_deg[scan], &random);
}

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

void BlankPlant::Scan(std::size_t scan, double b_deg, std::mt19937_64* random) {
  const Eigen::Matrix3d turned =
      block.axes.MachineFromZero(0, b_deg * kPi / 180).linear() * block.pose.zero_from_part.linear();
  metrology::Points seen;
  for (const BlankPoint& point : truth)
    if ((turned * point.outward).z() > 0.17) seen.push_back(point.point_mm);
  const metrology::LineScan read = metrology::Scanned(block, b_deg, seen, random);
  const auto encoded = metrology::EncodeBlock(read.points_mm, metrology::kDefaultErrorBoundMm);
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  clients::PayloadsDigest digest;
  digest.Add(encoded->bytes);
  ingest::v1::Scan& record = ingest.scans[scans[scan]];
  record.mutable_header()->set_kind(ingest::v1::SCAN_KIND_LOCAL);
  record.mutable_header()->set_b_deg(b_deg);
  record.mutable_header()->set_point_count(static_cast<std::int64_t>(seen.size()));
  record.set_sha256(digest.ToHex());
  ingest.blocks[scans[scan]] = encoded->bytes;
}

}  // namespace sixpoint::testing
