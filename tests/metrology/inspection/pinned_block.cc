#include "tests/metrology/inspection/pinned_block.h"

#include <cmath>
#include <string>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {

TriangleMesh BlockMesh() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices_mm.emplace_back(i & 1 ? 15 : -15, i & 2 ? 15 : -15, i & 4 ? 0 : -10);
  mesh.triangles = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh.closed = true;
  return mesh;
}

PinnedBlock MakePinnedBlock() {
  PinnedBlock plant;
  plant.sensor.rotation = RotationFromCardan({0.14 * kRadPerDeg, 0.46 * kRadPerDeg, 0.28 * kRadPerDeg});
  plant.sensor.t_sm_mm = {14.8, -41.7, 20};
  plant.axes.a = {Eigen::Vector3d(1e-4, 1, -2e-4).normalized(), {26.6, 54.9, -193.1}};
  plant.axes.b = {Eigen::Vector3d(1, -1e-4, 3e-4).normalized(), {26.6, 54.87, -193.11}};
  plant.pose.zero_from_part.linear() = RotationFromVector({0.01, -0.02, 0.3});
  plant.pose.zero_from_part.translation() = plant.axes.a.point_mm + Eigen::Vector3d(30, 3, 10);
  plant.pose.noise.reference_mm = plant.pose.zero_from_part.translation();
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, 0.2, 1).normalized();
  for (int i = 0; i < 2; ++i) {
    InspectedHole hole;
    hole.group = "G1";
    hole.name = "H" + std::to_string(i + 1);
    hole.pin = {{6.0 * i - 3, 2, 0}, axis, Eigen::Vector3d::UnitZ(), 0.44, 6};
    hole.pin.gauge = GaugePin{0.44, 1e-5, 0};  // as these are
    hole.position_tolerance_mm = 0.06;
    hole.inclination_tolerance_rad = 0.5 * kRadPerDeg;
    SimulatedPin pin;
    pin.start_mm = hole.pin.start_mm + Eigen::Vector3d(0.02 + 0.06 * i, 0.01, 0);  // the second is out of tolerance
    pin.axis = (axis + TangentBasis(axis) * Eigen::Vector2d(2e-3, -3e-3)).normalized();
    plant.holes.push_back(hole);
    plant.pins.push_back(pin);
  }
  plant.surface = *Surface::Prepare(BlockMesh());
  return plant;
}

LineScan Scanned(const PinnedBlock& plant, double b_deg, const Points& in_part, std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, 2e-3);
  LineScan scan;
  scan.b_rad = b_deg * kRadPerDeg;
  scan.v0_mm = {-60, -87, 264};
  const Eigen::Isometry3d machine_from_part = plant.axes.MachineFromZero(0, scan.b_rad) * plant.pose.zero_from_part;
  Eigen::Matrix3d columns;
  columns << Eigen::Vector3d::UnitX(), plant.sensor.rotation.col(1), plant.sensor.rotation.col(2);
  if (plant.sensor.cloud == CloudKind::kSnapshot) columns = plant.sensor.rotation;
  const Eigen::Matrix3d inverse = columns.inverse();
  for (const Eigen::Vector3d& point : in_part) {
    Eigen::Vector3d in_sensor = inverse * (machine_from_part * point + scan.v0_mm - plant.sensor.t_sm_mm);
    in_sensor.z() += noise(*random);
    scan.points_mm.push_back(in_sensor);
  }
  return scan;
}

std::vector<LineScan> ScansOf(const PinnedBlock& plant, std::mt19937_64* random, int top_count) {
  std::uniform_real_distribution<double> anywhere(-14, 14);
  std::vector<LineScan> scans;
  for (const double b_deg : plant.b_deg) {
    const Eigen::Matrix3d part_from_machine =
        (plant.axes.MachineFromZero(0, b_deg * kRadPerDeg).linear() * plant.pose.zero_from_part.linear()).transpose();
    const Eigen::Vector3d view = -(part_from_machine * Eigen::Vector3d::UnitZ());
    Points points;
    for (int i = 0; i < top_count; ++i) points.emplace_back(anywhere(*random), anywhere(*random), 0.005);
    for (SimulatedPin pin : plant.pins) {
      pin.noise_mm = 0;  // put in by the sensor
      const Points seen = SeenFrom(pin, {view}, 250, random);
      points.insert(points.end(), seen.begin(), seen.end());
    }
    for (int i = 0; i < 5; ++i) points.emplace_back(anywhere(*random), anywhere(*random), 3.0);  // chips
    scans.push_back(Scanned(plant, b_deg, points, random));
  }
  return scans;
}

}  // namespace sixpoint::metrology
