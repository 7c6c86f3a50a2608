// The cases as shared/tools/registration_cases.py makes them: the same mesh and displacement, the same bounds as far as
// other draws allow, and our fit on its files.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "bench/registration/runs.h"
#include "metrology/mesh/stl.h"

namespace sixpoint::bench {
namespace {

constexpr std::size_t kGeneratedPoints = 200'000;
// A vertex at 45 mm is a float to 4 nm; sines that differ in a last bit may round it the other way.
constexpr double kGreatestMeshDifferenceMm = 4e-6;
// Of a bound: information is a mean over so many random points; the weakly held span of A hangs on few of them.
constexpr double kGreatestBoundDifference = 0.03;

std::string Bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Doubles after the header's end, as the generator writes them.
metrology::Points ReadPly(const std::filesystem::path& path) {
  const std::string bytes = Bytes(path);
  const std::string end = "end_header\n";
  const std::size_t begin = bytes.find(end);
  metrology::Points points;
  if (begin == std::string::npos) return points;
  points.resize((bytes.size() - begin - end.size()) / sizeof(Eigen::Vector3d));
  std::copy_n(bytes.data() + begin + end.size(), points.size() * sizeof(Eigen::Vector3d),
              reinterpret_cast<char*>(points.data()));
  return points;
}

double GreatestCornerDifferenceMm(const Blade& blade, const metrology::TriangleMesh& other) {
  if (other.triangles.size() != blade.mesh.triangles.size()) return std::numeric_limits<double>::infinity();
  double greatest = 0;
  for (std::size_t t = 0; t < other.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      greatest = std::max(
          greatest, (blade.mesh.vertices_mm[blade.mesh.triangles[t][k]] - other.vertices_mm[other.triangles[t][k]])
                        .lpNorm<Eigen::Infinity>());
  return greatest;
}

void Check(bool holds, const char* what, Figures* figures) {
  if (holds) return;
  ++figures->failures;
  std::printf("  FAILED: %s\n", what);
}

}  // namespace

void RunGenerator(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  const std::filesystem::path tool = std::filesystem::path(options.shared) / "tools/registration_cases.py";
  if (options.shared.empty() || !std::filesystem::exists(tool)) {
    std::printf("\ngenerator: SKIPPED, no %s\n", tool.c_str());
    return;
  }
  std::string folder = (std::filesystem::temp_directory_path() / "registration_cases.XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    Check(false, "no folder for the generator's files", figures);
    return;
  }
  const std::string command = "/usr/bin/python3 '" + tool.string() + "' '" + folder + "' --points " +
                              std::to_string(kGeneratedPoints) + " > /dev/null";
  if (std::system(command.c_str()) != 0) {
    Check(false, command.c_str(), figures);
    return;
  }
  const auto mesh = metrology::ReadStl(Bytes(folder + "/mesh.stl"), 1);
  const auto truth = nlohmann::json::parse(Bytes(folder + "/truth.json"));
  const double mesh_mm =
      mesh.ok() ? GreatestCornerDifferenceMm(prepared.blade, *mesh) : std::numeric_limits<double>::infinity();
  double pose_difference = 0;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      pose_difference = std::max(
          pose_difference,
          std::abs(
              truth["scan_from_part"][static_cast<std::size_t>(row)][static_cast<std::size_t>(column)].get<double>() -
              ScanFromPart().matrix()(row, column)));
  std::printf("\ngenerator: %s: corners differ by at most %.3g mm, poses by %.3g\n", tool.filename().c_str(), mesh_mm,
              pose_difference);
  Check(mesh_mm <= kGreatestMeshDifferenceMm, "the mesh is another", figures);
  Check(pose_difference < 1e-14, "scan_from_part is another", figures);
  figures->values["generator_mesh_difference_um"] = 1e3 * mesh_mm;
  for (const char* name : {"A", "C", "D"}) {
    const bool bumped = name[0] == 'D';
    std::optional<Bump> bump;
    if (bumped) bump = Bump();
    const CaseScan scan = MakeScan(prepared.blade, name[0] == 'A' ? CaseKind::kOneSide : CaseKind::kWellHeld,
                                   kGeneratedPoints, kNoiseMm, bump, 1);
    const double bound_um = truth["cases"][name]["bound_vertex_rms_um"].get<double>();
    const TimedFit timed = FitPortion(prepared, PortionOf(ReadPly(folder + "/case_" + name + ".ply")), options.threads);
    const double error_um = VertexDisplacementUm(prepared.blade, timed.stopped_at, ScanFromPart());
    std::printf("  %s   bound %.4f um, its %.4f   fit of its points: error %.4f um\n", name, scan.vertex_bound_um,
                bound_um, error_um);
    Check(std::abs(scan.vertex_bound_um / bound_um - 1) < kGreatestBoundDifference, "the bound is another", figures);
    Check(timed.converged, timed.remark.c_str(), figures);
    figures->values[std::string("generator_") + name + "_bound_ratio"] = scan.vertex_bound_um / bound_um;
    figures->values[std::string("generator_") + name + "_error_over_bound"] = error_um / bound_um;
  }
  std::filesystem::remove_all(folder);
}

}  // namespace sixpoint::bench
