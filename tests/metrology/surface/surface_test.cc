#include "metrology/surface/surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

#include "metrology/mesh/skin.h"
#include "metrology/parallel/lane_width.h"
#include "tests/metrology/mesh/shapes.h"
#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

const Vector3d kFarOrigin(6350.123, -12.7, 331.6);  // real CAD stands metres from its origin

Vector3d RandomPoint(std::mt19937_64& random, const Vector3d& low, const Vector3d& high) {
  std::uniform_real_distribution<double> unit(0, 1);
  return low + Vector3d(unit(random), unit(random), unit(random)).cwiseProduct(high - low);
}

std::shared_ptr<const Surface> Prepared(TriangleMesh mesh) {
  auto surface = Surface::Prepare(std::move(mesh));
  EXPECT_TRUE(surface.ok()) << surface.status();
  return *surface;
}

// The oracle: distance to a triangle by minimising over its plane, edges and corners one by one.
double DistanceToTriangle(const Vector3d& q, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const auto to_segment = [&q](const Vector3d& s, const Vector3d& e) {
    const double t = std::clamp((q - s).dot(e - s) / (e - s).squaredNorm(), 0.0, 1.0);
    return (s + t * (e - s) - q).norm();
  };
  double best = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const Vector3d n = (b - a).cross(c - a).normalized();
  const Vector3d foot = q - (q - a).dot(n) * n;
  if ((b - a).cross(foot - a).dot(n) >= 0 && (c - b).cross(foot - b).dot(n) >= 0 && (a - c).cross(foot - c).dot(n) >= 0)
    best = std::min(best, std::abs((q - a).dot(n)));
  return best;
}

TEST(Surface, AgreesWithBruteForce) {
  TriangleMesh mesh = shapes::Blade(40, 30, kFarOrigin);
  mesh.corner_normals.clear();
  const auto surface = Prepared(mesh);
  std::mt19937_64 random(1);
  for (int i = 0; i < 400; ++i) {
    const Vector3d q = RandomPoint(random, kFarOrigin - Vector3d::Constant(i % 2 ? 15 : 60),
                                   kFarOrigin + Vector3d::Constant(i % 2 ? 15 : 60));
    double best = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles)
      best =
          std::min(best, DistanceToTriangle(q, mesh.vertices_mm[t[0]], mesh.vertices_mm[t[1]], mesh.vertices_mm[t[2]]));
    const SurfacePoint found = surface->Closest(q);
    EXPECT_NEAR(std::abs(found.signed_distance_mm), best, 1e-9);
    EXPECT_NEAR((found.point_mm - q).norm(), best, 1e-9);
    EXPECT_NEAR(found.normal.norm(), 1, 1e-12);
  }
}

TEST(Surface, HintChangesNothing) {
  const auto surface = Prepared(shapes::Blade(60, 50, kFarOrigin));
  std::mt19937_64 random(2);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d q = RandomPoint(random, kFarOrigin - Vector3d::Constant(20), kFarOrigin + Vector3d::Constant(20));
    const SurfacePoint plain = surface->Closest(q);
    const auto hint = static_cast<std::uint32_t>(random() % surface->mesh().triangles.size());
    const SurfacePoint hinted = surface->Closest(q, hint);
    EXPECT_EQ(plain.triangle, hinted.triangle);
    EXPECT_EQ(plain.signed_distance_mm, hinted.signed_distance_mm);
  }
}

void ExpectTheSameTogether(const Surface& surface, const std::vector<Vector3d>& queries, double limit_mm,
                           const std::vector<SurfacePoint>& plain) {
  const auto count = static_cast<std::uint32_t>(queries.size());
  const Surface::Batch batch(
      surface, count,
      [&](const std::uint32_t* indices, std::size_t some, Vector3d* points_mm) {
        for (std::size_t i = 0; i < some; ++i) points_mm[i] = queries[indices[i]];
      },
      limit_mm, 2);
  std::vector<int> visits(queries.size());
  for (std::uint32_t from = 0; from < count; from += 777)
    batch.Visit(from, std::min(count, from + 777), [&](std::uint32_t i, const SurfacePoint& found) {
      ++visits[i];
      ASSERT_EQ(plain[i].triangle, found.triangle);
      if (plain[i].triangle == Surface::kNoTriangle) return;
      ASSERT_EQ(plain[i].signed_distance_mm, found.signed_distance_mm);
      ASSERT_EQ(plain[i].point_mm, found.point_mm);
      ASSERT_EQ(plain[i].normal, found.normal);
      ASSERT_EQ(plain[i].edge_distance_mm, found.edge_distance_mm);
    });
  EXPECT_EQ(visits, std::vector<int>(queries.size(), 1));
  for (const int threads : {1, 2, 3}) {
    std::vector<double> distances_mm;
    surface.SignedDistances(queries, limit_mm, threads, &distances_mm);
    ASSERT_EQ(distances_mm.size(), queries.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const double plain_mm = plain[i].signed_distance_mm;
      ASSERT_TRUE(distances_mm[i] == plain_mm || (std::isnan(distances_mm[i]) && std::isnan(plain_mm)));
    }
  }
}

TEST(Surface, ManyPointsTogetherGiveTheSameBitsAsOneByOneInEveryWidth) {
  TriangleMesh slivers = shapes::Blade(300, 3, kFarOrigin);  // triangles a hundred times as long as wide, and fans
  slivers.corner_normals.clear();
  for (TriangleMesh mesh : {shapes::Blade(60, 50, kFarOrigin), std::move(slivers)}) {
    const auto surface = Prepared(std::move(mesh));
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> off_mm(0, 1);
    std::vector<Vector3d> queries;
    const auto& triangles = surface->mesh().triangles;
    const auto& vertices = surface->mesh().vertices_mm;
    for (int i = 0; i < 20'000; ++i) {
      const auto& t = triangles[random() % triangles.size()];
      const double u = std::sqrt(unit(random)), v = i % 5 == 0 ? 0 : unit(random);  // a fifth of them over an edge
      const Vector3d on = (1 - u) * vertices[t[0]] + u * (1 - v) * vertices[t[1]] + u * v * vertices[t[2]];
      const double scale_mm = std::array<double, 4>{0, 1e-3, 0.05, 2}[static_cast<std::size_t>(i % 4)];
      queries.push_back(on + scale_mm * Vector3d(off_mm(random), off_mm(random), off_mm(random)));
    }
    // A sheet of points well off the surface; some far away, some nowhere.
    const Vector3d middle = 0.5 * (surface->minimum_mm() + surface->maximum_mm());
    for (int i = 0; i < 5000; ++i) queries.push_back(middle + Vector3d(unit(random), unit(random), 0));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < 100; ++i) {
      queries.push_back({1e9 * unit(random), 0, 0});
      queries.push_back({nan, 0, 0});
    }
    for (const bool near : {false, true}) {
      if (near) surface->PrepareNear(2);
      for (const double limit_mm : {0.02, 0.3, std::numeric_limits<double>::infinity()}) {
        // One by one by the narrowest vectors, together by all.
        UseLaneWidth(LaneWidth::kFour);
        std::vector<SurfacePoint> plain;
        for (const Vector3d& query : queries) plain.push_back(surface->ClosestWithin(query, limit_mm));
        for (const LaneWidth width : LaneWidths()) {
          UseLaneWidth(width);
          ExpectTheSameTogether(*surface, queries, limit_mm, plain);
        }
      }
    }
  }
}

// A sliver's box, in cells as small as the other triangles, would hold some 10^10 of them.
TEST(Surface, ALongSliverAmongSmallTrianglesCostsLittleNearMemory) {
  TriangleMesh mesh;
  constexpr int kAcross = 100;
  constexpr double kStepMm = 0.05;
  for (int i = 0; i <= kAcross; ++i)
    for (int j = 0; j <= kAcross; ++j) mesh.vertices_mm.emplace_back(kStepMm * i, kStepMm * j, 0);
  for (std::uint32_t i = 0; i < kAcross; ++i)
    for (std::uint32_t j = 0; j < kAcross; ++j) {
      const std::uint32_t at = i * (kAcross + 1) + j, beside = at + kAcross + 1;
      mesh.triangles.push_back({at, beside, beside + 1});
      mesh.triangles.push_back({at, beside + 1, at + 1});
    }
  const Vector3d from(10, 10, 10), along(300, 300, 300);
  mesh.vertices_mm.push_back(from);
  mesh.vertices_mm.push_back(from + along);
  mesh.vertices_mm.push_back(from + 0.5 * along + Vector3d(1e-3, 0, 0));
  const auto last = static_cast<std::uint32_t>(mesh.vertices_mm.size());
  mesh.triangles.push_back({last - 3, last - 2, last - 1});
  const auto surface = Prepared(std::move(mesh));
  const std::size_t before = surface->memory_bytes();
  surface->PrepareNear(2);
  EXPECT_LT(surface->memory_bytes() - before, 20'000'000u);
  std::vector<Vector3d> queries;
  for (int i = 0; i < 1000; ++i) queries.push_back(from + i / 1000.0 * along + Vector3d(0.02, -0.01, 0));
  std::vector<double> distances_mm;
  surface->SignedDistances(queries, 0.05, 1, &distances_mm);
  for (std::size_t i = 0; i < queries.size(); ++i)
    EXPECT_EQ(distances_mm[i], surface->ClosestWithin(queries[i], 0.05).signed_distance_mm);
}

// Slivers without end have next to no area, from which alone the cells would be micrometres wide.
TEST(Surface, ManyLongSliversCostLittleNearMemory) {
  TriangleMesh mesh;
  constexpr std::uint32_t kSlivers = 20'000;
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::uint32_t i = 0; i < kSlivers; ++i) {
    const Vector3d from = 300 * Vector3d(unit(random), unit(random), unit(random));
    const Vector3d to = 300 * Vector3d(unit(random), unit(random), unit(random));
    mesh.vertices_mm.insert(mesh.vertices_mm.end(), {from, to, 0.5 * (from + to) + Vector3d(1e-5, 1e-5, 0)});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto surface = Prepared(std::move(mesh));
  const std::size_t before = surface->memory_bytes();
  surface->PrepareNear(2);
  EXPECT_LT(surface->memory_bytes() - before, kSlivers * 4000u);
}

// The chord of a torus of this mesh is 0.8 um; the true distance must come out two orders better, near and off it.
TEST(Surface, CornerNormalsTakeTheChordalErrorAway) {
  const double major = 20, minor = 3;
  const TriangleMesh mesh = shapes::Torus(major, minor, 160, 720, kFarOrigin);
  const auto surface = Prepared(mesh);
  TriangleMesh flat = mesh;
  flat.corner_normals.clear();
  const auto facets = Prepared(flat);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI), off(-0.3, 0.3);
  double worst = 0, worst_flat = 0, worst_normal = 0;
  for (int i = 0; i < 20000; ++i) {
    const double a = turn(random), b = turn(random), d = i % 2 ? off(random) : 1e-2 * off(random);
    const Vector3d ring(std::sin(a), std::cos(a), 0), normal = std::cos(b) * ring + std::sin(b) * Vector3d::UnitZ();
    const Vector3d q = kFarOrigin + major * ring + (minor + d) * normal;
    const SurfacePoint found = surface->Closest(q);
    worst = std::max(worst, std::abs(found.signed_distance_mm - d));
    worst_flat = std::max(worst_flat, std::abs(facets->Closest(q).signed_distance_mm - d));
    worst_normal = std::max(worst_normal, (found.normal - normal).norm());
    EXPECT_EQ(found.feature, SurfaceFeature::kFace);
  }
  EXPECT_GT(worst_flat, 5e-4);
  EXPECT_LT(worst, 2e-5);
  EXPECT_LT(worst_normal, 2e-4);
}

TEST(Surface, SignsAreRightAtAThinEdge) {
  // A wedge 10 mm long, 0.02 mm thick at its root, with nothing at its tip: outside points near the tip stay outside.
  TriangleMesh mesh;
  mesh.vertices_mm = {{0, -.01, 0}, {0, .01, 0}, {10, 0, 0}, {0, -.01, 5}, {0, .01, 5}, {10, 0, 5}};
  mesh.triangles = {{0, 1, 2}, {3, 5, 4}, {0, 2, 5}, {0, 5, 3}, {1, 4, 5}, {1, 5, 2}, {0, 3, 4}, {0, 4, 1}};
  const Vector3d inside_mm(1, 0, 2.5);
  const auto surface = Prepared(mesh);
  ASSERT_LT(surface->Closest(inside_mm).signed_distance_mm, 0);
  std::mt19937_64 random(4);
  for (int i = 0; i < 5000; ++i) {
    const Vector3d q = RandomPoint(random, {8, -.01, -1}, {11, .01, 6});
    const double half = .01 * (1 - q.x() / 10);
    const bool inside = std::abs(q.y()) < half && q.z() > 0 && q.z() < 5 && q.x() < 10;
    const SurfacePoint found = surface->Closest(q);
    if (std::abs(found.signed_distance_mm) < 1e-9) continue;
    EXPECT_EQ(found.signed_distance_mm < 0, inside) << q.transpose();
  }
}

TEST(Surface, TellsSharpEdgesAndBorders) {
  const auto blade = Prepared(shapes::Blade(60, 50, Vector3d::Zero()));
  EXPECT_EQ(blade->Closest({14, 1, 24}).feature, SurfaceFeature::kEdge);
  EXPECT_EQ(blade->Closest({0, 0.5, 24}).feature, SurfaceFeature::kFace);
  TriangleMesh tube =
      shapes::Grid([](double u, double v) { return Vector3d(std::cos(2 * M_PI * u), std::sin(2 * M_PI * u), 5 * v); },
                   60, 20, false);
  const auto open = Prepared(tube);
  EXPECT_EQ(open->Closest({1.1, 0, 6}).feature, SurfaceFeature::kBorder);
  EXPECT_EQ(open->Closest({1.1, 0, 2.2}).feature, SurfaceFeature::kFace);
}

// Whatever triangle a sharp edge belongs to: next to a trailing edge the point's own is one of many within reach of it.
TEST(Surface, KnowsHowFarTheNearestSharpEdgeIs) {
  const TriangleMesh mesh = shapes::Aerofoil(200, 60);
  const auto surface = Prepared(mesh);
  const auto normal = [&](const std::array<std::uint32_t, 3>& t) {
    const Vector3d &a = mesh.vertices_mm[t[0]], &b = mesh.vertices_mm[t[1]], &c = mesh.vertices_mm[t[2]];
    return Vector3d((b - a).cross(c - a).normalized());
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vector3d> one_side;
  std::vector<std::pair<Vector3d, Vector3d>> sharp;  // from, along
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t p = t[i], q = t[(i + 1) % 3];
      const auto [at, first] = one_side.emplace(std::minmax(p, q), normal(t));
      if (!first && at->second.dot(normal(t)) < std::cos(20 * M_PI / 180))
        sharp.emplace_back(mesh.vertices_mm[p], mesh.vertices_mm[q] - mesh.vertices_mm[p]);
    }
  ASSERT_GT(sharp.size(), 400U);
  std::mt19937_64 random(6);
  std::uniform_int_distribution<std::size_t> pick(0, mesh.triangles.size() - 1), pick_edge(0, sharp.size() - 1);
  std::uniform_real_distribution<double> unit(0, 1);
  int near_count = 0, far_count = 0;
  for (int i = 0; i < 6000; ++i) {
    const auto& t = mesh.triangles[pick(random)];
    const double r = std::sqrt(unit(random)), s = unit(random);
    Vector3d p =
        (1 - r) * mesh.vertices_mm[t[0]] + r * (1 - s) * mesh.vertices_mm[t[1]] + r * s * mesh.vertices_mm[t[2]];
    if (i % 2 == 0) {
      const auto& [from, along] = sharp[pick_edge(random)];
      p = surface->Closest(from + unit(random) * along + RandomPoint(random, {-.08, -.08, -.08}, {.08, .08, .08}))
              .point_mm;
    }
    const SurfacePoint found = surface->Closest(p);
    if (found.feature != SurfaceFeature::kFace) continue;
    double least_mm = std::numeric_limits<double>::infinity();
    for (const auto& [from, along] : sharp) {
      const double at = std::clamp(along.dot(found.point_mm - from) / along.squaredNorm(), 0.0, 1.0);
      least_mm = std::min(least_mm, (found.point_mm - from - at * along).norm());
    }
    if (std::abs(least_mm - Surface::kEdgeReachMm) < 1e-9) continue;
    if (least_mm < Surface::kEdgeReachMm) {
      EXPECT_NEAR(found.edge_distance_mm, least_mm, 1e-9) << found.point_mm.transpose();
      ++near_count;
    } else {
      EXPECT_TRUE(std::isinf(found.edge_distance_mm)) << found.point_mm.transpose();
      ++far_count;
    }
  }
  EXPECT_GT(near_count, 500);
  EXPECT_GT(far_count, 500);
}

TEST(Surface, SearchesOnlyWithinTheLimit) {
  const auto surface = Prepared(shapes::Torus(20, 3, 60, 90, Vector3d::Zero()));
  EXPECT_TRUE(std::isnan(surface->ClosestWithin({0, 0, 0}, 16).signed_distance_mm));
  EXPECT_NEAR(surface->ClosestWithin({0, 0, 0}, 18).signed_distance_mm, 17, 1e-3);
  EXPECT_TRUE(std::isnan(surface->Closest({std::nan(""), 0, 0}).signed_distance_mm));
  EXPECT_NEAR(surface->Closest({0, 0, 1e9}).signed_distance_mm, 1e9, 10);
}

TEST(Surface, MomentsAreTheTorus) {
  const auto surface = Prepared(shapes::Torus(20, 3, 200, 400, kFarOrigin));
  EXPECT_LT((surface->centroid_mm() - kFarOrigin).norm(), 1e-6);
  // Mean square distance over a torus's area: R^2 + 3 r^2 / 2 + r^2 / 2 ... = R^2 + 2 r^2 (Pappus, by hand).
  EXPECT_NEAR(surface->radius_of_gyration_mm(), std::sqrt(20. * 20 + 2 * 3. * 3), 5e-3);
}

TEST(Surface, RefusesWhatBoundsNoBodyAndNamesThePlace) {
  const auto message = [](TriangleMesh mesh) {
    const auto surface = Surface::Prepare(std::move(mesh));
    return surface.ok() ? "prepared" : std::string(surface.status().message());
  };
  const TriangleMesh whole = Tetrahedron(kFarOrigin);
  EXPECT_EQ(message(whole), "prepared");
  TriangleMesh open = whole, fin = whole, inside_out = whole, far = whole, nan = whole;
  open.triangles.pop_back();
  EXPECT_EQ(message(open), "prepared") << "sheets are surfaces";
  fin.vertices_mm.push_back(kFarOrigin - Vector3d(0, 1, 1));
  fin.triangles.push_back({0, 1, 4});
  EXPECT_THAT(message(fin), HasSubstr("1 edges with more than two triangles, the first at (6350.62, -12.7, 331.6) mm"));
  TurnOver(&inside_out);
  EXPECT_THAT(message(inside_out), HasSubstr("inside out, volume -0.166667 mm3"));
  far.vertices_mm[2].z() = 2e7;
  EXPECT_THAT(message(far), HasSubstr("vertices_mm[2]"));
  nan.vertices_mm[3].x() = std::nan("");
  EXPECT_THAT(message(nan), HasSubstr("vertices_mm[3]: (nan"));
}

TEST(Surface, LeavesTrianglesWithoutAreaOutAndCountsThem) {
  TriangleMesh mesh = Tetrahedron(kFarOrigin);
  const auto whole = Prepared(mesh);
  mesh.triangles.push_back({0, 1, 1});
  const auto with = Prepared(mesh);
  EXPECT_EQ(whole->degenerate_triangle_count(), 0u);
  EXPECT_EQ(with->degenerate_triangle_count(), 1u);
  EXPECT_EQ(with->Closest(kFarOrigin).signed_distance_mm, whole->Closest(kFarOrigin).signed_distance_mm);
}

TEST(Surface, CountsTheMemoryThatItHolds) {
  const auto surface = Prepared(shapes::Torus(20, 3, 60, 90, kFarOrigin));
  const std::size_t before = surface->memory_bytes();
  EXPECT_GT(before, surface->mesh().triangles.size() * (3 * 4 + 36 + sizeof(Vector3d)));
  surface->PrepareNear(2);
  EXPECT_GT(surface->memory_bytes(), before + surface->mesh().triangles.size() * 64) << "near cells count too";
}

TEST(Surface, RefusesWhatIsNoSurface) {
  EXPECT_FALSE(Surface::Prepare({}).ok());
  TriangleMesh mesh;
  mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_FALSE(Surface::Prepare(mesh).ok()) << "no area";
  mesh.vertices_mm[2] = {0, 1, 0};
  EXPECT_TRUE(Surface::Prepare(mesh).ok());
  mesh.triangles = {{0, 1, 3}};
  EXPECT_FALSE(Surface::Prepare(mesh).ok()) << "an index out of range";
  mesh.triangles = {{0, 1, 2}};
  mesh.vertices_mm[2].y() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(Surface::Prepare(mesh).ok());
  mesh.vertices_mm[2].y() = 1;
  mesh.corner_normals = {{Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(0, 0, 1)}};
  EXPECT_FALSE(Surface::Prepare(mesh).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
