// The stand-ins' plant with an extruded airfoil of closed forms where the pinned block stands, seen at three heights.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "storage/blobs.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::testing {

class AirfoilPlant : public JudgedPlant {
 public:
  AirfoilPlant() {
    for (const std::string& scan : scans) registration.registration.add_scans(scan);
    polygon = metrology::PolygonOf(blade, 0.02);
    plant.surface_bytes = metrology::MeshBytes(Extruded(-15, 15));
    plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant.surface_bytes));
    std::mt19937_64 random(5);
    metrology::Points points;
    for (const double height_mm : {-6.0, 4.0, 8.0}) {
      metrology::Measuring measuring;
      measuring.noise_mm = 0;  // the scanner's own comes on top
      measuring.form_mm = metrology::FourierForm(0.003, 2, 6, random);
      const metrology::Points one = metrology::MeasuredOn(polygon, measuring, random);
      for (const Eigen::Vector3d& p : one) points.emplace_back(p.x(), p.y(), height_mm + p.z());
    }
    Scan(0, points, &random);
  }

  // That scan has those points instead; part frame.
  void Scan(std::size_t scan, const metrology::Points& in_part_mm, std::mt19937_64* random) {
    const auto seen = metrology::Scanned(block, block.b_deg[scan], in_part_mm, random);
    const auto encoded = metrology::EncodeBlock(seen.points_mm, metrology::kDefaultErrorBoundMm);
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    clients::PayloadsDigest digest;
    digest.Add(encoded->bytes);
    ingest::v1::Scan& record = ingest.scans[scans[scan]];
    record.mutable_header()->set_point_count(static_cast<std::int64_t>(in_part_mm.size()));
    record.set_sha256(digest.ToHex());
    ingest.blocks[scans[scan]] = encoded->bytes;
  }

  metrology::Blade blade;  // 40 mm of arc, both ends round
  std::vector<Eigen::Vector2d> polygon;

 private:
  // Without caps: a sheet with rims at both heights.
  metrology::TriangleMesh Extruded(double low_mm, double high_mm) const {
    metrology::TriangleMesh mesh;
    const auto count = static_cast<std::uint32_t>(polygon.size());
    for (const double height_mm : {low_mm, high_mm})
      for (const Eigen::Vector2d& p : polygon) mesh.vertices_mm.emplace_back(p.x(), p.y(), height_mm);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t j = (i + 1) % count;
      mesh.triangles.push_back({i, j, count + j});
      mesh.triangles.push_back({i, count + j, count + i});
    }
    return mesh;
  }
};

}  // namespace sixpoint::testing
