#include "metrology/mesh/edges.h"

#include <gtest/gtest.h>

#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

TEST(Edges, OfATetrahedronAreSixWholeOnes) {
  const std::vector<EdgeSide> sides = EdgeSidesOf(Tetrahedron().triangles);
  EXPECT_EQ(sides.size(), 12u);
  int edges = 0;
  ForEachEdge(sides, [&](const EdgeSide* edge, std::size_t count) {
    ++edges;
    EXPECT_TRUE(IsWhole(edge, count));
    EXPECT_EQ(edge[0].from(), edge[1].to());
  });
  EXPECT_EQ(edges, 6);
}

TEST(Edges, ASideLiesOppositeItsCorner) {
  const TriangleCorners corners{7, 3, 5};
  for (const EdgeSide& side : EdgeSidesOf({corners})) {
    EXPECT_EQ(side.from(), corners[(side.opposite + 1u) % 3]);
    EXPECT_EQ(side.to(), corners[(side.opposite + 2u) % 3]);
    EXPECT_LT(side.low, side.high);
  }
}

TEST(Edges, ATriangleThatIsAPointHasNone) {
  EXPECT_TRUE(EdgeSidesOf({{4, 4, 4}}).empty());
  EXPECT_EQ(EdgeSidesOf({{4, 4, 5}}).size(), 2u) << "a line has both its ways";
}

}  // namespace
}  // namespace sixpoint::metrology
