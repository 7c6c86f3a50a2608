#include "simulator/ray_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "simulator/artefact.h"
#include "simulator/blade.h"
#include "simulator/random.h"

namespace sixpoint::simulator {
namespace {

using Eigen::Vector3d;
constexpr double kFar = 1e6;

// Every triangle, one after the other, by plane and inside test: slow and of another kind than the tracer.
double NearestByBruteForce(const metrology::TriangleMesh& mesh, const Ray& ray) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d &p = mesh.vertices_mm[a], &q = mesh.vertices_mm[b], &r = mesh.vertices_mm[c];
    const Vector3d n = (q - p).cross(r - p);
    const double t = n.dot(p - ray.origin_mm) / n.dot(ray.direction);
    const Vector3d x = ray.origin_mm + t * ray.direction;
    const double slack = -1e-9 * n.squaredNorm();
    if (t > 0 && t < best && n.dot((q - p).cross(x - p)) >= slack && n.dot((r - q).cross(x - q)) >= slack &&
        n.dot((p - r).cross(x - r)) >= slack)
      best = t;
  }
  return best;
}

TEST(Sphere, IsHitAtItsNearPoint) {
  const Sphere sphere(Vector3d(1, 2, 3), 2);
  const auto hit = sphere.Intersect({Vector3d(1, 2, 10), -Vector3d::UnitZ()}, kFar);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_mm, 5, 1e-12);
  EXPECT_NEAR((hit->normal - Vector3d::UnitZ()).norm(), 0, 1e-12);
  EXPECT_FALSE(sphere.Intersect({Vector3d(3.1, 2, 10), -Vector3d::UnitZ()}, kFar));
  EXPECT_FALSE(sphere.Intersect({Vector3d(1, 2, 10), -Vector3d::UnitZ()}, 4.9));
}

TEST(Pin, IsHitOnTopAndOnItsSideAndNotBeside) {
  const Pin pin(Vector3d(0, 0, 3), Vector3d::UnitZ(), 0.2, 4);
  const auto top = pin.Intersect({Vector3d(0.1, 0.1, 10), -Vector3d::UnitZ()}, kFar);
  ASSERT_TRUE(top);
  EXPECT_NEAR(top->distance_mm, 7, 1e-12);
  const auto side = pin.Intersect({Vector3d(5, 0.12, 1), -Vector3d::UnitX()}, kFar);
  ASSERT_TRUE(side);
  EXPECT_NEAR(side->distance_mm, 5 - 0.16, 1e-12);  // 0.2^2 = 0.12^2 + 0.16^2
  EXPECT_NEAR((side->normal - Vector3d(0.8, 0.6, 0)).norm(), 0, 1e-12);
  EXPECT_FALSE(pin.Intersect({Vector3d(5, 0.21, 1), -Vector3d::UnitX()}, kFar));
  EXPECT_FALSE(pin.Intersect({Vector3d(5, 0, -1.1), -Vector3d::UnitX()}, kFar));
}

TEST(TriangleShape, FindsTheSameHitsAsBruteForce) {
  AirfoilDesign design;
  design.columns = 40;
  design.rows = 12;
  const metrology::TriangleMesh mesh = Airfoil(design).Mesh();
  const TriangleShape shape(mesh);
  Random random(7);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d origin = 80 * random.GaussianVector().normalized() + Vector3d(0, 0, 22);
    const Vector3d aim = Vector3d(0, 0, 22) + random.UniformVector(14);
    const Ray ray{origin, (aim - origin).normalized()};
    const double expected = NearestByBruteForce(mesh, ray);
    const auto hit = shape.Intersect(ray, kFar);
    ASSERT_EQ(hit.has_value(), std::isfinite(expected)) << i;
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR(hit->distance_mm, expected, 1e-9);
    EXPECT_LT(hit->normal.dot(ray.direction), 0);  // from outside
  }
  EXPECT_GT(hits, 500);
}

TEST(Scene, ReportsTheNearestShapeInMachineCoordinates) {
  Scene scene;
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.linear() = Eigen::AngleAxisd(0.3, Vector3d::UnitX()).toRotationMatrix();
  moved.translation() = Vector3d(10, 20, 30);
  scene.Add(std::make_shared<Sphere>(Vector3d::Zero(), 1), moved);
  scene.Add(std::make_shared<Sphere>(Vector3d(0, 0, 5), 1), moved);
  const Vector3d centre = moved * Vector3d(0, 0, 5), from = centre + Vector3d(0, 0, 50);
  const auto hit = scene.Intersect({from, -Vector3d::UnitZ()}, kFar);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_mm, 49, 1e-12);
  EXPECT_NEAR((hit->normal - Vector3d::UnitZ()).norm(), 0, 1e-12);
}

class ArtefactRays : public ::testing::Test {
 protected:
  // Straight down at (x, y) unless leaned.
  static std::optional<Hit> Down(double x, double y, double lean = 0) {
    static const ArtefactShape shape{ArtefactGeometry{}};
    const Vector3d direction = Vector3d(lean, 0, -1).normalized();
    return shape.Intersect({Vector3d(x, y, 0) - 50 * direction, direction}, kFar);
  }
};

TEST_F(ArtefactRays, MeetTheFaceTheConesAndTheSlots) {
  EXPECT_NEAR(Down(0, 0)->distance_mm, 50, 1e-12);
  // 45 degrees: at radius r the cone lies 2 - r below the face; its floor is 1.5 deep.
  EXPECT_NEAR(Down(3.5 + 1.2, 3.5)->distance_mm, 50.8, 1e-9);
  EXPECT_NEAR((Down(3.5 + 1.2, 3.5)->normal - Vector3d(-1, 0, 1).normalized()).norm(), 0, 1e-9);
  EXPECT_NEAR(Down(-3.5, 0.3)->distance_mm, 51.5, 1e-12);
  EXPECT_NEAR(Down(9.5, -0.5)->distance_mm, 50.8, 1e-12);
  EXPECT_FALSE(Down(12.01, 0));
}

TEST_F(ArtefactRays, MeetTheWallsWhenTheyComeAskew) {
  // Enters the slot Q3 (half width 1.2) 0.1 from its wall: after 0.1 sideways at slope 0.5 it is 0.2 deep.
  const auto wall = Down(9 + 1.1, 0, 0.5);
  ASSERT_TRUE(wall);
  EXPECT_NEAR((wall->distance_mm - 50) / std::hypot(0.5, 1), 0.2, 1e-9);
  EXPECT_NEAR((wall->normal - -Vector3d::UnitX()).norm(), 0, 1e-12);
  // Misses the face but not the side of the plate.
  const auto side = Down(12.2, 0, -0.1);
  ASSERT_TRUE(side);
  EXPECT_NEAR((side->normal - Vector3d::UnitX()).norm(), 0, 1e-12);
}

TEST_F(ArtefactRays, LieOnTheConeForAnyDirection) {
  const ArtefactShape shape{ArtefactGeometry{}};
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Vector3d aim(3.5 + random.Uniform(-1.3, 1.3), -3.5 + random.Uniform(-1.3, 1.3), 0);
    const Vector3d direction = Vector3d(random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), -1).normalized();
    const Vector3d origin = aim - 60 * direction;
    const auto hit = shape.Intersect({origin, direction}, kFar);
    ASSERT_TRUE(hit);
    const Vector3d p = origin + hit->distance_mm * direction;
    const double radius = std::hypot(p.x() - 3.5, p.y() + 3.5);
    const bool on_floor = std::abs(p.z() + 1.5) < 1e-9 && radius <= 0.5 + 1e-9;
    EXPECT_TRUE(on_floor || std::abs(radius - (2 + p.z())) < 1e-9) << p.transpose();
  }
}

}  // namespace
}  // namespace sixpoint::simulator
