#include "tests/services/correction/scanned_plant.h"

#include <gtest/gtest.h>

#include <utility>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "storage/blobs.h"

namespace sixpoint::testing {

ScannedPlant::ScannedPlant(std::shared_ptr<const metrology::Surface> of_design) : design(std::move(of_design)) {
  for (const std::string& scan : scans) registration.registration.add_scans(scan);
  plant.surface_bytes = metrology::MeshBytes(design->mesh());
  plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant.surface_bytes));
}

void ScannedPlant::ScanAt(const std::vector<double>& b_deg) {
  std::mt19937_64 random(11);
  for (std::size_t scan = 0; scan < scans.size(); ++scan) Scan(scan, b_deg[scan], &random);
}

void ScannedPlant::Scan(std::size_t scan, double b_deg, std::mt19937_64* random) {
  const Eigen::Matrix3d turned =
      block.axes.MachineFromZero(0, b_deg * metrology::kRadPerDeg).linear() * block.pose.zero_from_part.linear();
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
