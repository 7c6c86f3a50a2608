#include "metrology/scanner/line_scanner.h"

#include <gtest/gtest.h>

namespace sixpoint::metrology {
namespace {

SensorPose MisMounted() {
  SensorPose sensor = SensorPose::Exact();
  sensor.rotation = RotationFromCardan({0.002, 0.008, 0.005});
  sensor.t_sm_mm = Eigen::Vector3d(14.8, -41.7, 85.4);
  return sensor;
}

TEST(LineScanner, EncoderMovesAlongMachineXHoweverTheSensorIsTurned) {
  const SensorPose sensor = MisMounted();
  const Eigen::Vector3d step =
      sensor.MachineFromSensor({7, 1, 2}, {3, 4, 5}) - sensor.MachineFromSensor({0, 1, 2}, {3, 4, 5});
  EXPECT_LT((step - Eigen::Vector3d(7, 0, 0)).norm(), 1e-13);
}

TEST(LineScanner, MatchesTheRuleOfThePaperPointByPoint) {
  // CONF 12: P_m = R_sm (P_s - V_si) - V0 + V_si + T_sm, V_si = (x, 0, 0).
  const SensorPose sensor = MisMounted();
  const Eigen::Vector3d p(3, -4, 5), v_si(3, 0, 0), v0(-60, -87, 269);
  EXPECT_LT((sensor.MachineFromSensor(p, v0) - (sensor.rotation * (p - v_si) - v0 + v_si + sensor.t_sm_mm)).norm(),
            1e-12);
}

TEST(LineScanner, ParameterJacobianIsTheDerivative) {
  const SensorPose sensor = MisMounted();
  const Eigen::Vector3d p(3, -4, 5);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d w = kStep * Vector6d::Unit(k);
    SensorPose plus = sensor, minus = sensor;
    plus.rotation = RotationFromVector(w.head<3>()) * sensor.rotation;
    minus.rotation = RotationFromVector(-w.head<3>()) * sensor.rotation;
    plus.t_sm_mm += w.tail<3>();
    minus.t_sm_mm -= w.tail<3>();
    const Eigen::Vector3d slope =
        (plus.MachineFromSensor(p, Eigen::Vector3d::Zero()) - minus.MachineFromSensor(p, Eigen::Vector3d::Zero())) /
        (2 * kStep);
    EXPECT_LT((slope - sensor.ParameterJacobian(p).col(k)).norm(), 1e-7);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
