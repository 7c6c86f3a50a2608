#include "metrology/surface/surface.h"

#include <absl/status/status.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "metrology/mesh/volume.h"
#include "metrology/nearest/nearest_search.h"
#include "metrology/parallel/loops.h"
#include "metrology/surface/curved_foot.h"
#include "metrology/surface/gap_zone.h"
#include "metrology/surface/seams.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kGreatestTriangleCount = 100'000'000;
constexpr std::size_t kTurn = std::size_t{1} << 14;   // of them that a thread takes at a time
constexpr std::size_t kSlice = std::size_t{1} << 20;  // of points put in order at a time
constexpr double kNoiseMm = 1e-6;  // nearer to an edge than this, the direction to the query is noise

absl::Status CheckTriangles(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return Refuse("surface.triangles", 0, "at least one");
  if (mesh.triangles.size() > kGreatestTriangleCount)
    return Refuse("surface.triangles", static_cast<double>(mesh.triangles.size()),
                  "at most " + std::to_string(kGreatestTriangleCount));
  for (const TriangleCorners& corners : mesh.triangles)
    for (const std::uint32_t v : corners)
      if (v >= mesh.vertices_mm.size())
        return Refuse("surface.triangles", "vertex " + std::to_string(v),
                      "less than " + std::to_string(mesh.vertices_mm.size()));
  return absl::OkStatus();
}

absl::Status CheckVertices(const Points& vertices_mm) {
  for (std::size_t i = 0; i < vertices_mm.size(); ++i) {
    const Vector3d& v = vertices_mm[i];
    if (v.cwiseAbs().maxCoeff() <= kGreatestCoordinateMm && v.allFinite()) continue;
    std::ostringstream found;
    found << '(' << v.x() << ", " << v.y() << ", " << v.z() << ')';
    return Refuse("surface.vertices_mm[" + std::to_string(i) + "]", found.str(), "finite and within 1e7 mm");
  }
  return absl::OkStatus();
}

absl::Status CheckNormals(const TriangleMesh& mesh) {
  if (!mesh.corner_normals.empty() && mesh.corner_normals.size() != mesh.triangles.size())
    return Refuse("surface.corner_normals", static_cast<double>(mesh.corner_normals.size()), "one entry per triangle");
  for (const auto& normals : mesh.corner_normals)
    for (const Eigen::Vector3f& n : normals)
      if (!(std::abs(n.squaredNorm() - 1) < 1e-3f))
        return Refuse("surface.corner_normals", "a length other than 1", "unit normals");
  return absl::OkStatus();
}

absl::Status Check(const TriangleMesh& mesh) {
  if (absl::Status status = CheckTriangles(mesh); !status.ok()) return status;
  if (absl::Status status = CheckVertices(mesh.vertices_mm); !status.ok()) return status;
  return CheckNormals(mesh);
}

Points About(const Vector3d& middle_mm, const Points& points_mm) {
  Points about;
  about.reserve(points_mm.size());
  for (const Vector3d& p : points_mm) about.push_back(p - middle_mm);
  return about;
}

}  // namespace

struct Surface::Parts {
  explicit Parts(TriangleMesh given)
      : mesh(std::move(given)),
        bounds_mm(BoundsOf(mesh)),
        middle_mm((0.5 * (bounds_mm.min() + bounds_mm.max())).array().round()),
        vertices_mm(About(middle_mm, mesh.vertices_mm)),
        search(vertices_mm, mesh.triangles),
        seams(mesh, vertices_mm),
        curved(mesh, vertices_mm, seams),
        gaps(mesh),
        moments(MomentsOf(vertices_mm, mesh.triangles)) {}

  // Queries are about the middle.
  double FacetDistance(const Vector3d& query, const NearestTriangle& nearest) const;
  // On a smooth place of a curved surface.
  bool MayHaveFoot(const NearestTriangle& nearest) const {
    return nearest.triangle != kNoTriangle && curved.IsCurved() && seams.SeamAt(nearest) == kSmooth;
  }
  // Of those that may have one; `found` is up to kTogether long, as they are found together.
  static constexpr std::size_t kTogether = NearestSearch::Many::kMostFound;
  using Feet = std::array<std::optional<CurvedFoot>, kTogether>;
  void FindFeet(const Vector3d* queries, const NearestTriangle* nearest, std::size_t count, FootFinder* finder,
                std::optional<CurvedFoot>* feet) const;
  SurfacePoint Resolve(const Vector3d& query, const NearestTriangle& nearest,
                       const std::optional<CurvedFoot>& curved_foot) const;
  SurfacePoint Resolve(const Vector3d& query, const NearestTriangle& nearest) const;

  TriangleMesh mesh;
  Eigen::AlignedBox3d bounds_mm;
  Vector3d middle_mm;  // whole millimetres: exact differences
  Points vertices_mm;  // about the middle
  NearestSearch search;
  Seams seams;
  CurvedSurface curved;
  GapZone gaps;  // part frame
  SurfaceMoments moments;
};

// To the flat triangles. Inside of one the side of its plane decides, else the pseudo-normal.
double Surface::Parts::FacetDistance(const Vector3d& query, const NearestTriangle& nearest) const {
  if (nearest.triangle == kNoTriangle) return std::numeric_limits<double>::quiet_NaN();
  const TriangleCorners& corners = nearest.item->corners;  // more likely in the cache than the mesh's
  const Vector3d &a = vertices_mm[corners[0]], ab = vertices_mm[corners[1]] - a, ac = vertices_mm[corners[2]] - a;
  const Vector3d from_corner = query - a;
  const bool below =
      nearest.part == TrianglePart::kInside
          ? from_corner.dot(ab.cross(ac)) < 0
          : (from_corner - nearest.barycentric[1] * ab - nearest.barycentric[2] * ac).dot(seams.PseudoNormal(nearest)) <
                0;
  const double distance = std::sqrt(nearest.distance_squared);
  return below ? -distance : distance;
}

void Surface::Parts::FindFeet(const Vector3d* queries, const NearestTriangle* nearest, std::size_t count,
                              FootFinder* finder, std::optional<CurvedFoot>* feet) const {
  for (std::size_t i = 0; i < count; ++i) feet[i].reset();
  if (!curved.IsCurved()) return;
  for (std::size_t i = 0; i < count; ++i)
    if (nearest[i].triangle != kNoTriangle) curved.Prefetch(nearest[i].triangle);
  std::array<std::uint32_t, kTogether> smooth;
  std::size_t smooth_count = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (MayHaveFoot(nearest[i])) smooth[smooth_count++] = i;
  }
  finder->Find(queries, nearest, smooth.data(), smooth_count, feet);
}

SurfacePoint Surface::Parts::Resolve(const Vector3d& query, const NearestTriangle& nearest,
                                     const std::optional<CurvedFoot>& curved_foot) const {
  SurfacePoint found;
  found.triangle = nearest.triangle;
  if (nearest.triangle == kNoTriangle) {
    found.point_mm = found.normal = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    found.signed_distance_mm = std::numeric_limits<double>::quiet_NaN();
    return found;
  }
  const std::uint8_t seam = seams.SeamAt(nearest);
  if (seam & kOpen)
    found.feature = SurfaceFeature::kBorder;
  else if (seam & kSharp)
    found.feature = SurfaceFeature::kEdge;
  const TriangleCorners& corners = nearest.item->corners;  // more likely in the cache than the mesh's
  const Vector3d foot = nearest.barycentric[0] * vertices_mm[corners[0]] +
                        nearest.barycentric[1] * vertices_mm[corners[1]] +
                        nearest.barycentric[2] * vertices_mm[corners[2]];
  found.edge_distance_mm = found.feature == SurfaceFeature::kFace ? seams.EdgeDistance(nearest.triangle, foot) : 0;
  if (curved_foot) {
    found.point_mm = middle_mm + curved_foot->point_mm;
    found.normal = curved_foot->normal;
    found.signed_distance_mm = curved_foot->signed_distance_mm;
    return found;
  }
  found.point_mm = middle_mm + foot;
  found.signed_distance_mm = FacetDistance(query, nearest);
  found.normal = nearest.part == TrianglePart::kInside || std::abs(found.signed_distance_mm) < kNoiseMm
                     ? seams.PseudoNormal(nearest)
                     : Vector3d((query - foot) / found.signed_distance_mm);
  return found;
}

SurfacePoint Surface::Parts::Resolve(const Vector3d& query, const NearestTriangle& nearest) const {
  return Resolve(query, nearest, MayHaveFoot(nearest) ? curved.FootOf(query, nearest) : std::nullopt);
}

absl::StatusOr<std::shared_ptr<const Surface>> Surface::Prepare(TriangleMesh mesh) {
  if (absl::Status status = Check(mesh); !status.ok()) return status;
  auto parts = std::make_unique<Parts>(std::move(mesh));
  if (parts->search.triangle_count() == 0)
    return Refuse("surface.triangles", "none has an area", "at least one that has");
  if (absl::Status status = parts->seams.Find(parts->middle_mm); !status.ok()) return status;
  return std::shared_ptr<const Surface>(new Surface(std::move(parts)));
}

Surface::Surface(std::unique_ptr<const Parts> parts) : parts_(std::move(parts)) {}
Surface::~Surface() = default;

SurfacePoint Surface::Closest(const Vector3d& point_mm, std::uint32_t hint) const {
  return ClosestWithin(point_mm, std::numeric_limits<double>::infinity(), hint);
}

SurfacePoint Surface::ClosestWithin(const Vector3d& point_mm, double limit_mm, std::uint32_t hint) const {
  const Vector3d query = point_mm - parts_->middle_mm;
  return parts_->Resolve(query, parts_->search.Find(query, limit_mm, hint));
}

bool Surface::Meets(const Vector3d& from_mm, const Vector3d& to_mm) const {
  return parts_->search.Meets(from_mm - parts_->middle_mm, to_mm - parts_->middle_mm);
}

void Surface::PrepareNear(int thread_count) const { parts_->search.PrepareNear(thread_count); }

struct Surface::Batch::Search {
  Search(const Parts& parts, std::uint32_t count, PointsAt points_at, double limit_mm, int thread_count)
      : many(
            parts.search, count,
            [&parts, points_at = std::move(points_at)](const std::uint32_t* indices, std::size_t some,
                                                       Vector3d* points) {
              points_at(indices, some, points);
              for (std::size_t i = 0; i < some; ++i) points[i] -= parts.middle_mm;
            },
            limit_mm, thread_count) {}
  const NearestSearch::Many many;
};

Surface::Batch::Batch(const Surface& surface, std::uint32_t count, PointsAt points_at, double limit_mm,
                      int thread_count)
    : parts_(*surface.parts_),
      search_(std::make_unique<const Search>(*surface.parts_, count, std::move(points_at), limit_mm, thread_count)) {}
Surface::Batch::~Batch() = default;

void Surface::Batch::Visit(std::size_t from, std::size_t to,
                           const std::function<void(std::uint32_t, const SurfacePoint&)>& take) const {
  Parts::Feet feet;
  FootFinder finder(parts_.curved);
  search_->many.Visit(from, to, [&](const NearestSearch::Many::Found& found) {
    parts_.FindFeet(found.points_mm, found.nearest, found.count, &finder, feet.data());
    for (std::size_t i = 0; i < found.count; ++i)
      take(found.indices[i], parts_.Resolve(found.points_mm[i], found.nearest[i], feet[i]));
  });
}

void Surface::SignedDistances(const Points& points_mm, double limit_mm, int thread_count,
                              std::vector<double>* distances_mm) const {
  distances_mm->resize(points_mm.size());
  for (std::size_t begin = 0; begin < points_mm.size(); begin += kSlice) {
    const std::size_t count = std::min(kSlice, points_mm.size() - begin);
    const auto points_at = [&](const std::uint32_t* indices, std::size_t some, Vector3d* fetched) {
      for (std::size_t i = 0; i < some; ++i) {
        if (i + Batch::kPointsAhead < some) __builtin_prefetch(&points_mm[begin + indices[i + Batch::kPointsAhead]]);
        fetched[i] = points_mm[begin + indices[i]] - parts_->middle_mm;
      }
    };
    const NearestSearch::Many many(parts_->search, static_cast<std::uint32_t>(count), points_at, limit_mm,
                                   thread_count);
    // Points far off come last and take longer.
    ForEachChunk(count, kTurn, thread_count, [&](std::size_t, std::size_t from, std::size_t to) {
      Parts::Feet feet;
      FootFinder finder(parts_->curved);
      many.Visit(from, to, [&](const NearestSearch::Many::Found& found) {
        parts_->FindFeet(found.points_mm, found.nearest, found.count, &finder, feet.data());
        for (std::size_t i = 0; i < found.count; ++i)
          (*distances_mm)[begin + found.indices[i]] =
              feet[i] ? feet[i]->signed_distance_mm : parts_->FacetDistance(found.points_mm[i], found.nearest[i]);
      });
    });
  }
}

std::size_t Surface::memory_bytes() const {
  const TriangleMesh& mesh = parts_->mesh;
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  return of(mesh.vertices_mm) + of(mesh.triangles) + of(mesh.corner_normals) + of(mesh.faces) +
         of(parts_->vertices_mm) + parts_->seams.memory_bytes() + parts_->search.memory_bytes() +
         of(mesh.face_gaps_mm) + parts_->gaps.memory_bytes();
}

double Surface::GapNear(const Vector3d& point_mm) const { return parts_->gaps.At(point_mm); }
bool Surface::HasGaps() const { return !parts_->gaps.empty(); }

const TriangleMesh& Surface::mesh() const { return parts_->mesh; }
Vector3d Surface::minimum_mm() const { return parts_->bounds_mm.min(); }
Vector3d Surface::maximum_mm() const { return parts_->bounds_mm.max(); }
Vector3d Surface::centroid_mm() const { return parts_->middle_mm + parts_->moments.centroid_mm; }
double Surface::radius_of_gyration_mm() const { return parts_->moments.radius_of_gyration_mm; }
double Surface::area_mm2() const { return parts_->moments.area_mm2; }
std::size_t Surface::degenerate_triangle_count() const {
  return parts_->mesh.triangles.size() - parts_->search.triangle_count();
}

}  // namespace sixpoint::metrology
