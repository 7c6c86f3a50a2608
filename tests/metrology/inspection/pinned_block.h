// A block with pins in its top, on a machine with a mis-mounted scanner and axes that do not meet.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "tests/metrology/correction/exact_pose.h"
#include "tests/metrology/inspection/simulated_pin.h"

namespace sixpoint::metrology {

inline constexpr double kHoleDepth_mm = 6;
inline constexpr double kGaugeUncertainty_mm = 5e-4;  // standard, of a pin's diameter

// 30 x 30 x 10 mm, its top the plane z = 0 of the part.
TriangleMesh BlockMesh();

// A machine with a turned sensor and axes that do not meet; the block stands on it, a pin in each of two holes.
struct PinnedBlock {
  SensorPose sensor = SensorPose::Exact();
  RotaryAxes axes;
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  std::vector<InspectedHole> holes;
  std::vector<SimulatedPin> pins;
  std::vector<double> b_deg = {-60, -20, 20, 60};
  std::shared_ptr<const Surface> surface;
};

// The first hole is within tolerance, the second is not.
PinnedBlock MakePinnedBlock();

// Part points as the sensor reads them at a pose of the axes; noise along the sensor's z.
LineScan Scanned(const PinnedBlock& plant, double b_deg, const Points& in_part, std::mt19937_64* random);

// One scan from each B: top_count points of the top, 5 um too high, 250 of each pin, 5 chips.
std::vector<LineScan> ScansOf(const PinnedBlock& plant, std::mt19937_64* random, int top_count);

}  // namespace sixpoint::metrology
