#include "bench/calibration/plant_files.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "metrology/cloud/draco_codec.h"

namespace sixpoint::bench {
namespace {

using nlohmann::json;

[[noreturn]] void StopReading(const std::string& why) {
  std::fprintf(stderr, "bench/run: %s\n", why.c_str());
  std::exit(1);
}

}  // namespace

Eigen::Vector3d VectorOf(const json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

metrology::LineScan LoadScan(const std::string& folder, const json& data, const std::string& id) {
  for (const json& s : data.at("scans")) {
    if (s.at("id") != id) continue;
    std::ifstream file(folder + "/" + s.at("file").get<std::string>(), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    absl::StatusOr<metrology::Points> points = metrology::DecodeBlock(bytes, s.at("point_count").get<std::int64_t>());
    if (!points.ok()) StopReading(std::string(points.status().message()));
    metrology::LineScan scan;
    scan.id = id;
    scan.v0_mm = VectorOf(s.at("v0_mm"));
    scan.points_mm = *std::move(points);
    return scan;
  }
  StopReading("no scan " + id);
}

simulator::ArtefactGeometry GeometryOf(const json& artefact) {
  simulator::ArtefactGeometry geometry;
  geometry.cones_mm.clear();
  geometry.slots_mm.clear();
  for (const auto& [name, at] : artefact.at("cones_mm").items())
    geometry.cones_mm[name] = {at.at(0).get<double>(), at.at(1).get<double>()};
  for (const auto& [name, at] : artefact.at("slots_mm").items())
    geometry.slots_mm[name] = {at.at(0).get<double>(), at.at(1).get<double>()};
  geometry.cone_half_angle_deg = artefact.at("cone_half_angle_deg");
  geometry.cone_top_radius_mm = artefact.at("cone_top_radius_mm");
  geometry.cone_bottom_radius_mm = artefact.at("cone_bottom_radius_mm");
  geometry.slot_width_mm = artefact.at("slot_width_mm");
  geometry.slot_depth_mm = artefact.at("slot_depth_mm");
  return geometry;
}

simulator::MachineTruth TruthOf(const json& known) {
  simulator::MachineTruth truth;
  for (int i = 0; i < 9; ++i)
    truth.machine_from_sensor(i / 3, i % 3) = known.at("machine_from_sensor_rotation").at(i / 3).at(i % 3);
  truth.t_sm_mm = VectorOf(known.at("T_sm_mm"));
  for (int i = 0; i < 16; ++i)
    truth.machine_from_artefact.matrix()(i / 4, i % 4) = known.at("artefact_pose").at(i / 4).at(i % 4);
  return truth;
}

}  // namespace sixpoint::bench
