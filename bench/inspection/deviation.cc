// sixpoint-bench-deviation: how quick deviations are beside the bare distances and beside CloudCompare's, whether thin edges are right, and what
// the plant's casting (SN-0002) was found to be off beside what only its simulator knows. Prints one JSON object.
#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "bench/all_triangles.h"
#include "metrology/cad/tessellation.h"
#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "metrology/inspection/deviation_map.h"
#include "tests/metrology/correction/exact_pose.h"
#include "tests/metrology/plant_files.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using metrology::DeviationMap;
using metrology::DeviationOptions;
using metrology::Points;
using metrology::SurfacePatches;
using nlohmann::json;
using testing::PoseOf;
using testing::ReadFile;
using testing::VectorOf;

using metrology::kRadPerDeg;
constexpr int kThreads = 2;
constexpr std::size_t kPiece = 131'072;  // of a scan's block

double Now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Plant {
  std::string folder;
  json dataset;
  metrology::SensorPose sensor = metrology::SensorPose::Exact();
  metrology::RotaryAxes axes;
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();
  std::shared_ptr<const metrology::Surface> surface;
};

Plant Load(const std::string& folder) {
  Plant plant;
  plant.folder = folder;
  plant.dataset = json::parse(ReadFile(folder + "/dataset.json"));
  const json truth = json::parse(ReadFile(folder + "/truth.json"));
  for (int row = 0; row < 3; ++row)
    plant.sensor.rotation.row(row) = VectorOf(truth["machine_from_sensor_rotation"][row]);
  plant.zero_from_part = PoseOf(truth["zero_from_part"]);
  plant.sensor.t_sm_mm = VectorOf(truth["T_sm_mm"]);
  plant.axes.a = {VectorOf(truth["a_axis"]["direction"]).normalized(), VectorOf(truth["a_axis"]["point"])};
  plant.axes.b = {VectorOf(truth["b_axis"]["direction"]).normalized(), VectorOf(truth["b_axis"]["point"])};
  const auto mesh = metrology::TessellateCad(metrology::CadFormat::kStep, folder + "/cad.step", {1.0, 1'500'000, 4.0});
  plant.surface = *metrology::Surface::Prepare(*mesh);
  return plant;
}

// A casting: evenly over the surface, up to 0.3 mm off it, 2 um of noise.
Points CastingPoints(const metrology::Surface& surface, std::size_t count) {
  const metrology::TriangleMesh& mesh = surface.mesh();
  std::vector<double> area(mesh.triangles.size());
  for (std::size_t t = 0; t < area.size(); ++t) {
    const auto& c = mesh.triangles[t];
    area[t] = (mesh.vertices_mm[c[1]] - mesh.vertices_mm[c[0]])
                  .cross(mesh.vertices_mm[c[2]] - mesh.vertices_mm[c[0]])
                  .norm() /
              2;
  }
  std::mt19937_64 random(11);
  std::discrete_distribution<std::size_t> any(area.begin(), area.end());
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, 2e-3);
  const Vector3d middle = surface.centroid_mm();
  Points points;
  points.reserve(count);
  while (points.size() < count) {
    const auto& c = mesh.triangles[any(random)];
    double u = unit(random), v = unit(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vector3d one = mesh.vertices_mm[c[1]] - mesh.vertices_mm[c[0]],
                   other = mesh.vertices_mm[c[2]] - mesh.vertices_mm[c[0]];
    const Vector3d at = mesh.vertices_mm[c[0]] + u * one + v * other;
    const Vector3d from = at - middle;
    const double off_mm = 0.2 * std::sin(from.y() / 9) * std::cos(from.z() / 14) + noise(random);
    points.push_back(at + off_mm * one.cross(other).normalized());
  }
  return points;
}

// Lines as a scanner brings them: one after the other along z, so that neighbours come together.
void Sort(Points* points) {
  std::sort(points->begin(), points->end(), [](const Vector3d& one, const Vector3d& other) {
    const auto line = [](const Vector3d& p) { return std::floor(p.z() / 0.1); };
    return line(one) != line(other) ? line(one) < line(other) : one.y() < other.y();
  });
}

template <typename Work>
double Seconds(const Work& work) {
  const double begin = Now();
  work();
  return Now() - begin;
}

// As a scan's blocks are decoded.
std::vector<Points> PiecesOf(const Points& points) {
  std::vector<Points> pieces;
  for (std::size_t begin = 0; begin < points.size(); begin += kPiece)
    pieces.emplace_back(points.begin() + static_cast<std::ptrdiff_t>(begin),
                        points.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), begin + kPiece)));
  return pieces;
}

// Sensor, axes and pose that change nothing: the same points for all.
absl::StatusOr<metrology::DeviationField> Mapped(const Plant& plant,
                                                 const std::shared_ptr<const SurfacePatches>& patches,
                                                 const std::vector<Points>& pieces) {
  metrology::RotaryAxes axes;
  axes.a = {Vector3d::UnitY(), Vector3d::Zero()};
  axes.b = {Vector3d::UnitX(), Vector3d::Zero()};
  DeviationOptions options;
  options.threads = kThreads;
  DeviationMap map(
      plant.surface, patches,
      metrology::PartMapping(metrology::ExactPose(Eigen::Isometry3d::Identity()), metrology::SensorPose::Exact(), axes),
      options);
  map.Begin(metrology::LineScan());
  for (const Points& piece : pieces)
    if (absl::Status added = map.AddPoints(piece); !added.ok()) return added;
  return map.Finish();
}

void WritePly(const std::string& path, const Points& points, const Vector3d& origin) {
  std::ofstream out(path, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const Vector3d& point : points) {
    const Eigen::Vector3f p = (point - origin).cast<float>();
    out.write(reinterpret_cast<const char*>(p.data()), sizeof(float) * 3);
  }
}

void WriteStl(const std::string& path, const metrology::TriangleMesh& mesh, const Vector3d& origin) {
  std::ofstream out(path, std::ios::binary);
  const std::string header(80, ' ');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  out.write(header.data(), 80);
  out.write(reinterpret_cast<const char*>(&count), 4);
  for (const auto& corners : mesh.triangles) {
    float values[12] = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f p = (mesh.vertices_mm[corners[k]] - origin).cast<float>();
      std::copy(p.data(), p.data() + 3, values + 3 + 3 * k);
    }
    const std::uint16_t none = 0;
    out.write(reinterpret_cast<const char*>(values), sizeof values);
    out.write(reinterpret_cast<const char*>(&none), 2);
  }
}

void Rates(const Plant& plant, std::size_t count, const std::string& peer_folder, json* figures) {
  Points points = CastingPoints(*plant.surface, count);
  Sort(&points);
  plant.surface->PrepareNear(kThreads);
  const auto patches = std::make_shared<SurfacePatches>(*SurfacePatches::Make(*plant.surface, 1));
  const std::vector<Points> pieces = PiecesOf(points);
  std::vector<double> ratios, bare, mapped;
  for (int run = 0; run < 5; ++run) {
    std::vector<double> distances;
    bare.push_back(Seconds([&] { plant.surface->SignedDistances(points, 1, kThreads, &distances); }));
    mapped.push_back(Seconds([&] {
      const auto field = Mapped(plant, patches, pieces);
      if (!field.ok()) std::printf("%s\n", field.status().ToString().c_str());
    }));
    ratios.push_back(bare.back() / mapped.back());
  }
  std::sort(ratios.begin(), ratios.end());
  std::sort(mapped.begin(), mapped.end());
  std::sort(bare.begin(), bare.end());
  std::printf("%zu points: bare distances %.2f s, mapped with statistics %.2f s (medians of 5)\n", points.size(),
              bare[2], mapped[2]);
  (*figures)["deviation_over_distance_rate"] = ratios[2];
  (*figures)["deviation_million_points_per_s"] = 1e-6 * static_cast<double>(points.size()) / mapped[2];
  (*figures)["deviation_s"] = mapped[2];
  if (peer_folder.empty()) return;
  WritePly(peer_folder + "/points.ply", points, plant.surface->centroid_mm());
  WriteStl(peer_folder + "/part.stl", plant.surface->mesh(), plant.surface->centroid_mm());
}

// About places where the other wall is less than 0.8 mm away.
void ThinEdges(const Plant& plant, json* figures) {
  const metrology::TriangleMesh& mesh = plant.surface->mesh();
  std::mt19937_64 random(12);
  std::uniform_int_distribution<std::size_t> any(0, mesh.triangles.size() - 1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int wrong = 0, checked = 0;
  double worst_um = 0;
  for (int tries = 0; tries < 2'000'000 && checked < 400; ++tries) {
    const auto& c = mesh.triangles[any(random)];
    const Vector3d at = (mesh.vertices_mm[c[0]] + mesh.vertices_mm[c[1]] + mesh.vertices_mm[c[2]]) / 3;
    const Vector3d normal = (mesh.vertices_mm[c[1]] - mesh.vertices_mm[c[0]])
                                .cross(mesh.vertices_mm[c[2]] - mesh.vertices_mm[c[0]])
                                .normalized();
    if (plant.surface->Closest(at - 0.8 * normal).signed_distance_mm < 0) continue;
    const Vector3d p = at + 0.2 * Vector3d(unit(random), unit(random), unit(random));
    const double found = plant.surface->ClosestWithin(p, 1).signed_distance_mm,
                 truth = SignedDistanceByAllTriangles(mesh, p);
    if (std::abs(truth) < 2e-3) continue;  // between the triangles and the curved surface either sign is right
    ++checked;
    wrong += found * truth < 0;
    worst_um = std::max(worst_um, 1e3 * std::abs(found - truth));
  }
  std::printf("thin edges: %d points, %d wrong signs, worst %.2f um beside all triangles in turn\n", checked, wrong,
              worst_um);
  (*figures)["thin_edge_points"] = checked;
  (*figures)["thin_edge_wrong_signs"] = wrong;
  (*figures)["thin_edge_worst_um"] = worst_um;
}

// Of SN-0002, by true calibrations: what the map adds. Means of a millimetre about each place that the truth names; a rigid motion between
// them is taken off, for the truth is along the CAD's normals and any fit takes part of it up.
int Casting(const Plant& plant, json* figures) {
  const auto patches = std::make_shared<SurfacePatches>(*SurfacePatches::Make(*plant.surface, 1));
  DeviationOptions options;
  options.threads = kThreads;
  std::vector<double> truth_mm;
  std::ifstream file(plant.folder + "/sn2_deviation.csv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    double x = 0, y = 0, z = 0, d = 0;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &x, &y, &z, &d) != 4) continue;
    const auto on = plant.surface->Closest({x, y, z});
    options.places.push_back({on.point_mm, on.normal, 0.5});
    truth_mm.push_back(d);
  }
  DeviationMap map(plant.surface, patches,
                   metrology::PartMapping(metrology::ExactPose(plant.zero_from_part), plant.sensor, plant.axes),
                   options);
  for (const json& in : plant.dataset["scans"]) {
    if (in["subject"] != "blade:SN-0002" || in["kind"] != "airfoil") continue;
    const auto points =
        metrology::DecodeBlock(ReadFile(plant.folder + "/" + in["file"].get<std::string>()), in["point_count"]);
    metrology::LineScan scan;
    scan.points_mm = *points;
    scan.v0_mm = VectorOf(in["v0_mm"]);
    scan.a_rad = in["a_deg"].get<double>() * kRadPerDeg;
    scan.b_rad = in["b_deg"].get<double>() * kRadPerDeg;
    if (const absl::Status added = map.Add(scan); !added.ok()) return 2;
  }
  const auto field = map.Finish();
  if (!field.ok()) return 2;
  std::vector<double> off_mm;
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(truth_mm.size()), 6);
  for (std::size_t i = 0; i < truth_mm.size(); ++i) {
    const auto& place = options.places[i];
    if (!field->places[i].mean_mm) continue;
    rows.row(static_cast<Eigen::Index>(off_mm.size()))
        << (place.point_mm - plant.surface->centroid_mm()).cross(place.normal).transpose() / 20,
        place.normal.transpose();
    off_mm.push_back(*field->places[i].mean_mm - truth_mm[i]);
  }
  const auto count = static_cast<Eigen::Index>(off_mm.size());
  Eigen::VectorXd off = Eigen::Map<const Eigen::VectorXd>(off_mm.data(), count);
  // Robustly: rims and corners, where the mean about a place is not its own, do not turn the part.
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(count);
  Eigen::VectorXd rest = off;
  for (int turn = 0; turn < 20; ++turn) {
    const Eigen::MatrixXd weighted = weights.asDiagonal() * rows.topRows(count);
    rest = off -
           rows.topRows(count) * (rows.topRows(count).transpose() * weighted).ldlt().solve(weighted.transpose() * off);
    for (Eigen::Index k = 0; k < count; ++k) weights[k] = std::abs(rest[k]) < 0.01 ? 1 : 0.01 / std::abs(rest[k]);
  }
  std::vector<double> off_um;
  for (const double d : rest) off_um.push_back(1e3 * std::abs(d));
  std::sort(off_um.begin(), off_um.end());
  const auto at = [&](double share) {
    return off_um[static_cast<std::size_t>(share * static_cast<double>(off_um.size() - 1))];
  };
  std::printf(
      "SN-0002: %zu places of %zu seen; off the truth: median %.2f um, 95 %% %.2f um, worst %.2f um; coverage %.3f\n",
      off_um.size(), truth_mm.size(), at(0.5), at(0.95), off_um.back(),
      field->whole.seen_area_mm2 / field->whole.area_mm2);
  (*figures)["casting_p95_um"] = at(0.95);
  (*figures)["casting_places"] = off_um.size();
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App app("Deviations");
  std::string shared = "../shared", peer_folder;
  std::size_t count = 10'000'000;
  app.add_option("--shared", shared);
  app.add_option("--points", count)->check(CLI::Range(10'000, 100'000'000));
  bool only_casting = false;
  app.add_flag("--only-casting", only_casting);
  app.add_option("--peer-folder", peer_folder, "Where the same points and part are left for a peer");
  CLI11_PARSE(app, argc, argv);
  if (!std::ifstream(shared + "/data/plant-a/dataset.json")) {
    std::printf("SKIPPED: no plant-a under %s\n{}\n", shared.c_str());
    return 0;
  }
  const Plant plant = Load(shared + "/data/plant-a");
  json figures;
  if (!only_casting) {
    Rates(plant, count, peer_folder, &figures);
    ThinEdges(plant, &figures);
  }
  const int compared = Casting(plant, &figures);
  std::printf("%s\n", figures.dump().c_str());
  return compared;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) { return sixpoint::bench::Main(argc, argv); }
