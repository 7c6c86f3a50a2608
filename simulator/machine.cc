#include "simulator/machine.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/frames/angles.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;
// A surface seen flatter than this reflects nothing back (cosine between ray and normal).
constexpr double kGrazing = 0.2;
// The line is 2 (mid_range - z) tan(10 deg) long: 19.7 mm at the near end of what is used, z = 10.
constexpr double kStrip_mm = 18;

Eigen::Vector3d Tilted(const Eigen::Vector3d& direction, const Eigen::Vector3d& small) {
  return (direction + small - small.dot(direction) * direction).normalized();
}

}  // namespace

MachineTruth MountedByHand(const MachineDesign& design, std::uint64_t seed) {
  Random random(seed);
  MachineTruth truth;
  const Eigen::Vector3d turn = random.UniformVector(0.5 * kRadPerDeg);
  truth.machine_from_sensor = metrology::RotationFromCardan({turn.x(), turn.y(), turn.z()});
  truth.t_sm_mm = design.t_sm_mm + random.UniformVector(0.4);
  const Eigen::Vector3d centre = design.centre_mm + random.UniformVector(0.05);
  truth.axes.a = {Tilted(Eigen::Vector3d::UnitY(), random.UniformVector(0.01 * kRadPerDeg)), centre};
  const Eigen::Vector3d apart = random.UniformVector(0.02);
  truth.axes.b = {Tilted(Eigen::Vector3d::UnitX(), random.UniformVector(0.01 * kRadPerDeg)), centre + apart};
  const Eigen::Vector3d laid = random.UniformVector(0.5 * kRadPerDeg);
  truth.machine_from_artefact = Eigen::Isometry3d::Identity();
  truth.machine_from_artefact.linear() = metrology::RotationFromVector(laid);
  truth.machine_from_artefact.translation() = design.artefact_mm + random.UniformVector(0.3);
  truth.sphere_in_zero_mm = design.centre_mm + Eigen::Vector3d(45, 6, 60) + random.UniformVector(3);
  return truth;
}

Eigen::Isometry3d ClampedByHand(const DesignedPart& part, double shift_mm, double turn_deg, std::uint64_t seed) {
  Random random(seed);
  const Eigen::Vector3d axis = random.GaussianVector().normalized(), way = random.GaussianVector().normalized();
  const double turn = random.Uniform(0.4, 1) * turn_deg * kRadPerDeg, shift = random.Uniform(0.4, 1) * shift_mm;
  metrology::Vector6d moved;
  moved << turn * axis, shift * way;
  const Eigen::Vector3d middle = part.zero_from_part_nominal * Eigen::Vector3d(0, 0, part.airfoil.span_mm / 2);
  return metrology::Perturbed(part.zero_from_part_nominal, moved, middle);
}

Scene ArtefactScene(const ArtefactGeometry& artefact, const MachineTruth& truth) {
  Scene scene;
  scene.Add(std::make_shared<ArtefactShape>(artefact), truth.machine_from_artefact);
  return scene;
}

Scene BladeScene(const std::vector<std::shared_ptr<const Shape>>& shapes, const MachineTruth& truth,
                 const Eigen::Isometry3d& zero_from_part, double a_deg, double b_deg) {
  const Eigen::Isometry3d machine_from_part =
      truth.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * zero_from_part;
  Scene scene;
  for (const auto& shape : shapes) scene.Add(shape, machine_from_part);
  return scene;
}

std::size_t ProfileCount(const ScanPlan& plan) {
  return static_cast<std::size_t>(std::floor((plan.last_x_mm - plan.first_x_mm) / plan.pitch_mm + 1e-9)) + 1;
}

ScanProfiles Scan(const Scene& scene, const MachineTruth& truth, const ScannerDesign& scanner, const ScanPlan& plan,
                  std::uint64_t seed, int threads, const std::function<void()>& profile_done,
                  const ReadingError& reading_error) {
  const std::size_t profile_count = ProfileCount(plan);
  const int columns = plan.columns > 0 ? plan.columns : scanner.columns;
  const double half_range = scanner.range_mm / 2;
  // The laser's source, in the laser plane of the sensor frame (y, z).
  const double stand_off = scanner.mid_range_mm;
  std::vector<Eigen::Vector3d> fan;
  const double half_angle = 0.5 * scanner.line_angle_deg * kRadPerDeg;
  for (int column = 0; column < columns; ++column) {
    const double angle = half_angle * (2 * (column + 0.5) / columns - 1);
    fan.emplace_back(0, std::sin(angle), -std::cos(angle));
  }
  const double raw_step_mm = 1e-3 * scanner.raw_step_um;
  const auto in_raw_steps = [&](double value_mm) { return raw_step_mm * std::round(value_mm / raw_step_mm); };
  ScanProfiles profiles(profile_count);
  const auto trace = [&](std::size_t index) {
    Random noise(Random::StreamSeed(seed, index));
    const double x = plan.first_x_mm + static_cast<double>(index) * plan.pitch_mm;
    const Eigen::Vector3d carriage = Eigen::Vector3d(x, 0, 0) - plan.v0_mm + truth.t_sm_mm;
    const Eigen::Vector3d source = truth.machine_from_sensor * Eigen::Vector3d(0, 0, stand_off) + carriage;
    profiles[index].x_mm = x;
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector3d& ray = fan[static_cast<std::size_t>(column)];
      const Eigen::Vector3d direction = truth.machine_from_sensor * ray;
      const double error = 1e-3 * scanner.noise_um * noise.Gaussian();  // drawn for every column, hit or not
      const auto hit = scene.Intersect({source, direction}, stand_off + 2 * scanner.range_mm);
      if (!hit || -direction.dot(hit->normal) < kGrazing) continue;
      double distance = hit->distance_mm + error;
      if (reading_error)
        distance += reading_error(index, column, hit->distance_mm * ray.y(), stand_off + hit->distance_mm * ray.z());
      const double z = stand_off + distance * ray.z();
      if (std::abs(z) > half_range) continue;
      profiles[index].columns.push_back(column);
      profiles[index].points_mm.emplace_back(x, in_raw_steps(distance * ray.y()), in_raw_steps(z));
    }
    if (profile_done) profile_done();
  };
  metrology::ForEach(profile_count, threads, trace);
  return profiles;
}

metrology::Points PointsOf(const ScanProfiles& profiles) {
  metrology::Points points_mm;
  for (const Profile& profile : profiles)
    points_mm.insert(points_mm.end(), profile.points_mm.begin(), profile.points_mm.end());
  return points_mm;
}

std::vector<ProbedSphere> ProbeSphere(const MachineTruth& truth, double noise_um, std::uint64_t seed,
                                      const Reached& reached) {
  Random random(seed);
  std::vector<ProbedSphere> poses;
  const auto probe = [&](double a_deg, double b_deg, bool held_out) {
    const auto [a_reached_deg, b_reached_deg] = reached ? reached(a_deg, b_deg) : std::pair(a_deg, b_deg);
    const Eigen::Vector3d centre =
        truth.axes.MachineFromZero(a_reached_deg * kRadPerDeg, b_reached_deg * kRadPerDeg) * truth.sphere_in_zero_mm;
    poses.push_back({a_deg, b_deg, centre + 1e-3 * noise_um * random.GaussianVector(), held_out});
  };
  for (int a = -60; a <= 60; a += 24)
    for (int b = 0; b < 360; b += 60) probe(a, b, false);
  for (int k = 0; k < 12; ++k) {
    const double a = random.Uniform(-60, 60), b = random.Uniform(0, 300);
    probe(a, b, true);
  }
  return poses;
}

std::vector<ScanPlan> PlanArtefact(const MachineDesign& design) {
  std::vector<ScanPlan> plans;
  for (const double depth : {10.0, -10.0}) {
    ScanPlan plan;
    plan.v0_mm = design.t_sm_mm - design.artefact_mm + Eigen::Vector3d(0, 0, depth);
    plan.first_x_mm = -13;
    plan.last_x_mm = 13;
    plan.pitch_mm = 0.05;
    plans.push_back(plan);
  }
  return plans;
}

Eigen::Isometry3d MachineFromPartNominal(const DesignedPart& part, const MachineDesign& design, double a_deg,
                                         double b_deg) {
  metrology::RotaryAxes ideal;
  ideal.a.point_mm = ideal.b.point_mm = design.centre_mm;
  return ideal.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * part.zero_from_part_nominal;
}

ScanPlan PlanStrip(const DesignedPart& part, const MachineDesign& design, double pitch_mm, double a_deg, double b_deg,
                   double y_mm) {
  constexpr double kNear_mm = 10, kMargin_mm = 2, kUnbounded = std::numeric_limits<double>::infinity();
  const Eigen::Isometry3d machine_from_part = MachineFromPartNominal(part, design, a_deg, b_deg);
  double low_x = kUnbounded, high_x = -kUnbounded, top = -kUnbounded;
  for (const Eigen::Vector3d& vertex : part.mesh.vertices_mm) {
    const Eigen::Vector3d p = machine_from_part * vertex;
    low_x = std::min(low_x, p.x());
    high_x = std::max(high_x, p.x());
    if (std::abs(p.y() - y_mm) < kStrip_mm / 2) top = std::max(top, p.z());
  }
  ScanPlan plan;
  const double x = 0.5 * (low_x + high_x), half = 0.5 * (high_x - low_x) + kMargin_mm;
  plan.v0_mm = design.t_sm_mm - Eigen::Vector3d(x, y_mm, top - kNear_mm);
  plan.a_deg = a_deg;
  plan.b_deg = b_deg;
  plan.first_x_mm = -pitch_mm * std::floor(half / pitch_mm);
  plan.last_x_mm = -plan.first_x_mm;
  plan.pitch_mm = pitch_mm;
  return plan;
}

std::vector<ScanPlan> PlanBlade(const DesignedPart& part, const MachineDesign& design, double pitch_mm,
                                const std::vector<std::pair<double, double>>& poses_deg) {
  std::vector<ScanPlan> plans;
  for (const auto& [a_deg, b_deg] : poses_deg) {
    const Eigen::Isometry3d machine_from_part = MachineFromPartNominal(part, design, a_deg, b_deg);
    constexpr double kUnbounded = std::numeric_limits<double>::infinity();
    double low_y = kUnbounded, high_y = -kUnbounded;
    for (const Eigen::Vector3d& vertex : part.mesh.vertices_mm) {
      const double y = (machine_from_part * vertex).y();
      low_y = std::min(low_y, y);
      high_y = std::max(high_y, y);
    }
    // Only what lies within the measuring range below the highest point can be seen; upright blades need fewer strips.
    const int strips = std::max(1, static_cast<int>(std::ceil((high_y - low_y) / kStrip_mm)));
    for (int strip = 0; strip < strips; ++strip) {
      const double y = 0.5 * (low_y + high_y) + (strip - 0.5 * (strips - 1)) * (high_y - low_y) / strips;
      plans.push_back(PlanStrip(part, design, pitch_mm, a_deg, b_deg, y));
    }
  }
  return plans;
}

DrilledHole Drill(const DesignedPart& part, const DesignedHoleGroup& group, const DesignedHole& hole,
                  const MachineTruth& truth, const Eigen::Isometry3d& zero_from_part, const DrillCommand& command,
                  const DrillingError& error, Random random) {
  const Eigen::Isometry3d part_from_machine =
      (truth.axes.MachineFromZero(command.a_deg * kRadPerDeg, command.b_deg * kRadPerDeg) * zero_from_part).inverse();
  const Eigen::Vector3d wobble = error.direction_sigma_deg * kRadPerDeg * random.GaussianVector();
  const Eigen::Vector3d axis = part_from_machine.linear() * Tilted(Eigen::Vector3d::UnitZ(), wobble);
  const Eigen::Vector3d through =
      part_from_machine *
      Eigen::Vector3d(command.start_mm + error.tool_off_mm + error.position_sigma_mm * random.GaussianVector());
  DrilledHole drilled;
  drilled.group = group.name;
  drilled.hole = hole.name;
  drilled.axis_in_part = axis;
  const Eigen::Vector3d outside = through + 4 * axis;
  const TriangleShape surface(part.mesh);
  const auto hit = surface.Intersect({outside, -axis}, 8);
  drilled.start_in_part_mm = hit ? Eigen::Vector3d(outside - hit->distance_mm * axis) : through;
  drilled.position_error_mm = (drilled.start_in_part_mm - hole.start_mm).norm();
  drilled.inclination_error_deg = std::atan2(axis.cross(group.axis).norm(), axis.dot(group.axis)) / kRadPerDeg;
  return drilled;
}

std::shared_ptr<const Shape> PinIn(const DrilledHole& hole, double diameter_mm, double standing_out_mm) {
  constexpr double kFoot_mm = 1;  // hidden in the hole
  return std::make_shared<Pin>(hole.start_in_part_mm + standing_out_mm * hole.axis_in_part, hole.axis_in_part,
                               diameter_mm / 2, standing_out_mm + kFoot_mm);
}

}  // namespace sixpoint::simulator
