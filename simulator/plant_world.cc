#include "simulator/plant_world.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {
namespace {

using metrology::kPi;
using metrology::kRadPerDeg;
// Streams of a plant's seed: nothing that is drawn depends on what is drawn elsewhere.
enum WorldStream : std::uint64_t {
  kErrors = 1,
  kBlade,
  kMachine,
  kMounting,
  kClamping,
  kCastingClamping,
  kDrilling,
  kForm,
  kCastingForm,
  kFixture
};

// As turbine rotor blades are: cambered and twisted enough for a scan of one side to hold them.
AirfoilDesign DrawAirfoil(Random random) {
  AirfoilDesign airfoil;
  airfoil.span_mm = random.Uniform(38, 52);
  airfoil.root_chord_mm = random.Uniform(26, 33);
  airfoil.tip_chord_mm = random.Uniform(0.65, 0.85) * airfoil.root_chord_mm;
  airfoil.camber_mm = random.Uniform(5, 8.5);
  airfoil.leading_edge_radius_mm = random.Uniform(0.9, 1.5);
  airfoil.trailing_edge_radius_mm = random.Uniform(0.35, 0.6);
  airfoil.root_twist_deg = random.Uniform(10, 20);
  airfoil.tip_twist_deg = random.Uniform(-22, -10);
  airfoil.lean_mm = random.Uniform(1, 3);
  return airfoil;
}

std::vector<HoleGroupDesign> DrawHoleGroups(Random random) {
  const double diameter_mm = random.Uniform(0.45, 0.8);
  std::vector<HoleGroupDesign> groups;
  const auto add = [&](const char* name, double turn_deg, double lean_deg) {
    const double turn = turn_deg + random.Uniform(-10, 10), lean = lean_deg + random.Uniform(-8, 8);
    const double span_lean = random.Uniform(-5, 5);
    groups.push_back({name, diameter_mm, turn, lean, span_lean, 6, 0.08});
  };
  add("G1", 65, 28);
  add("G2", 325, -25);  // near the leading edge: a scan from one side holds the part there
  add("G3", 115, 25);
  return groups;
}

// As drawn; the mesh between its points is finer than the part's CAD file.
metrology::TriangleMesh FineMesh(const AirfoilDesign& design,
                                 const std::function<double(const Eigen::Vector3d&, const Eigen::Vector3d&)>& off_mm) {
  AirfoilDesign fine = design;
  fine.columns = 3 * design.columns / 2;
  fine.rows = 3 * design.rows / 2;
  const Airfoil airfoil(fine);
  metrology::TriangleMesh mesh = airfoil.Mesh();
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    const auto columns = static_cast<std::size_t>(fine.columns);
    const double turn = 2 * kPi * static_cast<double>(i % columns) / fine.columns;
    const double z = fine.span_mm * static_cast<double>(i / columns) / fine.rows;
    const Eigen::Vector3d normal = airfoil.Normal(turn, z), point = airfoil.Point(turn, z);
    mesh.vertices_mm[i] = point + off_mm(point, normal) * normal;
  }
  return mesh;
}

}  // namespace

std::pair<double, double> PlantWorld::Reached_deg(double a_deg, double b_deg) const {
  const double a_off = errors.a_axis ? errors.a_axis->At_deg(a_deg, upwards) : 0;
  const double b_off = errors.b_axis ? errors.b_axis->At_deg(b_deg, upwards) : 0;
  return {a_deg + a_off, b_deg + b_off};
}

std::pair<double, double> PlantWorld::Approach_deg(double a_deg, double b_deg, Random* random) const {
  auto [a, b] = Reached_deg(a_deg, b_deg);
  if (errors.a_axis) a += errors.a_axis->repeat_deg * random->Gaussian();
  if (errors.b_axis) b += errors.b_axis->repeat_deg * random->Gaussian();
  return {a, b};
}

Eigen::Isometry3d PlantWorld::ZeroFromPartAt20() const {
  Eigen::Isometry3d pose = zero_from_part;
  const Eigen::Vector3d about = truth.axes.b.point_mm;
  pose.translation() = about + (zero_from_part.translation() - about) / part_seen;
  return pose;
}

PlantWorld DrawPlant(std::uint64_t seed, const std::set<std::string>& without) {
  const auto stream = [seed](WorldStream which) { return Random::StreamSeed(seed, which); };
  PlantWorld world;
  world.seed = seed;
  world.errors = DrawErrors(stream(kErrors), without);
  Random machine(stream(kMachine));
  MachineDesign& design = world.design;
  design.centre_mm += machine.UniformVector(20);
  design.t_sm_mm += machine.UniformVector(15);
  design.artefact_mm += machine.UniformVector(10);
  design.scanner.noise_um = world.errors.noise_um;
  world.upwards = machine.Uniform() < 0.7;
  world.truth = MountedByHand(design, stream(kMounting));

  Random blade(stream(kBlade));
  const AirfoilDesign airfoil = DrawAirfoil(Random(blade.Next()));
  const double root_from_centre_mm = blade.Uniform(18, 30);
  world.part = DesignPart(airfoil, design.centre_mm, root_from_centre_mm, DrawHoleGroups(Random(blade.Next())));
  world.part_seen = world.errors.warmth ? world.errors.warmth->PartSeen() : 1;
  world.zero_from_part = ClampedByHand(world.part, 1, 1.2, stream(kClamping));
  world.zero_from_casting = ClampedByHand(world.part, 1, 1.2, stream(kCastingClamping));

  // The drill went where it should, but for its own errors.
  const std::vector<TrueCorrection> corrections = TrueCorrections(world, world.zero_from_part);
  const DrillingError drilling{0.02, 0.25};
  std::uint64_t hole_index = 0;
  for (std::size_t g = 0; g < corrections.size(); ++g) {
    const DesignedHoleGroup& group = world.part.hole_groups[g];
    for (const DesignedHole& hole : group.holes) {
      DrillCommand command;
      std::tie(command.a_deg, command.b_deg) = world.Reached_deg(corrections[g].a_deg, corrections[g].b_deg);
      // In part coordinates at 20 C the warm part is as drawn.
      command.start_mm = world.truth.axes.MachineFromZero(command.a_deg * kRadPerDeg, command.b_deg * kRadPerDeg) *
                         world.zero_from_part * hole.start_mm;
      world.drilled.push_back(Drill(world.part, group, hole, world.truth, world.zero_from_part, command, drilling,
                                    Random(Random::StreamSeed(stream(kDrilling), hole_index++))));
    }
  }
  return world;
}

std::vector<TrueCorrection> TrueCorrections(const PlantWorld& world, const Eigen::Isometry3d& zero_from_part) {
  std::vector<TrueCorrection> corrections;
  const auto& axes = world.truth.axes;
  for (const DesignedHoleGroup& group : world.part.hole_groups) {
    TrueCorrection& out = corrections.emplace_back();
    out.group = group.name;
    const Eigen::Vector3d v = zero_from_part.linear() * group.axis;
    double b = std::atan2(v.y(), v.z()), a = std::atan2(-v.x(), v.y() * std::sin(b) + v.z() * std::cos(b));
    out.ideal_a_deg = a / kRadPerDeg;
    out.ideal_b_deg = b / kRadPerDeg;
    // Newton on what is left across Z.
    for (int i = 0; i < 20; ++i) {
      const auto across = [&](double at_a, double at_b) -> Eigen::Vector2d {
        return (axes.MachineFromZero(at_a, at_b).linear() * v).head<2>();
      };
      constexpr double kStep = 1e-6;
      Eigen::Matrix2d slope;
      slope.col(0) = (across(a + kStep, b) - across(a - kStep, b)) / (2 * kStep);
      slope.col(1) = (across(a, b + kStep) - across(a, b - kStep)) / (2 * kStep);
      const Eigen::Vector2d step = slope.inverse() * across(a, b);
      a -= step.x();
      b -= step.y();
    }
    const double a_wanted_deg = a / kRadPerDeg, b_wanted_deg = b / kRadPerDeg;
    out.a_deg = a_wanted_deg;
    out.b_deg = b_wanted_deg;
    for (int i = 0; i < 50; ++i) {  // an axis's error changes by less than a tenth of a command's change
      const auto [a_reached, b_reached] = world.Reached_deg(out.a_deg, out.b_deg);
      out.a_deg += a_wanted_deg - a_reached;
      out.b_deg += b_wanted_deg - b_reached;
    }
    const Eigen::Isometry3d machine_from_part = axes.MachineFromZero(a, b) * zero_from_part;
    for (const DesignedHole& hole : group.holes)
      out.starts_mm.push_back(machine_from_part * Eigen::Vector3d(world.part_seen * hole.start_mm));
  }
  return corrections;
}

metrology::TriangleMesh FinishedBlade(const PlantWorld& world) {
  const SmoothForm form(Random(Random::StreamSeed(world.seed, kForm)));
  const double form_mm = 1e-3 * world.errors.form_um;
  return FineMesh(world.part.airfoil, [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    return form_mm == 0 ? 0 : form_mm * form.At(point, normal);
  });
}

metrology::TriangleMesh Casting(const PlantWorld& world, double greatest_mm) {
  const SmoothForm form(Random(Random::StreamSeed(world.seed, kCastingForm)));
  const auto shape = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    return form.At(point, normal) * LeftByNest(world.part, point);
  };
  double greatest = 0;
  FineMesh(world.part.airfoil, [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    greatest = std::max(greatest, std::abs(shape(point, normal)));
    return 0.0;
  });
  return FineMesh(world.part.airfoil, [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    return greatest_mm / greatest * shape(point, normal);
  });
}

metrology::TriangleMesh Neighbour(const PlantWorld& world) {
  Random random(Random::StreamSeed(world.seed, kFixture));
  const double gap_mm = random.Uniform(2, 3), x = random.Uniform(-4, 4), y = random.Uniform(-3, 3);
  metrology::TriangleMesh mesh = world.part.mesh;
  for (Eigen::Vector3d& vertex : mesh.vertices_mm)
    vertex += Eigen::Vector3d(x, y, -gap_mm - world.part.airfoil.span_mm);
  return mesh;
}

}  // namespace sixpoint::simulator
