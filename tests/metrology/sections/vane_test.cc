// A real vane: noisy points of its surface beside its own sections, evaluated by the same code.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "metrology/cad/tessellation.h"
#include "metrology/sections/section_uncertainty.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using P = SectionParameter;
using Clock = std::chrono::steady_clock;

double Ms(Clock::time_point began) { return std::chrono::duration<double, std::milli>(Clock::now() - began).count(); }

// Evenly over the area, with noise along the triangle's normal.
Points Scanned(const TriangleMesh& mesh, std::size_t count, double noise_mm, std::mt19937_64& random) {
  std::vector<double> areas;
  double area = 0;
  const auto corner = [&](std::size_t t, std::size_t k) { return mesh.vertices_mm[mesh.triangles[t][k]]; };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    areas.push_back(area += (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm());
  std::uniform_real_distribution<double> anywhere(0, 1);
  std::normal_distribution<double> normal;
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto t =
        static_cast<std::size_t>(std::lower_bound(areas.begin(), areas.end(), area * anywhere(random)) - areas.begin());
    double u = anywhere(random), v = anywhere(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vector3d a = corner(t, 0), one = corner(t, 1) - a, other = corner(t, 2) - a;
    points.push_back(a + u * one + v * other + noise_mm * normal(random) * one.cross(other).normalized());
  }
  return points;
}

// Facets' chords must be smaller than what is asserted: at the nose 4 um of chord are 50 um of its radius.
TessellationOptions Fine() {
  TessellationOptions options;
  options.chordal_error_um = 0.1;
  options.greatest_chordal_error_um = 0.5;
  return options;
}

TEST(VaneSections, AreThoseOfItsSurface) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::string path = std::string(shared == nullptr ? "" : shared) + "/data/plant-a/cad.step";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no shared/data/plant-a";
  auto mesh = TessellateCad(CadFormat::kStep, path, Fine());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto surface = Surface::Prepare(*std::move(mesh));
  ASSERT_TRUE(surface.ok());
  const Vector3d low = (*surface)->minimum_mm(), high = (*surface)->maximum_mm();
  std::printf("vane from (%.1f %.1f %.1f) to (%.1f %.1f %.1f)\n", low.x(), low.y(), low.z(), high.x(), high.y(),
              high.z());
  std::mt19937_64 random(11);
  const Points points = Scanned((*surface)->mesh(), 1000000, 0.002, random);
  double slowest_ms = 0;
  // From 349 mm on the nose of the CAD itself wanders: its radius by 50 um from one height to another 0.3 mm on.
  for (const double part : {0.35, 0.42, 0.5, 0.58}) {
    SectionPlane plane;
    plane.origin_mm.z() = low.z() + part * (high.z() - low.z());
    const auto nominal = SurfaceOutline(**surface, plane, nullptr);
    ASSERT_TRUE(nominal.ok()) << nominal.status();
    OutlineOptions options;
    options.half_width_mm = 0.1;
    options.surface = surface->get();
    const auto began = Clock::now();
    const auto measured = MeasuredOutline(points, plane, options);
    ASSERT_TRUE(measured.ok()) << measured.status();
    const double outline_ms = Ms(began);
    UncertaintyOptions uncertainty;
    uncertainty.nominal = &nominal->fitted.outline;
    const auto section = MeasureSection(*measured, uncertainty);
    ASSERT_TRUE(section.ok());
    slowest_ms = std::max(slowest_ms, Ms(began));
    const SectionValues truth = ValuesOf(nominal->fitted.outline, CamberOf(nominal->fitted.outline, {}));
    std::printf("z %.2f: %lld points, %zu nodes, outline %.0f ms, all %.0f ms, waver %.2f um\n", plane.origin_mm.z(),
                static_cast<long long>(measured->evidence.used_count), measured->fitted.outline.size(), outline_ms,
                Ms(began), 1e3 * section->form.sigma_mm);
    for (std::size_t i = 0; i < kSectionParameterCount; ++i) {
      const auto p = static_cast<P>(i);
      if (!truth[p] || !section->values[p]) {
        std::printf("  %-32s %s | %s\n", NameOf(p).c_str(), ReasonOf(truth.reason(p)).c_str(),
                    ReasonOf(section->values.reason(p)).c_str());
        continue;
      }
      const double off = *section->values[p] - *truth[p], u = section->uncertainty(p).standard;
      std::printf("  %-32s %10.5f off %9.6f u %9.6f\n", NameOf(p).c_str(), *truth[p], off, u);
    }
    for (const P p :
         {P::kChordNoseTail, P::kStaggerNoseTail, P::kThicknessInscribed, P::kThicknessTwoPoint, P::kLeadingRadius}) {
      ASSERT_TRUE(truth[p]) << NameOf(p);
      ASSERT_TRUE(section->values[p]) << NameOf(p);
      // By chance beyond in 1 of 16,000.
      EXPECT_LE(std::abs(*section->values[p] - *truth[p]), 4 * section->uncertainty(p).standard + 5e-4) << NameOf(p);
    }
  }
  std::printf("slowest section of a million points: %.0f ms\n", slowest_ms);
}

}  // namespace
}  // namespace sixpoint::metrology
