#include "tests/metrology/inspection/pin_rows.h"

#include <cmath>
#include <cstdio>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

constexpr int kRowHoles = 10;
constexpr double kSlack_mm = 3e-4, kSlack_rad = 5e-5;
constexpr double kOther_mm = 0.015;  // a pin that is another by so much is no gauge pin

// Against its hole's wall at the mouth and at its foot: anywhere, along one line of it, or across.
void Lean(double half_play_mm, double depth_mm, std::mt19937_64* random, SimulatedPin* pin) {
  std::uniform_real_distribution<double> round(0, 2 * M_PI), uniform(0, 1);
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(pin->axis);
  const auto touching = [&](double angle) {
    return Eigen::Vector3d(across * (half_play_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  };
  const double at_mouth = round(*random), how = uniform(*random);
  const double at_foot = how < 0.4 ? round(*random) : how < 0.7 ? at_mouth : at_mouth + M_PI;
  const Eigen::Vector3d mouth = touching(at_mouth), foot = touching(at_foot);
  pin->start_mm += mouth;
  pin->axis = (pin->axis + (mouth - foot) / depth_mm).normalized();
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

std::string Text(const char* format, double one, double other, double third) {
  char text[160];
  std::snprintf(text, sizeof text, format, one, other, third);
  return text;
}

// Why what is said of a hole is wrong; nothing where it is not.
std::string WrongAbout(const InspectedHole& hole, const SimulatedPin& bore, const HoleFinding& found, bool play_known) {
  const double position_mm = (bore.start_mm - hole.pin.start_mm).norm();
  const double inclination_rad = std::acos(std::min(1.0, bore.axis.dot(hole.pin.axis)));
  // A verdict is wrong where the value that it rests on is: beyond half of U and a little on the wrong side.
  const double over_mm = 0.5 * found.position_expanded_uncertainty_mm + kSlack_mm;
  const double over_rad = 0.5 * found.inclination_expanded_uncertainty_rad + kSlack_rad;
  const bool bad =
      position_mm > hole.position_tolerance_mm + over_mm || inclination_rad > hole.inclination_tolerance_rad + over_rad;
  const bool good = position_mm <= hole.position_tolerance_mm - over_mm &&
                    inclination_rad <= hole.inclination_tolerance_rad - over_rad;
  if (found.verdict == Verdict::kConform && bad)
    return Text("CONFORM, and %.4f mm, %.3f deg off, U %.4f mm", position_mm, inclination_rad / kRadPerDeg,
                found.position_expanded_uncertainty_mm);
  if (found.verdict == Verdict::kNotConform && good)
    return Text("NOT_CONFORM, and %.4f mm, %.3f deg off, U %.4f mm", position_mm, inclination_rad / kRadPerDeg,
                found.position_expanded_uncertainty_mm);
  const double off_mm = (found.error.start_in_part_mm - bore.start_mm).norm();
  if (play_known && off_mm > 2e-3 + 1.5 * found.position_expanded_uncertainty_mm)
    return Text("%.4f mm from where it is said to be, U %.4f mm, pin of %.4f mm", off_mm,
                found.position_expanded_uncertainty_mm, 2 * found.pin_radius_mm);
  return "";
}

}  // namespace

StandingPins PutPins(const PinRow& row, std::mt19937_64* random) {
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  StandingPins standing;
  standing.play_known = row.calibrated || row.oversize_share == 0;
  const double drilled_mm = row.hole_diameter_mm * (1 + row.oversize_share);
  const double pitch_mm = row.pitch_over_diameter * row.hole_diameter_mm;
  const double pin_mm = row.hole_diameter_mm * (1 - row.play_share);
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, 0.2, 1).normalized();
  for (int i = 0; i < kRowHoles; ++i) {
    InspectedHole hole;
    hole.name = "H" + std::to_string(i + 1);
    hole.pin = {
        {(i - kRowHoles / 2) * pitch_mm, 0, 0}, axis, Eigen::Vector3d::UnitZ(), row.hole_diameter_mm, kHoleDepth_mm};
    if (row.calibrated) hole.pin.gauge = GaugePin{pin_mm, kGaugeUncertainty_mm, drilled_mm - pin_mm, row.depth_mm};
    hole.position_tolerance_mm = 0.03;
    hole.inclination_tolerance_rad = 0.5 * kRadPerDeg;
    SimulatedPin bore;
    bore.start_mm = hole.pin.start_mm + 0.012 * Eigen::Vector3d(normal(*random), normal(*random), 0);
    bore.axis = (axis + TangentBasis(axis) * (2e-3 * Eigen::Vector2d(normal(*random), normal(*random)))).normalized();
    bore.radius_mm = drilled_mm / 2;
    standing.holes.push_back(hole);
    standing.bores.push_back(bore);
    const bool there = uniform(*random) >= row.missing_share;
    standing.pin_of.push_back(there ? static_cast<int>(standing.pins.size()) : -1);
    if (!there) continue;
    SimulatedPin pin = bore;
    const bool strange = uniform(*random) < row.stranger_share;
    const double diameter_mm = strange ? pin_mm * (1 - 0.2 * uniform(*random))
                                       : std::min(drilled_mm, pin_mm + kGaugeUncertainty_mm * normal(*random));
    pin.radius_mm = diameter_mm / 2;
    pin.length_mm = 2.5;
    pin.noise_mm = 0;  // put in by the sensor
    Lean((drilled_mm - diameter_mm) / 2, row.depth_mm, random, &pin);
    standing.pins.push_back(pin);
    standing.strange.push_back(strange);
  }
  return standing;
}

absl::StatusOr<BladeFindings> InspectRow(const PinRow& row, const StandingPins& standing, std::mt19937_64* random) {
  PinnedBlock plant = MakePinnedBlock();
  plant.holes = standing.holes;
  plant.pins = standing.pins;
  plant.b_deg = {-60, -35, -10, 15, 40, 60};
  std::uniform_real_distribution<double> anywhere(-14, 14), near(-0.45, 0.45);
  BladeInspection inspection(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, {});
  for (const double b_deg : plant.b_deg) {
    const Eigen::Matrix3d part_from_machine =
        (plant.axes.MachineFromZero(0, b_deg * kRadPerDeg).linear() * plant.pose.zero_from_part.linear()).transpose();
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
    if (absl::Status status = inspection.Add(Scanned(plant, b_deg, points, random)); !status.ok()) return status;
  }
  return inspection.Finish();
}

void PinTally::Add(const PinTally& other) {
  standing += other.standing;
  measured += other.measured;
  strange += other.strange;
  inside += other.inside;
  wrong += other.wrong;
  claims.insert(claims.end(), other.claims.begin(), other.claims.end());
}

PinTally JudgeRow(const StandingPins& standing, const BladeFindings& findings) {
  PinTally tally;
  for (std::size_t i = 0; i < standing.holes.size(); ++i) {
    const HoleFinding& found = findings.holes.at(i);
    const bool there = standing.pin_of[i] >= 0, measured = found.verdict != Verdict::kNotMeasured;
    const bool strange = there && standing.strange[static_cast<std::size_t>(standing.pin_of[i])];
    tally.standing += there && !strange;
    tally.strange += strange;
    if (!measured) continue;
    tally.measured += there && !strange;
    const double error_mm = (standing.bores[i].start_mm - standing.holes[i].pin.start_mm).norm();
    tally.inside +=
        there && !strange && std::abs(found.error.position_mm - error_mm) <= found.position_expanded_uncertainty_mm;
    std::string why = there ? WrongAbout(standing.holes[i], standing.bores[i], found, standing.play_known)
                            : Text("no pin, and %.4f mm off, %.0f points, pin of %.4f mm", found.error.position_mm,
                                   found.point_count, 2 * found.pin_radius_mm);
    if (why.empty() && strange && standing.holes[i].pin.gauge &&
        std::abs(2 * found.pin_radius_mm - standing.holes[i].pin.gauge->diameter_mm) > kOther_mm)
      why = Text("a pin of %.4f mm is taken for the gauge pin of %.4f mm, U %.4f mm", 2 * found.pin_radius_mm,
                 standing.holes[i].pin.gauge->diameter_mm, found.position_expanded_uncertainty_mm);
    if (why.empty()) continue;
    ++tally.wrong;
    tally.claims.push_back(standing.holes[i].name + ": " + why);
  }
  return tally;
}

}  // namespace sixpoint::metrology
