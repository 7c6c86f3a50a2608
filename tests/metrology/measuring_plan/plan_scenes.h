// Machines and parts to plan on.
#pragma once

#include <memory>

#include "metrology/measuring_plan/measuring_plan.h"

namespace sixpoint::metrology {

inline constexpr double kPlanDegree = 3.14159265358979323846 / 180;
// Of 10,000 systematic samples or more a share is true within far less than a half by the root of 10,000; the rest is what the
// facets of a mesh take from a round surface.
inline constexpr double kShare = 0.005;

// The SARIX's: A about Y on the bed carries B about X, both through the centre; the scanner on X, Y, Z.
struct PlanMachine {
  Eigen::Vector3d centre_mm{20, 50, -190};
  double a_limit_deg = 100, b_limit_deg = 360;
  double x_mm = 350, y_mm = 250, z_low_mm = -400, z_high_mm = 400;
};
JointChain PlanChain(const PlanMachine& machine = {});

// Mounted turned by a degree or less; a field of 25 mm at 66 mm.
SensorPose TiltedSensor();
ScannerOptics UsualOptics();
// Rays that are parallel within half a degree: closed forms hold for them.
ScannerOptics ParallelOptics();

// The part's frame stands at the centre, its axes the machine's.
PlanTask TaskOf(const Surface& surface, const PlanMachine& machine = {});

// Outward, closed where they say so.
TriangleMesh SheetMesh(double x_mm, double y_mm, int pieces);  // about the origin, looking to +z; open
void AddBoxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high, bool inside_out, TriangleMesh* mesh);
TriangleMesh SphereMesh(double radius_mm, int rings);
TriangleMesh CylinderMesh(double radius_mm, double length_mm, int columns);  // about the x axis, closed
std::shared_ptr<const Surface> SurfaceOf(TriangleMesh mesh);

}  // namespace sixpoint::metrology
