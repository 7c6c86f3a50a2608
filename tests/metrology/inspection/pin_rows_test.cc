// Rows of thin pins that stand close: none is taken for its neighbour's, and what beside a hole is no pin spoils none.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::metrology {
namespace {

constexpr double kRad = M_PI / 180;
constexpr int kHoles = 10;

struct Row {
  double diameter_mm = 0.3, pitch_over_diameter = 2;
  double missing_share = 0.1;
  double proud_mm = 0;  // of the casting, round each hole
};

struct Standing {
  std::vector<InspectedHole> holes;
  std::vector<SimulatedPin> pins;
  std::vector<bool> there;  // of each hole, whether its pin stands
};

Standing RowOf(const Row& row, std::mt19937_64* random) {
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  Standing standing;
  const double pitch_mm = row.pitch_over_diameter * row.diameter_mm;
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, 0.2, 1).normalized();
  for (int i = 0; i < kHoles; ++i) {
    InspectedHole hole;
    hole.name = "H" + std::to_string(i + 1);
    hole.pin = {{(i - kHoles / 2) * pitch_mm, 0, 0}, axis, Eigen::Vector3d::UnitZ(), row.diameter_mm};
    hole.position_tolerance_mm = 0.03;
    hole.inclination_tolerance_rad = 0.5 * kRad;
    SimulatedPin pin;
    pin.start_mm = hole.pin.start_mm + 0.012 * Eigen::Vector3d(normal(*random), normal(*random), 0);
    pin.axis = (axis + TangentBasis(axis) * (2e-3 * Eigen::Vector2d(normal(*random), normal(*random)))).normalized();
    pin.radius_mm = row.diameter_mm / 2;
    pin.length_mm = 2.5;
    pin.noise_mm = 0;  // put in by the sensor
    standing.holes.push_back(hole);
    standing.there.push_back(uniform(*random) >= row.missing_share);
    if (standing.there.back()) standing.pins.push_back(pin);
  }
  return standing;
}

// Whether another pin stands between the point and the scanner.
bool Hidden(const Eigen::Vector3d& point, const Eigen::Vector3d& view, const std::vector<SimulatedPin>& pins,
            std::size_t own) {
  for (std::size_t i = 0; i < pins.size(); ++i) {
    if (i == own) continue;
    const Eigen::Vector3d across = view.cross(pins[i].axis);
    const Eigen::Vector3d to = pins[i].start_mm - point;
    if (std::abs(to.dot(across.normalized())) >= pins[i].radius_mm) continue;
    // Where the ray towards the scanner passes the axis.
    const Eigen::Vector3d normal = pins[i].axis.cross(across);
    const double along = to.dot(normal) / -view.dot(normal);
    const double height = (point - along * view - pins[i].start_mm).dot(pins[i].axis);
    if (along > 0 && height > 0 && height < pins[i].length_mm) return true;
  }
  return false;
}

BladeFindings Inspected(const Row& row, const Standing& standing, std::mt19937_64* random) {
  PinnedBlock plant = MakePinnedBlock();
  plant.holes = standing.holes;
  plant.pins = standing.pins;
  plant.b_deg = {-60, -35, -10, 15, 40, 60};
  std::uniform_real_distribution<double> anywhere(-14, 14), near(-0.45, 0.45);
  InspectionOptions options;
  BladeInspection inspection(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, options);
  for (const double b_deg : plant.b_deg) {
    const Eigen::Matrix3d part_from_machine =
        (plant.axes.MachineFromZero(0, b_deg * kRad).linear() * plant.pose.zero_from_part.linear()).transpose();
    const Eigen::Vector3d view = -(part_from_machine * Eigen::Vector3d::UnitZ());
    Points points;
    for (int i = 0; i < 300; ++i) points.emplace_back(anywhere(*random), anywhere(*random), 0.0);
    if (row.proud_mm > 0)
      for (const InspectedHole& hole : standing.holes)
        for (int i = 0; i < 150; ++i)
          points.push_back(hole.pin.start_mm + Eigen::Vector3d(near(*random), near(*random), row.proud_mm));
    for (std::size_t i = 0; i < plant.pins.size(); ++i)
      for (const Eigen::Vector3d& point : SeenFrom(plant.pins[i], {view}, 250, random))
        if (!Hidden(point, view, plant.pins, i)) points.push_back(point);
    EXPECT_TRUE(inspection.Add(Scanned(plant, b_deg, points, random)).ok());
  }
  const auto findings = inspection.Finish();
  EXPECT_TRUE(findings.ok()) << findings.status();
  return findings.ok() ? *findings : BladeFindings();
}

struct Tally {
  int standing = 0, measured = 0, wrong = 0;
};

// Wrong: measured where nothing stands, or beyond three times what is stated.
void Count(const Standing& standing, const BladeFindings& findings, Tally* tally) {
  ASSERT_EQ(findings.holes.size(), standing.holes.size());
  std::size_t pin = 0;
  for (std::size_t i = 0; i < standing.holes.size(); ++i) {
    const HoleFinding& found = findings.holes[i];
    const bool measured = found.verdict != Verdict::kNotMeasured;
    tally->standing += standing.there[i];
    if (measured && !standing.there[i]) {
      ++tally->wrong;
      ADD_FAILURE() << standing.holes[i].name << " has no pin, and is measured " << found.error.position_mm;
    }
    if (!standing.there[i]) continue;
    const SimulatedPin& truth = standing.pins[pin++];
    if (!measured) continue;
    ++tally->measured;
    const double off_mm = (found.error.start_in_part_mm - truth.start_mm).norm();
    if (off_mm > 0.002 + 1.5 * found.position_expanded_uncertainty_mm) {
      ++tally->wrong;
      ADD_FAILURE() << standing.holes[i].name << " is off by " << off_mm << ", U "
                    << found.position_expanded_uncertainty_mm;
    }
  }
}

TEST(PinRows, NoneIsTakenForItsNeighbours) {
  for (const double diameter_mm : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    Tally tally;
    for (const double pitch : {2.0, 2.5, 3.0}) {
      for (int seed = 0; seed < 4; ++seed) {
        std::mt19937_64 random(static_cast<std::uint64_t>(1000 * diameter_mm + 100 * pitch + seed));
        Row row;
        row.diameter_mm = diameter_mm;
        row.pitch_over_diameter = pitch;
        const Standing standing = RowOf(row, &random);
        Count(standing, Inspected(row, standing, &random), &tally);
      }
    }
    std::printf("d %.1f mm: %d of %d pins measured, %d wrong\n", diameter_mm, tally.measured, tally.standing,
                tally.wrong);
    EXPECT_EQ(tally.wrong, 0);
    EXPECT_GE(tally.measured, tally.standing * 8 / 10) << diameter_mm;
  }
}

// A casting proud by more than the first clearance beside each hole: no pin is measured wrongly, and most are measured.
TEST(PinRows, AProudCastingSpoilsNone) {
  for (const double proud_mm : {0.16, 0.25, 0.4}) {
    Tally tally;
    for (int seed = 0; seed < 4; ++seed) {
      std::mt19937_64 random(static_cast<std::uint64_t>(7 + seed));
      Row row;
      row.diameter_mm = 0.4;
      row.pitch_over_diameter = 3;
      row.missing_share = 0.1;
      row.proud_mm = proud_mm;
      const Standing standing = RowOf(row, &random);
      Count(standing, Inspected(row, standing, &random), &tally);
    }
    EXPECT_EQ(tally.wrong, 0) << proud_mm;
    EXPECT_GE(tally.measured, tally.standing * 9 / 10) << proud_mm;
  }
}

}  // namespace
}  // namespace sixpoint::metrology
