#include "simulator/plant_files.h"

#include <absl/strings/str_cat.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "simulator/plant_scans.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;
using nlohmann::json;
constexpr double kProbeNoise_um = 1;
enum FileStream : std::uint64_t { kTouch = 300, kSphere, kRunA, kRunB };

json ListOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json ListOf(const metrology::Points& points) {
  json out = json::array();
  for (const Eigen::Vector3d& point : points) out.push_back(ListOf(point));
  return out;
}
json Rows(const Eigen::MatrixXd& matrix) {
  json out = json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    json& values = out.emplace_back(json::array());
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) values.push_back(matrix(row, column));
  }
  return out;
}

class PlantWriter {
 public:
  PlantWriter(const PlantWorld& world, const std::string& folder, int threads)
      : world_(world),
        folder_(folder),
        threads_(threads),
        plate_("plate-" + std::to_string(world.seed)),
        machine_("sim-" + std::to_string(world.seed)) {}

  absl::StatusOr<PlantFiles> Write() {
    std::error_code error;
    std::filesystem::create_directories(folder_ / "scans", error);
    if (error) return absl::UnavailableError(absl::StrCat((folder_ / "scans").string(), ": ", error.message()));
    const Stage stage(world_);
    const std::vector<PlannedScan> planned = PlanScans(world_);
    PlantFiles files;
    json scans = json::array();
    for (const PlannedScan& scan : planned) {
      const metrology::Points points_mm = stage.Read(scan, threads_);
      if (points_mm.empty()) continue;  // a portion that the sensor does not reach
      const auto encoded = metrology::EncodeBlock(points_mm, 1e-4);
      if (!encoded.ok()) return encoded.status();
      if (absl::Status status = Save("scans/" + scan.id + ".drc", encoded->bytes); !status.ok()) return status;
      scans.push_back(ScanEntry(scan, points_mm.size()));
      ++files.scan_count;
      files.point_count += static_cast<std::int64_t>(points_mm.size());
    }
    absl::Status status = Save("blade.stl", BinaryStl(world_.part.mesh));
    if (status.ok()) status = Save("dataset.json", Dataset(std::move(scans)).dump(1));
    if (status.ok()) status = Save("truth.json", Truth(stage, planned).dump(1));
    if (!status.ok()) return status;
    return files;
  }

 private:
  std::uint64_t SeedOf(FileStream stream) const { return Random::StreamSeed(world_.seed, stream); }

  absl::Status Save(const std::string& name, const std::string& bytes) const {
    std::ofstream file(folder_ / name, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    file.close();
    return file ? absl::OkStatus() : absl::UnavailableError((folder_ / name).string() + ": cannot be written");
  }

  json ScanEntry(const PlannedScan& scan, std::size_t point_count) const {
    json entry = {{"id", scan.id},
                  {"file", "scans/" + scan.id + ".drc"},
                  {"kind", scan.kind},
                  {"subject", scan.serial.empty() ? "artefact:" + plate_ : "blade:" + scan.serial},
                  {"machine", machine_},
                  {"v0_mm", ListOf(scan.plan.v0_mm)},
                  {"a_deg", scan.plan.a_deg},
                  {"b_deg", scan.plan.b_deg},
                  {"profile_pitch_mm", scan.plan.pitch_mm},
                  {"columns_per_profile", scan.plan.columns},
                  {"point_count", point_count}};
    if (world_.errors.latency) entry["travel"] = scan.backward ? "backward" : "forward";
    if (world_.errors.warmth && world_.errors.warmth->is_measured && !scan.serial.empty()) {
      entry["temperature_c"] = world_.errors.warmth->part_read_c;
      entry["scales_temperature_c"] = world_.errors.warmth->scales_read_c;
    }
    return entry;
  }

  double ProbeNoise() const { return world_.errors.noise_um > 0 ? kProbeNoise_um : 0; }

  json TouchProbe() const {
    // All that the probe finds is off alike.
    const Eigen::Isometry3d found =
        Eigen::Translation3d(world_.errors.touch_off_mm) * world_.truth.machine_from_artefact;
    const TouchProbing probing = ProbeArtefact(world_.artefact, found, ProbeNoise(), Random(SeedOf(kTouch)));
    json centres = json::object();
    for (const auto& [name, centre] : probing.centres_mm) centres[name] = ListOf(centre);
    return {{"frame", "table"},
            {"centres", centres},
            {"plane", ListOf(probing.plane_mm)},
            {"side_x", ListOf(probing.side_x_mm)},
            {"side_y", ListOf(probing.side_y_mm)}};
  }

  json SpherePoses() const {
    Random random(SeedOf(kSphere));
    const auto reached = [&](double a_deg, double b_deg) { return world_.Approach_deg(a_deg, b_deg, &random); };
    json poses = json::array();
    for (const ProbedSphere& probed : ProbeSphere(world_.truth, ProbeNoise(), random.Next(), reached))
      poses.push_back({{"a_deg", probed.a_deg},
                       {"b_deg", probed.b_deg},
                       {"centre_mm", ListOf(Eigen::Vector3d(probed.centre_mm + world_.errors.touch_off_mm))},
                       {"use", probed.held_out ? "check" : "fit"}});
    return poses;
  }

  json ArtefactEntry() const {
    const ArtefactGeometry& artefact = world_.artefact;
    json out = {{"id", plate_},
                {"side_mm", artefact.side_mm},
                {"cone_half_angle_deg", artefact.cone_half_angle_deg},
                {"cone_top_radius_mm", artefact.cone_top_radius_mm},
                {"cone_bottom_radius_mm", artefact.cone_bottom_radius_mm},
                {"slot_width_mm", artefact.slot_width_mm},
                {"slot_depth_mm", artefact.slot_depth_mm}};
    for (const auto& [name, centre] : artefact.cones_mm) out["cones_mm"][name] = {centre.x(), centre.y()};
    for (const auto& [name, centre] : artefact.slots_mm) out["slots_mm"][name] = {centre.x(), centre.y()};
    return out;
  }

  json PartEntry() const {
    const DesignedPart& part = world_.part;
    json groups = json::array(), datums = json::array();
    for (const DesignedHoleGroup& group : part.hole_groups) {
      json holes = json::array();
      for (const DesignedHole& hole : group.holes)
        holes.push_back({{"name", hole.name},
                         {"start_in_part_mm", ListOf(hole.start_mm)},
                         {"normal_in_part", ListOf(hole.normal)}});
      groups.push_back({{"name", group.name},
                        {"diameter_mm", group.diameter_mm},
                        {"depth_mm", group.depth_mm},
                        {"a_nominal_deg", group.a_nominal_deg},
                        {"b_nominal_deg", group.b_nominal_deg},
                        {"axis_in_part", ListOf(group.axis)},
                        {"position_tolerance_mm", group.position_tolerance_mm},
                        {"inclination_tolerance_deg", group.inclination_tolerance_deg},
                        {"holes", holes}});
    }
    for (const DesignedDatum& datum : part.six_points)
      datums.push_back({{"name", datum.name},
                        {"point_in_part_mm", ListOf(datum.point_mm)},
                        {"normal_in_part", ListOf(datum.normal)}});
    json out = {{"id", "blade-" + std::to_string(world_.seed)},
                {"cad", "blade.stl"},
                {"cad_unit", "mm"},
                {"zero_from_part_nominal", Rows(part.zero_from_part_nominal.matrix())},
                {"hole_groups", groups},
                {"six_points", datums}};
    if (const auto& warmth = world_.errors.warmth)
      out["thermal_expansion"] = {{"um_per_m_k", warmth->part_stated_um_per_m_k},
                                  {"standard_uncertainty_um_per_m_k", warmth->coefficient_standard_um_per_m_k}};
    return out;
  }

  // Only what is there is stated.
  json ErrorSources() const {
    const WorldErrors& errors = world_.errors;
    json out = json::object();
    if (errors.a_axis) {
      out["axis_tables"] = "apply";
      out["approach"] = world_.upwards ? "upwards" : "downwards";
    }
    if (errors.touch_standard_um > 0) out["touch_common_standard_uncertainty_um"] = errors.touch_standard_um;
    if (errors.arm) {
      out["arm_swings_between"] = "series";
      out["series"] = {{"calibration", "artefact_"},
                       {"blade", "sn1_blade"},
                       {"local", "sn1_local"},
                       {"casting", "sn2_casting"},
                       {"pins", "sn1_pins"}};
    }
    if (errors.field) out["sensor_field_standard_uncertainty_um"] = errors.field->standard_um();
    if (errors.speckle)
      out["sensor_speckle"] = {{"standard_uncertainty_um", errors.speckle->standard_um},
                               {"columns", errors.speckle->columns}};
    if (errors.pins)
      out["pin"] = {{"clearance_standard_uncertainty_um", errors.pins->clearance_um},
                    {"tilt_standard_uncertainty_deg", errors.pins->tilt_deg}};
    if (errors.latency) out["encoder_latency_standard_uncertainty_um"] = errors.latency->standard_um;
    if (const auto& warmth = errors.warmth) {
      if (warmth->is_measured)
        out["temperature_standard_uncertainty_k"] = warmth->thermometer_k;
      else
        out["temperature_half_range_k"] = warmth->half_range_k;
      out["scale_expansion"] = {{"um_per_m_k", warmth->scales_stated_um_per_m_k},
                                {"standard_uncertainty_um_per_m_k", warmth->coefficient_standard_um_per_m_k}};
    }
    return out;
  }

  json RunOf(const AxisError& axis, FileStream stream) const {
    const EncoderRun run = RunAxis(axis, world_.errors.encoder_noise_deg, Random(SeedOf(stream)));
    return {{"commanded_deg", run.commanded_deg}, {"direction", run.direction}, {"error_deg", run.error_deg}};
  }

  json Dataset(json scans) const {
    const MachineDesign& design = world_.design;
    const WorldErrors& errors = world_.errors;
    json out = {{"note", "Made by sixpoint-simulator, seed " + std::to_string(world_.seed) +
                             ". Clouds are in the sensor frame, x = encoder, mm."},
                {"machine",
                 {{"id", machine_},
                  {"kinematics", "p_table(A,B) = about C: Ry(A) Rx(B) p_zero, nominally"},
                  {"nominal_centre_mm", ListOf(design.centre_mm)},
                  {"a_limits_deg", {-world_.a_limit_deg, world_.a_limit_deg}},
                  {"b_limits_deg", {-world_.b_limit_deg, world_.b_limit_deg}}}},
                {"sensor",
                 {{"model", "simulated line scanner"},
                  {"noise_um", errors.noise_um > 0 ? errors.noise_um : design.scanner.raw_step_um},
                  {"columns", design.scanner.columns},
                  {"line_angle_deg", design.scanner.line_angle_deg},
                  {"mid_range_mm", design.scanner.mid_range_mm},
                  {"range_mm", design.scanner.range_mm}}},
                {"artefact", ArtefactEntry()},
                {"touch_probe", TouchProbe()},
                {"sphere_poses", SpherePoses()},
                {"part", PartEntry()},
                {"scans", std::move(scans)}};
    if (errors.a_axis) out["axis_runs"] = {{"A", RunOf(*errors.a_axis, kRunA)}, {"B", RunOf(*errors.b_axis, kRunB)}};
    if (json sources = ErrorSources(); !sources.empty()) out["error_sources"] = std::move(sources);
    return out;
  }

  json CorrectionsOf(const Eigen::Isometry3d& zero_from_part) const {
    json out = json::array();
    const std::vector<TrueCorrection> found = TrueCorrections(world_, zero_from_part);
    for (std::size_t g = 0; g < found.size(); ++g) {
      const DesignedHoleGroup& group = world_.part.hole_groups[g];
      json holes = json::array();
      for (std::size_t i = 0; i < group.holes.size(); ++i)
        holes.push_back({{"name", group.holes[i].name}, {"start_table_mm", ListOf(found[g].starts_mm[i])}});
      out.push_back({{"group", found[g].group},
                     {"ideal_axes", {{"a_deg", found[g].ideal_a_deg}, {"b_deg", found[g].ideal_b_deg}}},
                     {"real_axes", {{"a_deg", found[g].a_deg}, {"b_deg", found[g].b_deg}}},
                     {"holes", holes}});
    }
    return out;
  }

  json Truth(const Stage& stage, const std::vector<PlannedScan>& planned) const {
    const MachineTruth& truth = world_.truth;
    const auto line = [](const metrology::AxisLine& axis) -> json {
      return {{"direction", ListOf(axis.direction)}, {"point", ListOf(axis.point_mm)}};
    };
    json drilled = json::array(), swings = json::object();
    for (const DrilledHole& hole : world_.drilled)
      drilled.push_back({{"group", hole.group},
                         {"hole", hole.hole},
                         {"position_error_mm", hole.position_error_mm},
                         {"inclination_error_deg", hole.inclination_error_deg},
                         {"start_in_part_mm", ListOf(hole.start_in_part_mm)},
                         {"axis_in_part", ListOf(hole.axis_in_part)}});
    for (const PlannedScan& scan : planned) {
      const MachineTruth during = stage.During(scan);
      const Eigen::Vector3d turn =
          metrology::VectorFromRotation(during.machine_from_sensor * truth.machine_from_sensor.transpose()) /
          kRadPerDeg;
      swings[scan.series.empty() ? scan.id : scan.series] = {
          {"turn_deg", ListOf(turn)}, {"shift_mm", ListOf(Eigen::Vector3d(during.t_sm_mm - truth.t_sm_mm))}};
    }
    return {{"machine_from_sensor_rotation", Rows(truth.machine_from_sensor)},
            {"T_sm_mm", ListOf(truth.t_sm_mm)},
            {"a_axis", line(truth.axes.a)},
            {"b_axis", line(truth.axes.b)},
            {"artefact_pose", Rows(truth.machine_from_artefact.matrix())},
            {"zero_from_part", Rows(world_.ZeroFromPartAt20().matrix())},
            {"part_seen", world_.part_seen},
            {"correction", CorrectionsOf(world_.zero_from_part)},
            {"casting_correction", CorrectionsOf(world_.zero_from_casting)},
            {"drilled_holes", drilled},
            {"sensor_displacements", swings},
            {"casting_deviation_mm", {{"greatest", kGreatestCasting_mm}}}};
  }

  const PlantWorld& world_;
  const std::filesystem::path folder_;
  const int threads_;
  const std::string plate_, machine_;
};

}  // namespace

absl::StatusOr<PlantFiles> WritePlant(const PlantWorld& world, const std::string& folder, int threads) {
  return PlantWriter(world, folder, threads).Write();
}

}  // namespace sixpoint::simulator
