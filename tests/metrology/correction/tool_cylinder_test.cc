#include "metrology/correction/tool_cylinder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::metrology {
namespace {

constexpr double kRadius = 0.4, kClearance = 0.5;
// Where the tool leaves the mouth of a hole along the normal, and how far the plane is then: closed forms of MouthHeight_mm.
constexpr double kMouth = 1.25 * (kRadius + kClearance);
constexpr double kOverPlane = kMouth - kRadius;
constexpr double kExact = 1e-9;  // of distances to planes and edges, in double

void AddBox(const Eigen::Vector3d& low, const Eigen::Vector3d& high, TriangleMesh* mesh) {
  const auto first = static_cast<std::uint32_t>(mesh->vertices_mm.size());
  for (int i = 0; i < 8; ++i)
    mesh->vertices_mm.emplace_back((i & 1 ? high : low).x(), (i & 2 ? high : low).y(), (i & 4 ? high : low).z());
  const std::uint32_t faces[12][3] = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& face : faces) mesh->triangles.push_back({first + face[0], first + face[1], first + face[2]});
  mesh->closed = true;
}

// A plate of 40 x 40 mm with its upper face at Z 0, and what stands on it.
std::shared_ptr<const Surface> Plate(const Eigen::Vector3d& low = Eigen::Vector3d::Zero(),
                                     const Eigen::Vector3d& high = Eigen::Vector3d::Zero()) {
  TriangleMesh mesh;
  AddBox({-20, -20, -5}, {20, 20, 0}, &mesh);
  if (low != high) AddBox(low, high, &mesh);
  return *Surface::Prepare(std::move(mesh));
}

ToolCylinder Tool(double length_mm = 30, const Eigen::Vector3d& start_mm = Eigen::Vector3d::Zero(),
                  const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ()) {
  return {"G1/H1", start_mm, axis.normalized(), Eigen::Vector3d::UnitZ(), kRadius, length_mm};
}

GateCheck Check(const std::vector<ToolCylinder>& tools, const Surface& surface) {
  const auto check = CheckToolCylinders(tools, surface, kClearance, nullptr);
  EXPECT_TRUE(check.ok()) << check.status();
  return *check;
}

TEST(ToolCylinder, APlaneIsTheHolesOwnMouth) {
  const auto plate = Plate();
  const GateCheck check = Check({Tool()}, *plate);
  EXPECT_TRUE(check.passed()) << TextOf(check);
  EXPECT_NEAR(*check.value, kOverPlane, kExact);
  EXPECT_EQ(check.limit, kClearance);
  // Inclined by 60 deg it leaves its mouth twice as far up, and is as far from the plane there.
  const ToolCylinder inclined = Tool(30, Eigen::Vector3d::Zero(), {std::sqrt(3.0), 0, 1});
  EXPECT_NEAR(MouthHeight_mm(inclined, kClearance), 2 * kMouth, kExact);
  EXPECT_NEAR(*Check({inclined}, *plate).value, kOverPlane, kExact);
}

// A wall of 10 mm, so far from the axis.
TEST(ToolCylinder, AWallBesideItIsAsFarAsItStands) {
  for (const double wall_mm : {1.2, 1.0, 0.95, 0.85, 0.5}) {
    const auto step = Plate({wall_mm, -20, -1}, {wall_mm + 5, 20, 10});
    const GateCheck check = Check({Tool()}, *step);
    EXPECT_NEAR(*check.value, std::min(wall_mm - kRadius, kOverPlane), kExact) << wall_mm;
    EXPECT_EQ(check.passed(), wall_mm - kRadius >= kClearance) << wall_mm;
    EXPECT_EQ(check.failed_count, check.passed() ? 0 : 1);
  }
}

TEST(ToolCylinder, NamesTheWorstOfMany) {
  const auto step = Plate({5, -20, -1}, {10, 20, 10});
  std::vector<ToolCylinder> tools = {Tool(), Tool(30, {4.2, 0, 0}), Tool(30, {4.4, 1, 0})};
  tools[1].hole = "G1/H2";
  tools[2].hole = "G1/H3";
  EXPECT_EQ(TextOf(Check(tools, *step)), "TOOL_CYLINDER of G1/H3: 0.2 mm, want at least 0.5 mm; 2 do not pass");
}

// Something hangs over it from 10 mm on: a short electrode ends below it.
TEST(ToolCylinder, ShortOnesEndBelowWhatIsAbove) {
  const auto under = Plate({-3, -3, 10}, {3, 3, 12});
  EXPECT_FALSE(Check({Tool(30)}, *under).passed());
  EXPECT_FALSE(Check({Tool(9.5)}, *under).passed());
  EXPECT_LT(*Check({Tool(9.5)}, *under).value,
            kClearance);  // the first place that is too near, on the way to 0.5 mm below
  EXPECT_TRUE(Check({Tool(9.0)}, *under).passed());
  EXPECT_NEAR(*Check({Tool(9.0)}, *under).value, 1.0 - kRadius, kExact);
}

// One that ends in its mouth, and one whose surface is said to look into the part: its mouth would hide a wall.
TEST(ToolCylinder, WhatCannotBeToldDoesNotPass) {
  const auto plate = Plate();
  const GateCheck inside = Check({Tool(kMouth)}, *plate);
  EXPECT_EQ(inside.failed_count, 1);
  EXPECT_EQ(*inside.value, 0);
  EXPECT_TRUE(Check({Tool(kMouth + 0.01)}, *plate).passed());
  ToolCylinder inward = Tool();
  inward.normal_in_part *= -1;
  EXPECT_EQ(Check({Tool(), inward}, *plate).failed_count, 1);
}

// Half a millimetre from the plate's rim, inclined over it: the edge is nearest where it leaves its mouth.
TEST(ToolCylinder, ATiltedHoleNearAnEdgeLooksBackAtTheEdge) {
  const auto plate = Plate();
  const ToolCylinder tool = Tool(30, {19.5, 0, 0}, {std::sqrt(3.0), 0, 1});
  const double beyond_mm = 2 * kMouth * std::sqrt(3.0) / 2 - 0.5;
  EXPECT_NEAR(*Check({tool}, *plate).value, std::hypot(beyond_mm, kMouth) - kRadius, kExact);
  // The same hole where a wall of 3 mm stands behind the rim, 4 mm on: through it.
  const auto walled = Plate({23.5, -20, -5}, {25, 20, 3});
  EXPECT_FALSE(Check({tool}, *walled).passed());
}

TEST(ToolCylinder, ALowStepIsFoundByTheDistanceOfItsEdge) {
  const double wall_mm = 0.7, height_mm = 1.0;  // ends below where the tool leaves its mouth
  const auto step = Plate({wall_mm, -20, -1}, {wall_mm + 5, 20, height_mm});
  EXPECT_NEAR(*Check({Tool()}, *step).value, std::hypot(wall_mm, kMouth - height_mm) - kRadius, kExact);
}

TEST(ToolCylinder, WithoutToolsNobodyCanTellAndWhoGoesAwayEndsIt) {
  const auto plate = Plate();
  EXPECT_FALSE(Check({}, *plate).passed());
  EXPECT_FALSE(Check({}, *plate).value.has_value());
  EXPECT_TRUE(absl::IsCancelled(CheckToolCylinders({Tool()}, *plate, kClearance, [] { return false; }).status()));
}

}  // namespace
}  // namespace sixpoint::metrology
