// The prepared surface beside the CAD's own: how far from it a true point seems to lie, and its foot.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "metrology/cad/tessellation.h"
#include "metrology/surface/surface.h"
#include "tests/metrology/cad/sample_cad.h"
#include "tests/metrology/cad/true_surface.h"

namespace sixpoint::metrology {
namespace {

using testing::SampleShape;

constexpr double kWithinUm = 0.1;
constexpr std::size_t kPoints = 200'000;
constexpr double kBandMm = 0.02;  // how far off the surface it is asked too: what a scan near a fit is

constexpr double kFromEdgesMm = 0.1;

struct Deviations {
  double worst_um = 0, worst_of_999_um = 0;
};

std::string CopyOf(const std::string& bytes) {
  const std::string path = std::filesystem::temp_directory_path() / ("surface-truth-" + std::to_string(getpid()));
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::shared_ptr<const Surface> Prepared(const std::string& path) {
  auto mesh = TessellateCad(CadFormat::kStep, path, {});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *Surface::Prepare(*std::move(mesh));
}

// Of true points moved along their true normals.
Deviations Measure(const Surface& surface, const std::string& path, double off_mm, std::uint64_t seed = 1) {
  std::vector<double> off_um;
  std::vector<Eigen::Vector3d> doubtful;
  std::vector<double> doubtful_found_mm;
  const std::vector<testing::TruePoint> truths = testing::TruePoints(path, kFromEdgesMm, kPoints, seed);
  EXPECT_EQ(truths.size(), kPoints);
  for (const testing::TruePoint& truth : truths) {
    const Eigen::Vector3d query = truth.point_mm + off_mm * truth.normal;
    const double found_mm = surface.Closest(query).signed_distance_mm;
    off_um.push_back(1e3 * std::abs(found_mm - off_mm));
    if (off_um.back() <= kWithinUm || off_mm == 0) continue;
    // Deeper than the surface's radius (a trailing edge) another point of it is nearer: the kernel's own search decides.
    off_um.pop_back();
    doubtful.push_back(query);
    doubtful_found_mm.push_back(found_mm);
  }
  EXPECT_LT(doubtful.size(), kPoints / 1000);
  const std::vector<double> true_mm = testing::TrueDistances(path, doubtful);
  for (std::size_t i = 0; i < doubtful.size(); ++i) {
    EXPECT_GT(doubtful_found_mm[i] * off_mm, 0) << "on the wrong side";
    off_um.push_back(1e3 * std::abs(std::abs(doubtful_found_mm[i]) - true_mm[i]));
  }
  std::sort(off_um.begin(), off_um.end());
  const Deviations found{off_um.back(), off_um[off_um.size() * 999 / 1000]};
  std::printf("%zu triangles, %zu points %+.3f mm off: worst %.4f um, 99.9 %% %.4f um; %zu by the kernel's search\n",
              surface.mesh().triangles.size(), off_um.size(), off_mm, found.worst_um, found.worst_of_999_um,
              doubtful.size());
  return found;
}

TEST(SurfaceTruth, IsWithinATenthOfAMicrometreOfShapesWithClosedForms) {
  for (const SampleShape shape : {SampleShape::kCylinder, SampleShape::kSphere, SampleShape::kTorus,
                                  SampleShape::kFarCylinder, SampleShape::kMirroredCone}) {
    SCOPED_TRACE(static_cast<int>(shape));
    const std::string path = CopyOf(testing::StepOf(shape));
    const auto surface = Prepared(path);
    for (const std::uint64_t seed : {1, 2, 3})
      for (const double off_mm : {0.0, kBandMm, -kBandMm}) {
        const Deviations found = Measure(*surface, path, off_mm, seed);
        EXPECT_LE(found.worst_um, kWithinUm);
        EXPECT_LE(found.worst_of_999_um, 0.5 * kWithinUm);
      }
    std::filesystem::remove(path);
  }
}

TEST(SurfaceTruth, IsWithinATenthOfAMicrometreOfARealVane) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::string path = std::string(shared == nullptr ? "" : shared) + "/data/plant-a/cad.step";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no shared/data/plant-a";
  const auto surface = Prepared(path);
  for (const std::uint64_t seed : {1, 2, 3})
    for (const double off_mm : {0.0, kBandMm, -kBandMm}) {
      const Deviations found = Measure(*surface, path, off_mm, seed);
      EXPECT_LE(found.worst_um, kWithinUm);
      EXPECT_LE(found.worst_of_999_um, 0.5 * kWithinUm);
    }
}

}  // namespace
}  // namespace sixpoint::metrology
