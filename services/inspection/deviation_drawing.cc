#include "services/inspection/deviation_drawing.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "report/colour_scale.h"

namespace sixpoint::inspection {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostPieces = 1'000'000;
constexpr double kLevel = 0.9;            // of a normal's z: hardly to be seen from a side
constexpr double kWorthLevelSides = 0.2;  // of what was seen

struct Corner {
  std::uint32_t vertex = 0;
  Vector3d point_mm, normal;
};
using Piece = std::array<Corner, 3>;

Piece PieceOf(const metrology::TriangleMesh& mesh, std::size_t triangle) {
  Piece piece;
  for (std::size_t k = 0; k < 3; ++k) {
    piece[k].vertex = mesh.triangles[triangle][k];
    piece[k].point_mm = mesh.vertices_mm[piece[k].vertex];
  }
  const Vector3d flat =
      (piece[1].point_mm - piece[0].point_mm).cross(piece[2].point_mm - piece[0].point_mm).stableNormalized();
  for (std::size_t k = 0; k < 3; ++k)
    piece[k].normal = mesh.corner_normals.empty() ? flat : Vector3d(mesh.corner_normals[triangle][k].cast<double>());
  return piece;
}

std::array<float, 3> Vertex(const Vector3d& point_mm) {
  return {static_cast<float>(point_mm.x()), static_cast<float>(point_mm.y()), static_cast<float>(point_mm.z())};
}

// Halves a triangle across its longest edge until no edge is longer.
class Splitter {
 public:
  Splitter(const metrology::SurfacePatches& patches, double longest_mm, report::DeviationSurface* out)
      : patches_(patches), longest_mm_(longest_mm), out_(out) {}

  // False: there would be too many.
  bool Add(const Piece& whole, std::size_t most) {
    std::vector<Piece> open = {whole};
    while (!open.empty()) {
      const Piece piece = open.back();
      open.pop_back();
      std::size_t longest = 0;
      double length_mm = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double one_mm = (piece[(k + 1) % 3].point_mm - piece[k].point_mm).norm();
        if (one_mm > length_mm) length_mm = one_mm, longest = k;
      }
      if (!(length_mm > longest_mm_)) {
        if (out_->triangles.size() >= most) return false;
        Keep(piece);
        continue;
      }
      const Corner &from = piece[longest], &to = piece[(longest + 1) % 3], &apex = piece[(longest + 2) % 3];
      const Corner middle{static_cast<std::uint32_t>(out_->vertices_mm.size()), (from.point_mm + to.point_mm) / 2,
                          (from.normal + to.normal) / 2};
      out_->vertices_mm.push_back(Vertex(middle.point_mm));
      open.push_back({middle, to, apex});
      open.push_back({from, middle, apex});
    }
    return true;
  }

 private:
  void Keep(const Piece& piece) {
    out_->triangles.push_back({piece[0].vertex, piece[1].vertex, piece[2].vertex});
    const Vector3d middle_mm = (piece[0].point_mm + piece[1].point_mm + piece[2].point_mm) / 3;
    std::uint32_t patch = patches_.Of(patches_.KeyOf(middle_mm, piece[0].normal + piece[1].normal + piece[2].normal));
    // So small a part of a cell that no sample of the surface fell there: as what lies beside it.
    for (const Corner& corner : piece)
      if (patch == metrology::SurfacePatches::kNone)
        patch = patches_.Of(patches_.KeyOf(corner.point_mm, corner.normal));
    const auto count = static_cast<std::uint32_t>(patches_.patches().size());
    out_->deviation_of.push_back(std::min(patch, count));  // the last: not seen
  }

  const metrology::SurfacePatches& patches_;
  const double longest_mm_;
  report::DeviationSurface* const out_;
};

// The four sides of a blade that stands; of a part that was seen from above or below, too, those besides.
std::vector<report::Side> SidesFor(const metrology::SurfacePatches& patches, const std::vector<double>& means_um) {
  double seen_mm2 = 0, level_mm2 = 0;
  for (std::size_t i = 0; i < means_um.size(); ++i) {
    const metrology::SurfacePatch& patch = patches.patches()[i];
    if (std::isnan(means_um[i])) continue;
    seen_mm2 += patch.area_mm2;
    if (std::abs(patch.normal.z()) > kLevel) level_mm2 += patch.area_mm2;
  }
  std::vector<report::Side> sides = report::PictureOptions().sides;
  if (level_mm2 > kWorthLevelSides * seen_mm2) sides.insert(sides.end(), {report::Side::kTop, report::Side::kBottom});
  return sides;
}

}  // namespace

report::DeviationSurface DeviationSurfaceOf(const metrology::Surface& surface, const metrology::SurfacePatches& patches,
                                            const std::vector<double>& means_um) {
  const metrology::TriangleMesh& mesh = surface.mesh();
  report::DeviationSurface out;
  for (const double um : means_um) out.deviations_um.push_back(static_cast<float>(um));
  out.deviations_um.push_back(std::numeric_limits<float>::quiet_NaN());
  // Each try is twice as coarse; one as coarse as the surface ends it.
  const std::size_t most = std::max(kMostPieces, mesh.triangles.size());
  for (double longest_mm = patches.patch_mm() / 2;; longest_mm *= 2) {
    out.vertices_mm.clear();
    out.triangles.clear();
    out.deviation_of.clear();
    for (const Vector3d& point_mm : mesh.vertices_mm) out.vertices_mm.push_back(Vertex(point_mm));
    Splitter splitter(patches, longest_mm, &out);
    bool all = true;
    for (std::size_t t = 0; all && t < mesh.triangles.size(); ++t) all = splitter.Add(PieceOf(mesh, t), most);
    if (all) return out;
  }
}

absl::StatusOr<report::DeviationPicture> DrawMap(const metrology::Surface& surface, const v1::DeviationMap& map,
                                                 const std::vector<double>& means_um) {
  const auto patches = metrology::SurfacePatches::Make(surface, map.patch_mm());
  if (!patches.ok()) return patches.status();
  if (patches->patches().size() != means_um.size())
    return absl::DataLossError(map.name() + ": " + std::to_string(means_um.size()) + " patches, want " +
                               std::to_string(patches->patches().size()) + " as its part's surface has");
  report::PictureOptions options;
  options.sides = SidesFor(*patches, means_um);
  if (map.statistics_size() > 0 && map.statistics(0).has_p05_um()) {
    const v1::DeviationStatistics& whole = map.statistics(0);
    // As the page first shows it.
    options.scale_um =
        report::RoundScale(std::max(1.0, 1.25 * std::max(std::abs(whole.p05_um()), std::abs(whole.p95_um()))));
    options.band_um = options.scale_um / 5;
  }
  return report::DrawDeviation(DeviationSurfaceOf(surface, *patches, means_um), options);
}

}  // namespace sixpoint::inspection
