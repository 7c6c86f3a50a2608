#include "metrology/measuring_plan/sensor_body.h"

#include <gtest/gtest.h>

#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

SensorBody House() { return {{-10, -30, 50}, {20, 40, 120}}; }
const Eigen::Matrix3d kUpright = Eigen::Matrix3d::Identity();

// Nearer to the limit than 0.4 mm it may count as too near: the halving of a face of 30 x 70 mm ends.
TEST(SensorBody, StandsOverAPlaneAsHighAsItsLowerFace) {
  const auto plane = SurfaceOf(SheetMesh(500, 500, 4));
  for (const double height_mm : {0.0, -20.0, -40.0}) {
    const Eigen::Vector3d origin_mm(3, 5, height_mm);
    const TurnedBox box = SweptBody(House(), kUpright, origin_mm, origin_mm);
    EXPECT_TRUE(IsClear(box, *plane, 50 + height_mm - 0.4)) << height_mm;
    EXPECT_FALSE(IsClear(box, *plane, 50 + height_mm + 0.01)) << height_mm;
  }
}

TEST(SensorBody, IsInTheWayWhereverASweepTakesIt) {
  TriangleMesh mesh;
  AddBoxMesh({100, -5, -5}, {110, 5, 60}, false, &mesh);  // a post beside the sweep's end
  const auto post = SurfaceOf(mesh);
  const Eigen::Vector3d from_mm(0, 0, 0);
  // The body's side reaches 20 mm ahead of its origin.
  EXPECT_TRUE(IsClear(SweptBody(House(), kUpright, from_mm, {70, 0, 0}), *post, 9.9));
  EXPECT_FALSE(IsClear(SweptBody(House(), kUpright, from_mm, {70, 0, 0}), *post, 10.1));
  EXPECT_FALSE(IsClear(SweptBody(House(), kUpright, from_mm, {200, 0, 0}), *post, 0.1));
  // Over the post it does not matter how far it goes.
  EXPECT_TRUE(IsClear(SweptBody(House(), kUpright, {0, 0, 20}, {200, 0, 20}), *post, 9.9));
}

TEST(SensorBody, WithinAClosedPartIsNotClearOfIt) {
  TriangleMesh mesh;
  AddBoxMesh({-500, -500, -500}, {500, 500, 500}, false, &mesh);
  const auto block = SurfaceOf(mesh);
  EXPECT_FALSE(IsClear(SweptBody(House(), kUpright, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()), *block, 1));
}

// What is passed by rapid is any place between the ends; by a sweep only the straight line.
TEST(SensorBody, GoesByRapidAnywhereBetweenTheEnds) {
  TriangleMesh mesh;
  AddBoxMesh({95, -5, 50}, {105, 5, 120}, false, &mesh);
  const auto post = SurfaceOf(mesh);
  const Eigen::Vector3d from_mm(0, 0, 0), to_mm(100, 100, 0);
  EXPECT_FALSE(IsClear(BodyBetween(House(), kUpright, from_mm, to_mm), *post, 1));
  EXPECT_FALSE(IsClear(BodyBetween(House(), kUpright, to_mm, from_mm), *post, 1));
  EXPECT_TRUE(IsClear(BodyBetween(House(), kUpright, from_mm, {40, 100, 0}), *post, 1));
}

// However the sensor is turned, the box holds every place of the body on the way.
TEST(SensorBody, BoxesHoldEveryPlaceOfTheBody) {
  const Eigen::Matrix3d axes = TiltedSensor().rotation * RotationFromVector({0.3, -0.5, 1.1});
  const Eigen::Vector3d from_mm(10, -20, 5), to_mm(70, 35, -25);
  const SensorBody body = House();
  for (const bool rapid : {false, true}) {
    const TurnedBox box = rapid ? BodyBetween(body, axes, from_mm, to_mm) : SweptBody(body, axes, from_mm, to_mm);
    for (int corner = 0; corner < 8; ++corner)
      for (int way = 0; way < 64; ++way) {
        const Eigen::Vector3d in_body((corner & 1) != 0 ? body.high_mm.x() : body.low_mm.x(),
                                      (corner & 2) != 0 ? body.high_mm.y() : body.low_mm.y(),
                                      (corner & 4) != 0 ? body.high_mm.z() : body.low_mm.z());
        const Eigen::Vector3d share = rapid ? Eigen::Vector3d(way % 4 / 3.0, way / 4 % 4 / 3.0, way / 16 / 3.0)
                                            : Eigen::Vector3d(way / 63.0, way / 63.0, way / 63.0);
        const Eigen::Vector3d place = from_mm + share.cwiseProduct(to_mm - from_mm) + axes * in_body - box.centre_mm;
        const Eigen::Vector3d along = (box.axes.transpose() * place).cwiseAbs();
        EXPECT_TRUE((along.array() <= box.half_mm.array() + 1e-9).all());
      }
  }
}

}  // namespace
}  // namespace sixpoint::metrology
