#include "simulator/plant_scans.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::simulator {
namespace {

constexpr int kArmScans = 8;
constexpr double kPinStandsOut_mm = 2.5;
constexpr double kTipUp_deg = -50;  // of A
// The scanner goes on beyond the part: what else is in the fixture comes into its scans.
constexpr double kBeyond_mm = 3;
enum ScanStream : std::uint64_t {
  kSwing = 100,
  kApproach = 200,
  kNoise = 1000,
  kSpeckle = 2000,
  kGhosts = 3000,
  kPins = 4000
};

std::uint64_t NameStream(const std::string& name) {
  std::uint64_t hash = 1469598103934665603ull;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return hash;
}

Random StreamOf(const PlantWorld& world, ScanStream stream, std::uint64_t within) {
  return Random(Random::StreamSeed(Random::StreamSeed(world.seed, stream), within));
}

metrology::TriangleMesh AsSeen(metrology::TriangleMesh mesh, double part_seen) {
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex *= part_seen;
  return mesh;
}

std::shared_ptr<const Shape> PinOf(const PlantWorld& world, std::size_t hole) {
  DrilledHole stands = world.drilled[hole];
  if (world.errors.pins) {
    Random random = StreamOf(world, kPins, hole);
    const Eigen::Vector2d off = world.errors.pins->Off_mm(&random), tilt = world.errors.pins->Tilt_rad(&random);
    const Eigen::Vector3d across = stands.axis_in_part.unitOrthogonal(), other = stands.axis_in_part.cross(across);
    stands.start_in_part_mm += off.x() * across + off.y() * other;
    stands.axis_in_part = (stands.axis_in_part + tilt.x() * across + tilt.y() * other).normalized();
  }
  stands.start_in_part_mm *= world.part_seen;
  return PinIn(stands, world.part.hole_groups.front().diameter_mm, kPinStandsOut_mm);
}

// All strips of a pose come from one approach of the axes.
void AddBlade(const PlantWorld& world, const std::string& prefix, const std::string& kind, const std::string& serial,
              const std::string& series, double pitch_mm, int columns, double lower_mm,
              const std::vector<std::pair<double, double>>& poses_deg, std::vector<PlannedScan>* scans) {
  const auto whole = [](double deg) { return std::to_string(static_cast<int>(std::lround(deg))); };
  for (ScanPlan plan : PlanBlade(world.part, world.design, pitch_mm, poses_deg)) {
    PlannedScan& scan = scans->emplace_back();
    const bool same_pose = scans->size() > 1 && (scans->end() - 2)->serial == serial &&
                           (scans->end() - 2)->series == series && (scans->end() - 2)->plan.a_deg == plan.a_deg &&
                           (scans->end() - 2)->plan.b_deg == plan.b_deg;
    scan.approach = scans->size() > 1 ? (scans->end() - 2)->approach + (same_pose ? 0 : 1) : 0;
    scan.kind = kind;
    scan.serial = serial;
    scan.series = series;
    plan.columns = columns;
    plan.v0_mm.z() -= lower_mm;
    plan.first_x_mm -= pitch_mm * std::floor(kBeyond_mm / pitch_mm);
    plan.last_x_mm = -plan.first_x_mm;
    scan.plan = plan;
    scan.id = prefix + "_a" + whole(plan.a_deg) + "_b" + whole(plan.b_deg) + "_" + std::to_string(scans->size());
  }
}

// One strip over a group, fine, from where its axis shows upwards; and one over the tip, without which a side of a blade holds it weakly
// along its span.
void AddLocal(const PlantWorld& world, const DesignedHoleGroup& group, std::vector<PlannedScan>* scans) {
  const double b_deg = std::round(group.b_nominal_deg);
  for (const bool tip : {false, true}) {
    const double a_deg = tip ? kTipUp_deg : 0;
    const Eigen::Isometry3d machine_from_part = MachineFromPartNominal(world.part, world.design, a_deg, b_deg);
    double y_mm = 0;
    for (const DesignedHole& hole : group.holes)
      y_mm += (machine_from_part * hole.start_mm).y() / static_cast<double>(group.holes.size());
    PlannedScan scan;
    scan.id = tip ? "sn1_local_tip" : "sn1_local_" + group.name;
    scan.kind = "local";
    scan.serial = kFinishedSerial;
    scan.series = "local";
    scan.plan = PlanStrip(world.part, world.design, tip ? 0.2 : 0.1, a_deg, b_deg, y_mm);
    scan.plan.columns = tip ? 320 : 640;
    scan.approach = scans->back().approach + 1;
    scans->push_back(scan);
  }
}

}  // namespace

std::vector<PlannedScan> PlanScans(const PlantWorld& world) {
  std::vector<PlannedScan> scans;
  const std::vector<ScanPlan> heights = PlanArtefact(world.design);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    PlannedScan& scan = scans.emplace_back();
    scan.id = "artefact_" + std::to_string(i + 1);
    scan.kind = "artefact";
    scan.series = "calibration";
    scan.plan = heights[i];
    scan.plan.pitch_mm = 0.1;
    scan.plan.columns = 640;
  }
  for (int i = 0; i < kArmScans; ++i) {
    PlannedScan& scan = scans.emplace_back();
    scan.id = "arm_" + std::to_string(i + 1);
    scan.kind = "arm";
    scan.plan = heights[0];
    scan.plan.v0_mm.z() -= 10;
    scan.plan.first_x_mm = -12.9;
    scan.plan.last_x_mm = 12.9;
    scan.plan.pitch_mm = 0.2;
    scan.plan.columns = 480;
  }
  std::vector<std::pair<double, double>> round{{kTipUp_deg, 0}, {kTipUp_deg, 180}}, few{{kTipUp_deg, 0}},
      all_pins = few;
  for (int b_deg = 0; b_deg < 360; b_deg += 60) round.emplace_back(0, b_deg);
  for (int b_deg = 0; b_deg < 360; b_deg += 60) all_pins.emplace_back(0, b_deg);
  // And each group's pins from either end of the span: a pin is measured where half of its circumference is seen.
  for (const DesignedHoleGroup& group : world.part.hole_groups)
    for (const int a_deg : {-35, 35}) all_pins.emplace_back(a_deg, std::round(group.b_nominal_deg));
  for (int b_deg = 0; b_deg < 360; b_deg += 90) few.emplace_back(0, b_deg);
  AddBlade(world, "sn1_blade", "airfoil", kFinishedSerial, "blade", 0.25, 320, 0, round, &scans);

  AddLocal(world, world.part.hole_groups[1], &scans);
  AddBlade(world, "sn2_casting", "airfoil", kCastingSerial, "casting", 0.5, 240, 0, few, &scans);
  AddBlade(world, "sn1_pins", "pins", kFinishedSerial, "pins", 0.15, 400, kPinStandsOut_mm, all_pins, &scans);
  if (world.errors.latency) {
    Random random = StreamOf(world, kApproach, 0);
    for (const char* series : {"blade", "local", "casting", "pins"}) {
      const bool backward = random.Uniform() < 0.5;
      for (PlannedScan& scan : scans)
        if (scan.series == series) scan.backward = backward;
    }
  }
  return scans;
}

Stage::Stage(const PlantWorld& world) : world_(world) {
  finished_ = std::make_shared<TriangleShape>(AsSeen(FinishedBlade(world), world.part_seen));
  casting_ = std::make_shared<TriangleShape>(AsSeen(Casting(world, kGreatestCasting_mm), world.part_seen));
  if (world.errors.neighbour) neighbour_ = std::make_shared<TriangleShape>(AsSeen(Neighbour(world), world.part_seen));
  for (std::size_t hole = 0; hole < world.drilled.size(); ++hole) pins_.push_back(PinOf(world, hole));
}

MachineTruth Stage::During(const PlannedScan& scan) const {
  MachineTruth truth = world_.truth;
  if (world_.errors.arm) {
    const std::string& swung_for = scan.series.empty() ? scan.id : scan.series;
    const metrology::Vector6d swing = world_.errors.arm->Swing(StreamOf(world_, kSwing, NameStream(swung_for)));
    truth.machine_from_sensor = metrology::RotationFromVector(swing.head<3>()) * truth.machine_from_sensor;
    truth.t_sm_mm += swing.tail<3>();
  }
  if (scan.backward) truth.t_sm_mm.x() += 1e-3 * world_.errors.latency->backward_um;
  return truth;
}

std::vector<std::shared_ptr<const Shape>> Stage::GhostsOf(const PlannedScan& scan) const {
  std::vector<std::shared_ptr<const Shape>> ghosts;
  if (!world_.errors.ghosts || scan.kind != "pins") return ghosts;
  Random random = StreamOf(world_, kGhosts, NameStream(scan.id));
  const double pin_radius_mm = world_.part.hole_groups.front().diameter_mm / 2;
  for (const DrilledHole& hole : world_.drilled) {
    if (random.Uniform() > world_.errors.ghosts->share) continue;
    const int clusters = 1 + static_cast<int>(random.Next() % 2);
    for (int i = 0; i < clusters; ++i) {
      const Eigen::Vector3d across = hole.axis_in_part.cross(random.GaussianVector()).normalized();
      const double away_mm = pin_radius_mm + random.Uniform(0.1, 0.6), up_mm = random.Uniform(0.3, kPinStandsOut_mm);
      const double radius_mm = random.Uniform(0.05, 0.12);
      ghosts.push_back(std::make_shared<Sphere>(
          world_.part_seen * hole.start_in_part_mm + up_mm * hole.axis_in_part + away_mm * across, radius_mm));
    }
  }
  return ghosts;
}

Scene Stage::SceneOf(const PlannedScan& scan, const MachineTruth& truth) const {
  if (scan.serial.empty()) return ArtefactScene(world_.artefact, truth);
  std::vector<std::shared_ptr<const Shape>> shapes = {scan.serial == kCastingSerial ? casting_ : finished_};
  if (neighbour_) shapes.push_back(neighbour_);
  if (scan.kind == "pins") {
    shapes.insert(shapes.end(), pins_.begin(), pins_.end());
    const auto ghosts = GhostsOf(scan);
    shapes.insert(shapes.end(), ghosts.begin(), ghosts.end());
  }
  Random random = StreamOf(world_, kApproach, 1 + static_cast<std::uint64_t>(scan.approach));
  const auto [a_deg, b_deg] = world_.Approach_deg(scan.plan.a_deg, scan.plan.b_deg, &random);
  return BladeScene(shapes, truth, scan.serial == kCastingSerial ? world_.zero_from_casting : world_.zero_from_part,
                    a_deg, b_deg);
}

metrology::Points Stage::Read(const PlannedScan& scan, int threads) const {
  const MachineTruth truth = During(scan);
  const std::uint64_t name = NameStream(scan.id);
  std::optional<Speckle> speckle;
  if (world_.errors.speckle)
    speckle.emplace(*world_.errors.speckle, scan.plan.pitch_mm, ProfileCount(scan.plan), scan.plan.columns,
                    StreamOf(world_, kSpeckle, name));
  const ReadingError off_mm = [&](std::size_t profile, int column, double y_mm, double z_mm) {
    return (speckle ? speckle->At_mm(profile, column) : 0) +
           (world_.errors.field ? world_.errors.field->At_mm(y_mm, z_mm) : 0);
  };
  const ScanProfiles profiles = Scan(SceneOf(scan, truth), truth, world_.design.scanner, scan.plan,
                                     StreamOf(world_, kNoise, name).Next(), threads, nullptr, off_mm);
  metrology::Points points_mm = PointsOf(profiles);
  // The scanner's own millimetres do not grow with the scales.
  const double growth = world_.errors.warmth ? world_.errors.warmth->ScalesGrowth() : 1;
  for (Eigen::Vector3d& point : points_mm) point.tail<2>() *= growth;
  return points_mm;
}

}  // namespace sixpoint::simulator
