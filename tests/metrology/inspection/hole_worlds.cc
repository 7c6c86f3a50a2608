#include "tests/metrology/inspection/hole_worlds.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr int kWorldHoles = 4, kFreedom = 12, kPointsOfView = 220;
constexpr double kFloor_mm = 1.5;

struct World {
  PinnedBlock truth;
  std::vector<SimulatedPin> holes;                                 // as drilled; radius: of the hole
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());  // as stated
  PinnedBlock estimate;
};

double Normal(std::mt19937_64* random) { return std::normal_distribution<double>(0, 1)(*random); }
double Uniform(std::mt19937_64* random) { return std::uniform_real_distribution<double>(0, 1)(*random); }

void PutHoles(const HoleWorld& wanted, std::mt19937_64* random, World* world) {
  const Vector3d axis = Vector3d(0.3, 0.2, 1).normalized();
  const double nominal_mm = wanted.bores ? 2 : 0.44, pitch_mm = wanted.bores ? 2.2 * wanted.pitch_mm : wanted.pitch_mm;
  world->truth.holes.clear();
  world->truth.pins.clear();
  for (int i = 0; i < kWorldHoles; ++i) {
    InspectedHole hole;
    hole.group = "G1";
    hole.name = "H" + std::to_string(i + 1);
    hole.pin = {{(i - 1.5) * pitch_mm, 0, 0}, axis, Vector3d::UnitZ(), nominal_mm, kHoleDepth_mm};
    hole.position_tolerance_mm = 0.06;
    hole.inclination_tolerance_rad = 0.5 * kRadPerDeg;
    SimulatedPin drilled;
    drilled.start_mm = hole.pin.start_mm + 0.015 * Vector3d(Normal(random), Normal(random), 0);
    drilled.axis = (axis + TangentBasis(axis) * (3e-3 * Eigen::Vector2d(Normal(random), Normal(random)))).normalized();
    drilled.radius_mm = nominal_mm / 2 * (1 + 0.01 * Normal(random));
    drilled.length_mm = 4;
    drilled.noise_mm = 0;  // put in by the sensor
    SimulatedPin pin = drilled;
    if (wanted.play_mm > 0) {
      pin.radius_mm -= wanted.play_mm * Uniform(random) / 2;
      hole.pin.gauge = GaugePin{2 * pin.radius_mm + kGaugeUncertainty_mm * Normal(random), kGaugeUncertainty_mm,
                                wanted.play_mm, kHoleDepth_mm};
      const double half_mm = drilled.radius_mm - pin.radius_mm, at = 2 * M_PI * Uniform(random),
                   below = 2 * M_PI * Uniform(random);
      const auto touching = [&](double angle) {
        return Vector3d(TangentBasis(pin.axis) * (half_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
      };
      const Vector3d mouth = touching(at), foot = touching(below);
      pin.start_mm += mouth;
      // The mouth's point on the surface: the pin leans about it.
      pin.axis = (pin.axis + (mouth - foot) / kHoleDepth_mm).normalized();
      pin.start_mm -= pin.start_mm.z() / pin.axis.z() * pin.axis;
    } else {
      hole.pin.standing = PinStanding{};  // tight
    }
    world->truth.holes.push_back(hole);
    world->truth.pins.push_back(pin);
    world->holes.push_back(drilled);
  }
}

// The scale of a covariance as so many degrees of freedom estimate it.
double EstimatedScale(std::mt19937_64* random) {
  double sum = 0;
  for (int k = 0; k < kFreedom; ++k) sum += std::pow(Normal(random), 2);
  return sum / kFreedom;
}

// Calibrations that err by what they state, and a pose that follows them.
void Estimate(std::mt19937_64* random, World* world) {
  PoseSensitivity sensitivity = PoseSensitivity::Zero();
  CalibrationCovariance covariance = CalibrationCovariance::Zero();
  const auto is_angle = [](int j) { return j < 3 || j == 6 || j == 7 || j == 10 || j == 11; };
  Eigen::Matrix<double, 14, 1> error;
  for (int j = 0; j < 14; ++j) {
    const double sigma = is_angle(j) ? 1e-5 : 6e-4;
    covariance(j, j) = sigma * sigma;
    error[j] = sigma * Normal(random);
    for (int i = 0; i < 6; ++i) sensitivity(i, j) = Normal(random) * (i < 3 ? 0.01 : 0.7) * (is_angle(j) ? 40 : 1);
  }
  RegisteredPose pose = world->truth.pose;
  pose.sources = {SourceOf("calibrations", covariance * EstimatedScale(random))};
  pose.sources[0].degrees_of_freedom = kFreedom;
  ActOnPose(sensitivity, &pose.sources);
  Vector6d noise;
  for (int j = 0; j < 6; ++j) {
    pose.noise.values(j, j) = std::pow(j < 3 ? 5e-6 : 2e-4, 2);
    noise[j] = std::sqrt(pose.noise.values(j, j)) * Normal(random);
  }
  world->estimate = world->truth;
  world->estimate.pose = pose;
  world->estimate.sensor.rotation = RotationFromVector(error.head<3>()) * world->truth.sensor.rotation;
  world->estimate.sensor.t_sm_mm += error.segment<3>(3);
  world->estimate.axes = world->truth.axes.Perturbed(error.tail<8>());
  const Vector6d off = sensitivity.leftCols<14>() * error + noise;
  world->estimate.pose.zero_from_part = Perturbed(world->truth.pose.zero_from_part, off, pose.noise.reference_mm);
}

// Of a bore's wall, and its floor, what a ray along the view reaches through its mouth in the plane z = 0.
Points SeenInside(const HoleWorld& wanted, const SimulatedPin& bore, const Vector3d& view, int count,
                  std::mt19937_64* random) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(bore.axis);
  const Vector3d back = -view;
  const Vector3d back_across = back - back.dot(bore.axis) * bore.axis;
  const double deepest_mm = wanted.floor ? kFloor_mm : kHoleDepth_mm;
  Points points;
  for (int i = 0; i < 60 * count && static_cast<int>(points.size()) < count; ++i) {
    const bool on_floor = wanted.floor && Uniform(random) < 0.3;
    const double angle = 2 * M_PI * Uniform(random), height = on_floor ? -deepest_mm : -deepest_mm * Uniform(random);
    const double away = on_floor ? bore.radius_mm * std::sqrt(Uniform(random)) : bore.radius_mm;
    const Vector3d out = across * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Vector3d point = bore.start_mm + height * bore.axis + away * out;
    // Where the ray meets the wall again, it must be out of the hole.
    const double b = away * out.dot(back_across), a = back_across.squaredNorm();
    const double reach =
        (-b + std::sqrt(std::max(0.0, b * b + a * (bore.radius_mm * bore.radius_mm - away * away)))) / a;
    if (point.z() > -0.02 || !(reach > 0) || (point + reach * back).z() < 0 || back.z() <= 0) continue;
    points.push_back(point);
  }
  return points;
}

// What makes a wall no cylinder.
void Spoil(const HoleWorld& wanted, const SimulatedPin& pin, double phase, Points* points) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(pin.axis);
  for (Vector3d& point : *points) {
    const double height = (point - pin.start_mm).dot(pin.axis);
    const Eigen::Vector2d out = across.transpose() * (point - pin.start_mm);
    const double around = std::atan2(out.y(), out.x());
    if (wanted.waver_mm > 0)
      point +=
          wanted.waver_mm * std::sin(3 * around + phase) * std::cos(2.1 * height + phase) * (across * out.normalized());
    if (wanted.bend_mm > 0)
      point += wanted.bend_mm * std::pow(height / pin.length_mm, 2) *
               (across * Eigen::Vector2d(std::cos(phase), std::sin(phase)));
  }
}

std::vector<LineScan> ScansOfWorld(const HoleWorld& wanted, const World& world, std::mt19937_64* random) {
  std::vector<LineScan> scans;
  std::vector<double> phases;
  for (int i = 0; i < kWorldHoles; ++i) phases.push_back(2 * M_PI * Uniform(random));
  for (const double b_deg :
       wanted.one_side ? std::vector<double>{-60, -35, -10} : std::vector<double>{-60, -30, -10, 10, 30, 60}) {
    const PinnedBlock& truth = world.truth;
    const Eigen::Matrix3d part_from_machine =
        (truth.axes.MachineFromZero(0, b_deg * kRadPerDeg).linear() * truth.pose.zero_from_part.linear()).transpose();
    const Vector3d view = -(part_from_machine * Vector3d::UnitZ());
    Points points;
    for (int i = 0; i < 30; ++i) points.emplace_back(28 * Uniform(random) - 14, 28 * Uniform(random) - 14, 0.0);
    for (int i = 0; i < kWorldHoles; ++i) {
      const SimulatedPin& thing = wanted.bores ? world.holes[i] : truth.pins[i];
      Points seen = wanted.bores ? SeenInside(wanted, thing, view, kPointsOfView, random)
                                 : SeenFrom(thing, {view}, kPointsOfView, random);
      Spoil(wanted, thing, phases[i], &seen);
      for (Vector3d& point : seen) {
        if (wanted.heavy_mm > 0 && Uniform(random) < 0.2) point += wanted.heavy_mm * Normal(random) * view;
        if (Uniform(random) < wanted.outliers) point += (0.6 * Uniform(random) - 0.3) * view;
      }
      const Vector3d& start = truth.holes[i].pin.start_mm;
      for (int k = 0; wanted.casting_mm > 0 && k < 60; ++k) {
        const double x = 1.2 * (Uniform(random) - 0.5), y = 1.2 * (Uniform(random) - 0.5);
        seen.push_back(start + Vector3d(x, y, wanted.casting_mm * std::sin(3 * x + 2 * y + phases[i])));
      }
      if (wanted.chips && i % 2 == 0)
        for (int k = 0; k < 7; ++k)
          seen.push_back(start + (wanted.bores ? Vector3d(0.3, 0.2, -0.5) : Vector3d(0.35, 0.25, 0.5)) +
                         0.1 * Vector3d(Normal(random), Normal(random), Normal(random)));
      points.insert(points.end(), seen.begin(), seen.end());
    }
    scans.push_back(Scanned(truth, b_deg, points, random));
  }
  return scans;
}

// Leaning by so much towards x of the plane z, x; the block's top is z = 0 and the holes are drawn alike.
double LeanOf(const Vector3d& axis, const Vector3d& along) { return std::atan2(axis.dot(along), axis.z()); }

// What a scanner sees otherwise than it is, anywhere within 10 um, hides whether the rest is right: without it.
double AsSeen_mm(const StatedLength& diameter) {
  std::vector<UncertaintyComponent> rest;
  double variance_um2 = 0;
  for (const UncertaintyComponent& component : diameter.budget.components) {
    if (component.source == kSeenOtherwise) continue;
    rest.push_back(component);
    variance_um2 += component.variance;
  }
  return 1.96 * WideningOf(0.95, EffectiveDegreesOfFreedom(rest)) * std::sqrt(variance_um2) / 1e3;
}

void JudgeWorld(const World& world, const BladeFindings& findings, WorldTally* tally) {
  for (int i = 0; i < kWorldHoles; ++i) {
    const HoleFinding& found = findings.holes[i];
    const SimulatedPin& drilled = world.holes[i];
    const NominalPin& drawn = world.truth.holes[i].pin;
    ++tally->holes;
    if (found.instrument == HoleInstrument::kNone) {
      tally->why = found.reason + "; " + found.bore_reason;
      continue;
    }
    ++tally->measured;
    const Vector3d along = Vector3d(drawn.axis.x(), drawn.axis.y(), 0).normalized(), across(-along.y(), along.x(), 0);
    const Vector3d off = drilled.start_mm - drawn.start_mm;
    const auto add = [&](const char* name, double stated, double expanded, double truth) {
      tally->values[name].Add(stated - truth, expanded);
    };
    const HoleDisplacement& d = *found.displacement;
    add("along", d.along.value_mm, d.along.expanded_uncertainty_mm, off.dot(along));
    add("across", d.across.value_mm, d.across.expanded_uncertainty_mm, off.dot(across));
    add("inclination along", d.inclination_along.value_rad, d.inclination_along.expanded_uncertainty_rad,
        LeanOf(drilled.axis, along) - LeanOf(drawn.axis, along));
    add("inclination across", d.inclination_across.value_rad, d.inclination_across.expanded_uncertainty_rad,
        std::atan2(drilled.axis.dot(across), drilled.axis.dot(drawn.axis)));
    if (found.pin_diameter)
      add("pin as seen", found.pin_diameter->seen.value_mm, found.pin_diameter->seen.expanded_uncertainty_mm,
          2 * world.truth.pins[i].radius_mm);
    if (found.hole_diameter.found)
      add("hole's diameter", found.hole_diameter.found->diameter.value_mm,
          found.hole_diameter.found->diameter.expanded_uncertainty_mm, 2 * drilled.radius_mm);
    if (found.instrument == HoleInstrument::kBore)
      add("bore as seen", found.hole_diameter.found->diameter.value_mm, AsSeen_mm(found.hole_diameter.found->diameter),
          2 * drilled.radius_mm);
  }
  for (const HolePitch& pitch : findings.pitches) {
    if (!pitch.values) continue;
    const Vector3d between = world.holes[pitch.next].start_mm - world.holes[pitch.hole].start_mm;
    const StatedLength& row = pitch.values->along_row;
    tally->values["pitch"].Add(row.value_mm - between.x(), row.expanded_uncertainty_mm);
    const StatedLength& distance = pitch.values->distance;
    tally->values["distance"].Add(distance.value_mm - between.norm(), distance.expanded_uncertainty_mm);
    const StatedRatio& ratio = pitch.values->over_nominal_diameter;
    tally->values["P/D drawn"].Add(ratio.value - between.x() / world.truth.holes[0].pin.hole_diameter_mm,
                                   ratio.expanded_uncertainty);
    if (const auto& measured = pitch.values->over_measured_diameter)
      tally->values["P/D measured"].Add(
          measured->value - between.x() / (world.holes[pitch.next].radius_mm + world.holes[pitch.hole].radius_mm),
          measured->expanded_uncertainty);
    double squared = 0;
    for (const std::size_t hole : {pitch.hole, pitch.next}) {
      const HoleDisplacement& d = *findings.holes[hole].displacement;
      squared += std::pow(d.along.expanded_uncertainty_mm * d.directions.along.x(), 2) +
                 std::pow(d.across.expanded_uncertainty_mm * d.directions.across.x(), 2);
    }
    tally->independent_pitch.Add(row.value_mm - between.x(), std::sqrt(squared));
  }
}

}  // namespace

void ValueTally::Add(double error, double expanded) {
  ++count;
  held += std::abs(error) <= expanded;
  squares += error * error;
  expanded_squares += expanded * expanded;
}
double ValueTally::rms() const { return count > 0 ? std::sqrt(squares / count) : 0; }
double ValueTally::expanded() const { return count > 0 ? std::sqrt(expanded_squares / count) : 0; }

WorldTally RunHoleWorld(const HoleWorld& wanted, int seeds, int first_seed) {
  WorldTally tally;
  for (int seed = 0; seed < seeds; ++seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(900 + first_seed + seed));
    World world;
    world.truth = MakePinnedBlock();
    PutHoles(wanted, &random, &world);
    Estimate(&random, &world);
    const PinnedBlock& by = world.estimate;
    InspectionOptions options;
    options.threads = 1;
    BladeInspection inspection(by.surface, by.holes, by.pose, by.sensor, by.axes, options);
    bool added = true;
    for (const LineScan& scan : ScansOfWorld(wanted, world, &random)) added = added && inspection.Add(scan).ok();
    const auto findings = inspection.Finish();
    if (added && findings.ok()) JudgeWorld(world, *findings, &tally);
  }
  return tally;
}

}  // namespace sixpoint::metrology
