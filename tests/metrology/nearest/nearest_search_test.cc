#include "metrology/nearest/nearest_search.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "metrology/nearest/near_lanes.h"
#include "tests/metrology/mesh/shapes.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNone = NearestTriangle::kNone;

// On the surface, micrometres off, where a fit is, and far beyond the cells; over edges; far away; nowhere.
Points Queries(const TriangleMesh& mesh) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> off_mm(0, 1);
  Points queries;
  for (int i = 0; i < 8000; ++i) {
    const TriangleCorners& t = mesh.triangles[random() % mesh.triangles.size()];
    const double u = std::sqrt(unit(random)), v = i % 5 == 0 ? 0 : unit(random);  // a fifth of them over an edge
    const Vector3d on =
        (1 - u) * mesh.vertices_mm[t[0]] + u * (1 - v) * mesh.vertices_mm[t[1]] + u * v * mesh.vertices_mm[t[2]];
    const double scale_mm = std::array<double, 4>{0, 1e-3, 0.05, 2}[static_cast<std::size_t>(i % 4)];
    queries.push_back(on + scale_mm * Vector3d(off_mm(random), off_mm(random), off_mm(random)));
  }
  for (int i = 0; i < 1000; ++i) queries.push_back(Vector3d(unit(random), unit(random), 0));  // a sheet inside
  for (int i = 0; i < 50; ++i) {
    queries.push_back({1e9 * unit(random), 0, 0});
    queries.push_back(Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  }
  return queries;
}

std::vector<NearestTriangle> Together(const NearestSearch& search, const Points& queries, double limit_mm,
                                      int threads) {
  const auto count = static_cast<std::uint32_t>(queries.size());
  const auto points_at = [&](const std::uint32_t* indices, std::size_t some, Vector3d* points) {
    for (std::size_t i = 0; i < some; ++i) points[i] = queries[indices[i]];
  };
  const NearestSearch::Many many(search, count, points_at, limit_mm, threads);
  std::vector<NearestTriangle> nearest(count);
  std::vector<int> visits(count);
  for (std::uint32_t from = 0; from < count; from += 777)
    many.Visit(from, std::min(count, from + 777), [&](const NearestSearch::Many::Found& found) {
      for (std::size_t i = 0; i < found.count; ++i) {
        ++visits[found.indices[i]];
        nearest[found.indices[i]] = found.nearest[i];
      }
    });
  EXPECT_EQ(visits, std::vector<int>(count, 1));
  return nearest;
}

void ExpectTheSame(const std::vector<NearestTriangle>& found, const std::vector<NearestTriangle>& plain) {
  for (std::size_t i = 0; i < plain.size(); ++i) {
    ASSERT_EQ(found[i].triangle, plain[i].triangle) << i;
    if (plain[i].triangle == kNone) continue;
    ASSERT_EQ(found[i].distance_squared, plain[i].distance_squared) << i;
    ASSERT_EQ(found[i].barycentric, plain[i].barycentric) << i;
    ASSERT_EQ(found[i].part, plain[i].part) << i;
  }
}

// Of two bytes an item, and of four.
void ExpectListsOfBothKinds(const TriangleMesh& mesh) {
  const TriangleTree tree(mesh.vertices_mm, mesh.triangles);
  const NearCells cells(tree, 0.1, 2);
  std::array<std::size_t, 2> count{};
  for (std::uint32_t cell = 0; cell < cells.cell_count(); ++cell)
    ++count[cells.CandidatesOf(cell).list.high == nullptr ? 0 : 1];
  EXPECT_GT(count[0], 50u);
  EXPECT_GT(count[1], 50u);
}

TEST(NearestSearch, EveryWidthOfLanesGivesTheBitsOfTheTree) {
  const TriangleMesh good = shapes::Blade(60, 50, Vector3d::Zero());
  const TriangleMesh slivers = shapes::Blade(300, 3, Vector3d::Zero());  // a hundred times as long as wide, and fans
  const TriangleMesh many = shapes::Blade(300, 250, Vector3d::Zero());
  ExpectListsOfBothKinds(many);
  for (const TriangleMesh* mesh : {&good, &slivers, &many}) {
    const NearestSearch search(mesh->vertices_mm, mesh->triangles);
    const Points queries = Queries(*mesh);
    for (const double limit_mm : {0.02, 0.3, kInfinity}) {
      std::vector<NearestTriangle> plain;
      for (const Vector3d& query : queries) plain.push_back(search.Find(query, limit_mm, kNone));
      if (mesh == &good && limit_mm == 0.02) ExpectTheSame(Together(search, queries, limit_mm, 2), plain);
      search.PrepareNear(2);
      for (const LaneWidth width : LaneWidths()) {
        SCOPED_TRACE(static_cast<int>(width));
        UseLaneWidth(width);
        for (const int threads : {1, 3}) ExpectTheSame(Together(search, queries, limit_mm, threads), plain);
      }
    }
  }
}

TEST(NearestSearch, AHintChangesNothing) {
  const TriangleMesh mesh = shapes::Blade(60, 50, Vector3d::Zero());
  const NearestSearch search(mesh.vertices_mm, mesh.triangles);
  std::mt19937_64 random(2);
  std::vector<NearestTriangle> plain, hinted;
  for (const Vector3d& query : Queries(mesh)) {
    plain.push_back(search.Find(query, kInfinity, kNone));
    hinted.push_back(search.Find(query, kInfinity, static_cast<std::uint32_t>(random() % mesh.triangles.size())));
  }
  ExpectTheSame(hinted, plain);
}

TEST(NearestSearch, FindsNothingBeyondTheLimitOrNowhere) {
  const Points vertices_mm{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const NearestSearch search(vertices_mm, {{0, 1, 2}});
  EXPECT_EQ(search.Find({0.2, 0.2, 1}, 0.9, kNone).triangle, kNone);
  EXPECT_EQ(search.Find({0.2, 0.2, 1}, 1, kNone).distance_squared, 1);
  EXPECT_EQ(search.Find({0.2, 0.2, 0}, -1, kNone).triangle, kNone);
  EXPECT_EQ(search.Find({std::nan(""), 0, 0}, kInfinity, kNone).triangle, kNone);
}

TEST(NearestSearch, LeavesTrianglesWithoutAreaOut) {
  const Points vertices_mm{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(NearestSearch(vertices_mm, {{0, 1, 2}, {0, 1, 1}}).triangle_count(), 1u);
  EXPECT_EQ(NearestSearch(vertices_mm, {}).Find({0, 0, 0}, kInfinity, kNone).triangle, kNone);
}

}  // namespace
}  // namespace sixpoint::metrology
