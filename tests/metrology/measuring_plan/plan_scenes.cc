#include "tests/metrology/measuring_plan/plan_scenes.h"

#include <cmath>
#include <cstdlib>
#include <iostream>

namespace sixpoint::metrology {

using Eigen::Vector3d;

JointChain PlanChain(const PlanMachine& machine) {
  const auto rotary = [&](const char* axis, const Vector3d& direction, double limit_deg) {
    Joint joint;
    joint.axis = axis;
    joint.motion = {JointKind::kRotary, {direction, machine.centre_mm}};
    joint.minimum = -limit_deg * kPlanDegree;
    joint.maximum = limit_deg * kPlanDegree;
    return joint;
  };
  const auto linear = [](const char* axis, const Vector3d& direction, double low_mm, double high_mm) {
    Joint joint;
    joint.axis = axis;
    joint.motion = {JointKind::kLinear, {direction, Vector3d::Zero()}};
    joint.minimum = low_mm;
    joint.maximum = high_mm;
    return joint;
  };
  auto chain = JointChain::Make(
      {rotary("A", Vector3d::UnitY(), machine.a_limit_deg), rotary("B", Vector3d::UnitX(), machine.b_limit_deg)},
      {linear("X", Vector3d::UnitX(), -machine.x_mm, machine.x_mm),
       linear("Y", Vector3d::UnitY(), -machine.y_mm, machine.y_mm),
       linear("Z", Vector3d::UnitZ(), machine.z_low_mm, machine.z_high_mm)});
  if (!chain.ok()) std::cerr << chain.status() << "\n", std::abort();
  return *chain;
}

SensorPose TiltedSensor() {
  SensorPose sensor = SensorPose::Exact();
  sensor.rotation = RotationFromCardan({0.4 * kPlanDegree, -0.7 * kPlanDegree, 1.0 * kPlanDegree});
  sensor.t_sm_mm = {15, -42, 85};
  return sensor;
}

ScannerOptics UsualOptics() { return {66, 25, 20 * kPlanDegree}; }
ScannerOptics ParallelOptics() { return {1500, 60, 1 * kPlanDegree}; }

PlanTask TaskOf(const Surface& surface, const PlanMachine& machine) {
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();
  zero_from_part.translation() = machine.centre_mm;
  PlanTask task{surface, zero_from_part, PlanChain(machine), TiltedSensor(), UsualOptics(), {}, {}};
  task.options.body = {{-20, -50, 66}, {20, 50, 150}};
  task.options.threads = 2;
  return task;
}

TriangleMesh SheetMesh(double x_mm, double y_mm, int pieces) {
  TriangleMesh mesh;
  for (int j = 0; j <= pieces; ++j)
    for (int i = 0; i <= pieces; ++i)
      mesh.vertices_mm.emplace_back(x_mm * (1.0 * i / pieces - 0.5), y_mm * (1.0 * j / pieces - 0.5), 0);
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (pieces + 1) + i); };
  for (int j = 0; j < pieces; ++j)
    for (int i = 0; i < pieces; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

void AddBoxMesh(const Vector3d& low, const Vector3d& high, bool inside_out, TriangleMesh* mesh) {
  const auto first = static_cast<std::uint32_t>(mesh->vertices_mm.size());
  for (int i = 0; i < 8; ++i)
    mesh->vertices_mm.emplace_back(((i & 1) != 0 ? high : low).x(), ((i & 2) != 0 ? high : low).y(),
                                   ((i & 4) != 0 ? high : low).z());
  const std::uint32_t faces[12][3] = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& face : faces)
    mesh->triangles.push_back({first + face[0], first + face[inside_out ? 2 : 1], first + face[inside_out ? 1 : 2]});
  mesh->closed = true;
}

TriangleMesh SphereMesh(double radius_mm, int rings) {
  TriangleMesh mesh;
  mesh.closed = true;
  const int columns = 2 * rings;
  mesh.vertices_mm.emplace_back(0, 0, radius_mm);
  for (int r = 1; r < rings; ++r)
    for (int c = 0; c < columns; ++c) {
      const double polar = 180 * kPlanDegree * r / rings, turn = 360 * kPlanDegree * c / columns;
      mesh.vertices_mm.emplace_back(radius_mm * std::sin(polar) * std::cos(turn),
                                    radius_mm * std::sin(polar) * std::sin(turn), radius_mm * std::cos(polar));
    }
  mesh.vertices_mm.emplace_back(0, 0, -radius_mm);
  const auto last = static_cast<std::uint32_t>(mesh.vertices_mm.size() - 1);
  const auto at = [&](int r, int c) { return static_cast<std::uint32_t>(1 + (r - 1) * columns + c % columns); };
  for (int c = 0; c < columns; ++c) {
    mesh.triangles.push_back({0, at(1, c), at(1, c + 1)});
    mesh.triangles.push_back({last, at(rings - 1, c + 1), at(rings - 1, c)});
  }
  for (int r = 1; r + 1 < rings; ++r)
    for (int c = 0; c < columns; ++c) {
      mesh.triangles.push_back({at(r, c), at(r + 1, c), at(r + 1, c + 1)});
      mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r, c + 1)});
    }
  return mesh;
}

TriangleMesh CylinderMesh(double radius_mm, double length_mm, int columns) {
  TriangleMesh mesh;
  mesh.closed = true;
  const auto count = static_cast<std::uint32_t>(columns);
  for (const double x_mm : {-length_mm / 2, length_mm / 2})
    for (std::uint32_t c = 0; c < count; ++c) {
      const double turn = 360 * kPlanDegree * c / columns;
      mesh.vertices_mm.emplace_back(x_mm, radius_mm * std::cos(turn), radius_mm * std::sin(turn));
    }
  mesh.vertices_mm.emplace_back(-length_mm / 2, 0, 0);
  mesh.vertices_mm.emplace_back(length_mm / 2, 0, 0);
  for (std::uint32_t c = 0; c < count; ++c) {
    const std::uint32_t next = (c + 1) % count;
    mesh.triangles.push_back({c, count + next, count + c});
    mesh.triangles.push_back({c, next, count + next});
    mesh.triangles.push_back({2 * count, next, c});
    mesh.triangles.push_back({2 * count + 1, count + c, count + next});
  }
  return mesh;
}

std::shared_ptr<const Surface> SurfaceOf(TriangleMesh mesh) {
  auto surface = Surface::Prepare(std::move(mesh));
  if (!surface.ok()) std::cerr << surface.status() << "\n", std::abort();
  return *surface;
}

}  // namespace sixpoint::metrology
