#include "metrology/surface/surface.h"

#include <absl/status/status.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <unordered_map>
#include <utility>

#include "metrology/parallel/loops.h"
#include "metrology/surface/cubic_patch.h"
#include "metrology/surface/near_batch.h"
#include "metrology/surface/near_cells.h"
#include "metrology/surface/sharp_edges.h"
#include "metrology/surface/triangle_tree.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kGreatestCoordinateMm = 1e7;
constexpr std::size_t kGreatestTriangleCount = 100'000'000;
// Faces that meet at less than this are not a sharp edge; corner normals that differ by less belong to one smooth face.
const double kSharpCosine = std::cos(20 * M_PI / 180);
const double kSmoothCosine = std::cos(1 * M_PI / 180);
constexpr double kNearMm = 0.1;                       // what the near cells cover: more than a converged fit reaches
constexpr std::size_t kManyPoints = 100'000;          // are worth the near cells
constexpr std::size_t kTurn = std::size_t{1} << 14;   // of them that a thread takes at a time
constexpr std::size_t kAhead = 24;                    // points fetched early
constexpr std::size_t kSlice = std::size_t{1} << 20;  // of points put in order at a time
// Steps of a foot along the patch: where the surface's radius is near the distance (a trailing edge) they shrink slowly. The
// distance is off by the square of what is left, over the radius.
constexpr int kLeastSteps = 2, kMostSteps = 12;
constexpr double kSettledMm = 2e-5;
// Nearer than this a foot is followed over its triangle's edge: it may leave the triangle by so much (barycentric) before
// it is the next one's. Farther off it stays by its triangle.
constexpr double kCurvedMm = 0.1, kOvershoot = 0.05, kFarOvershoot = 0.25, kFarthestOvershoot = 4;
constexpr int kMostCrossings = 16;

// What the border of a triangle is; bits.
enum Rim : std::uint8_t { kSmooth = 0, kCreased = 1, kSharp = 2, kOpen = 4 };

std::string At(const Vector3d& point_mm) {
  std::ostringstream text;
  text << '(' << point_mm.x() << ", " << point_mm.y() << ", " << point_mm.z() << ')';
  return text.str();
}

bool Findable(const Vector3d& query) { return query.cwiseAbs().maxCoeff() <= 1e12 && query.allFinite(); }

// The cube of space that a point lies in, about the surface's middle; points far outside share one, those nowhere another.
std::uint64_t PlaceOf(const Vector3d& query) {
  constexpr double kCubeMm = 0.5;
  constexpr std::uint64_t kAcross = 1 << 20, kOutside = std::uint64_t{1} << 62;
  if (!Findable(query)) return kOutside + 1;
  std::uint64_t place = 0;
  for (int k = 0; k < 3; ++k) {
    const double at = query[k] / kCubeMm + kAcross / 2;
    if (!(at >= 0 && at < kAcross)) return kOutside;
    place = place * kAcross + static_cast<std::uint64_t>(at);
  }
  return place;
}

struct PositionHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    std::size_t hash = 0;
    for (const double v : p) {
      std::uint64_t bits;
      std::memcpy(&bits, &v, sizeof bits);
      hash = (hash ^ (bits + 0x9e3779b97f4a7c15ULL)) * 0xff51afd7ed558ccdULL;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

}  // namespace

struct Surface::Tree {
  TriangleMesh mesh;
  Vector3d centre, minimum, maximum, centroid;
  double radius_of_gyration = 0, area = 0;
  Points vertices;  // centred
  std::unique_ptr<TriangleTree> triangles;
  mutable std::once_flag near_once;
  mutable std::unique_ptr<const NearCells> near;
  mutable std::atomic<const NearCells*> near_ready = nullptr;
  std::vector<std::uint32_t> welded;                 // vertex -> first vertex with the same position
  std::vector<Eigen::Vector3f> vertex_normals;       // angle-weighted pseudo-normals, by welded vertex
  std::vector<std::uint8_t> vertex_rims;             // by welded vertex: the union of its edges'
  std::vector<std::array<std::uint8_t, 3>> rims;     // edge i lies opposite corner i
  SharpEdges sharp;                                  // sharp and open edges
  std::vector<std::uint8_t> near_rim;                // a triangle that may reach within kEdgeReachMm of one of them
  std::vector<std::array<std::uint32_t, 3>> across;  // the triangle beyond edge i

  Vector3d FacetNormal(std::uint32_t t) const {
    const auto& c = mesh.triangles[t];
    return (vertices[c[1]] - vertices[c[0]]).cross(vertices[c[2]] - vertices[c[0]]).normalized();
  }

  void Weld();
  absl::Status FindRims();
  void FindNearRims();
  void FindMoments();
  double Volume() const;
  std::optional<CubicPatch> PatchOf(std::uint32_t t) const;
  Vector3d PseudoNormal(const TriangleTree::Nearest& nearest) const;
  double FacetDistance(const Vector3d& query, const TriangleTree::Nearest& nearest) const;
  SurfacePoint Resolve(const Vector3d& query, const TriangleTree::Nearest& nearest) const;
  double Distance(const Vector3d& query, const TriangleTree::Nearest& nearest) const;
};

void Surface::Tree::Weld() {
  std::unordered_map<std::array<double, 3>, std::uint32_t, PositionHash> first;
  first.reserve(vertices.size());
  welded.resize(vertices.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    const Vector3d p = vertices[v] + Vector3d::Zero();  // -0 becomes 0
    welded[v] = first.emplace(std::array<double, 3>{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}, v).first->second;
  }
}

absl::Status Surface::Tree::FindRims() {
  const auto& faces = mesh.triangles;
  std::vector<Vector3d> normals(faces.size());
  std::vector<Vector3d> sums(vertices.size(), Vector3d::Zero());
  struct Side {
    std::uint32_t low, high, triangle;
    std::uint8_t edge;
    bool forward;
  };
  std::vector<Side> sides;
  sides.reserve(3 * faces.size());
  for (std::uint32_t t = 0; t < faces.size(); ++t) {
    normals[t] = FacetNormal(t);
    if (!(normals[t].squaredNorm() > 0.5)) continue;  // degenerate: has no part in the topology
    for (std::uint8_t i = 0; i < 3; ++i) {
      const std::uint32_t p = welded[faces[t][(i + 1) % 3]], q = welded[faces[t][(i + 2) % 3]];
      sides.push_back({std::min(p, q), std::max(p, q), t, i, p < q});
      const Vector3d to_p = (vertices[p] - vertices[faces[t][i]]).normalized();
      const Vector3d to_q = (vertices[q] - vertices[faces[t][i]]).normalized();
      sums[welded[faces[t][i]]] += std::acos(std::clamp(to_p.dot(to_q), -1.0, 1.0)) * normals[t];
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle, a.edge) < std::tie(b.low, b.high, b.triangle, b.edge);
  });
  rims.assign(faces.size(), {kOpen, kOpen, kOpen});
  across.assign(faces.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  vertex_rims.assign(vertices.size(), kSmooth);
  std::vector<SharpEdges::Edge> sharp_edges;
  std::size_t branching = 0, open = 0;
  Vector3d branching_mm;
  for (std::size_t s = 0; s < sides.size();) {
    std::size_t e = s;
    while (e < sides.size() && sides[e].low == sides[s].low && sides[e].high == sides[s].high) ++e;
    std::uint8_t rim = kOpen;
    if (e - s == 2) {
      const Side &one = sides[s], &other = sides[s + 1];
      across[one.triangle][one.edge] = other.triangle;
      across[other.triangle][other.edge] = one.triangle;
      rim = one.forward == other.forward ? kCreased | kSharp : kSmooth;
      if (mesh.corner_normals.empty()) {
        rim |= kCreased;
        if (normals[one.triangle].dot(normals[other.triangle]) < kSharpCosine) rim |= kSharp;
      } else {
        for (const std::uint32_t vertex : {one.low, one.high}) {
          const auto at = [&](const Side& side) {
            const auto& c = faces[side.triangle];
            const int i = welded[c[0]] == vertex ? 0 : welded[c[1]] == vertex ? 1 : 2;
            return mesh.corner_normals[side.triangle][i];
          };
          const float cosine = at(one).dot(at(other));
          if (!(cosine > kSmoothCosine)) rim |= kCreased;
          if (!(cosine > kSharpCosine)) rim |= kSharp;
        }
      }
    } else if (e - s > 2) {
      if (branching++ == 0) branching_mm = centre + 0.5 * (vertices[sides[s].low] + vertices[sides[s].high]);
    } else {
      ++open;
    }
    for (std::size_t k = s; k < e; ++k) rims[sides[k].triangle][sides[k].edge] = rim;
    vertex_rims[sides[s].low] |= rim;
    vertex_rims[sides[s].high] |= rim;
    if (rim & (kSharp | kOpen))
      sharp_edges.push_back({vertices[sides[s].low], vertices[sides[s].high] - vertices[sides[s].low]});
    s = e;
  }
  if (branching > 0)
    return Refuse(
        "surface.triangles",
        std::to_string(branching) + " edges with more than two triangles, the first at " + At(branching_mm) + " mm",
        "at most two: the boundary of one body");
  // An open sheet has a side all the same, but none to be checked.
  if (open == 0 && Volume() < 0)
    return Refuse("surface.triangles", "inside out, volume " + Rounded(Volume()) + " mm3",
                  "corners counter-clockwise seen from outside");
  sharp = SharpEdges(std::move(sharp_edges));
  FindNearRims();
  vertex_normals.resize(vertices.size());
  for (std::size_t v = 0; v < sums.size(); ++v) vertex_normals[v] = sums[v].normalized().cast<float>();
  return absl::OkStatus();
}

// From the triangles that have a corner on an edge over their neighbours, as far as it reaches.
void Surface::Tree::FindNearRims() {
  const auto& faces = mesh.triangles;
  near_rim.assign(faces.size(), 0);
  std::vector<std::uint32_t> left;
  for (std::uint32_t t = 0; t < faces.size(); ++t) {
    for (const std::uint32_t v : faces[t])
      if (vertex_rims[welded[v]] & (kSharp | kOpen)) near_rim[t] = 1;
    if (near_rim[t]) left.push_back(t);
  }
  while (!left.empty()) {
    const std::uint32_t t = left.back();
    left.pop_back();
    for (const std::uint32_t beyond : across[t]) {
      if (beyond == kNoTriangle || near_rim[beyond]) continue;
      const auto& c = faces[beyond];
      const Vector3d middle = (vertices[c[0]] + vertices[c[1]] + vertices[c[2]]) / 3;
      double squared = 0;
      for (const std::uint32_t v : c) squared = std::max(squared, (vertices[v] - middle).squaredNorm());
      if (std::isinf(sharp.Distance(middle, std::sqrt(squared) + kEdgeReachMm))) continue;
      near_rim[beyond] = 1;
      left.push_back(beyond);
    }
  }
}

double Surface::Tree::Volume() const {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) six_volumes += vertices[a].dot(vertices[b].cross(vertices[c]));
  return six_volumes / 6;
}

void Surface::Tree::FindMoments() {
  double second = 0;
  Vector3d first = Vector3d::Zero();
  for (const auto& c : mesh.triangles) {
    const Vector3d &p = vertices[c[0]], &q = vertices[c[1]], &r = vertices[c[2]];
    const double a = 0.5 * (q - p).cross(r - p).norm();
    area += a;
    first += a / 3 * (p + q + r);
    second += a / 12 * (p.squaredNorm() + q.squaredNorm() + r.squaredNorm() + (p + q + r).squaredNorm());
  }
  const Vector3d middle = first / area;
  centroid = centre + middle;
  radius_of_gyration = std::sqrt(std::max(0.0, second / area - middle.squaredNorm()));
}

std::optional<CubicPatch> Surface::Tree::PatchOf(std::uint32_t t) const {
  if (mesh.corner_normals.empty()) return std::nullopt;
  const auto& c = mesh.triangles[t];
  const auto& n = mesh.corner_normals[t];
  return CubicPatch::Over({vertices[c[0]], vertices[c[1]], vertices[c[2]]},
                          {n[0].cast<double>(), n[1].cast<double>(), n[2].cast<double>()});
}

Vector3d Surface::Tree::PseudoNormal(const TriangleTree::Nearest& nearest) const {
  const std::uint32_t t = nearest.triangle;
  if (nearest.part == TrianglePart::kInside) return FacetNormal(t);
  const int index = static_cast<int>(nearest.part);
  if (index <= 3) {
    const std::uint32_t beyond = across[t][index - 1];
    const Vector3d own = FacetNormal(t);
    return beyond == kNoTriangle ? own : (own + FacetNormal(beyond)).normalized();
  }
  return vertex_normals[welded[mesh.triangles[t][index - 4]]].cast<double>();
}

// To the flat triangles. Inside of one the side of its plane decides, else the pseudo-normal.
double Surface::Tree::FacetDistance(const Vector3d& query, const TriangleTree::Nearest& nearest) const {
  const auto& corners = nearest.item->corners;  // more likely in the cache than the mesh's
  const Vector3d &a = vertices[corners[0]], ab = vertices[corners[1]] - a, ac = vertices[corners[2]] - a;
  const Vector3d from_corner = query - a;
  const bool below =
      nearest.part == TrianglePart::kInside
          ? from_corner.dot(ab.cross(ac)) < 0
          : (from_corner - nearest.barycentric[1] * ab - nearest.barycentric[2] * ac).dot(PseudoNormal(nearest)) < 0;
  const double distance = std::sqrt(nearest.distance_squared);
  return below ? -distance : distance;
}

SurfacePoint Surface::Tree::Resolve(const Vector3d& query, const TriangleTree::Nearest& nearest) const {
  SurfacePoint found;
  found.triangle = nearest.triangle;
  if (nearest.triangle == kNoTriangle) {
    found.point_mm = found.normal = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    found.signed_distance_mm = std::numeric_limits<double>::quiet_NaN();
    return found;
  }
  const std::uint32_t t = nearest.triangle;
  const auto& corners = mesh.triangles[t];
  const int index = static_cast<int>(nearest.part);
  std::uint8_t rim = kSmooth;
  if (index >= 4)
    rim = vertex_rims[welded[corners[index - 4]]];
  else if (index >= 1)
    rim = rims[t][index - 1];
  if (rim & kOpen)
    found.feature = SurfaceFeature::kBorder;
  else if (rim & kSharp)
    found.feature = SurfaceFeature::kEdge;

  const Vector3d foot = nearest.barycentric[0] * vertices[corners[0]] + nearest.barycentric[1] * vertices[corners[1]] +
                        nearest.barycentric[2] * vertices[corners[2]];
  if (found.feature == SurfaceFeature::kFace && near_rim[t])
    found.edge_distance_mm = sharp.Distance(foot, kEdgeReachMm);
  if (found.feature != SurfaceFeature::kFace) found.edge_distance_mm = 0;
  std::optional<CubicPatch> patch = rim == kSmooth ? PatchOf(t) : std::nullopt;
  if (!patch) {
    found.point_mm = centre + foot;
    found.signed_distance_mm = FacetDistance(query, nearest);
    // Very near an edge the direction to the query is noise; the pseudo-normal is not.
    found.normal = nearest.part == TrianglePart::kInside || std::abs(found.signed_distance_mm) < 1e-6
                       ? PseudoNormal(nearest)
                       : Vector3d((query - foot) / found.signed_distance_mm);
    return found;
  }
  // Slide the foot along the curved surface until the query stands on its normal: into the next triangle where the edge is
  // smooth (facets near to each other as slivers are may each be nearest to a point over another), not over a crease.
  std::uint32_t at_triangle = t;
  Vector3d barycentric = nearest.barycentric;
  const bool is_near = nearest.distance_squared < kCurvedMm * kCurvedMm;
  const int most_steps = is_near ? kMostSteps : kLeastSteps, most_crossings = is_near ? kMostCrossings : 0;
  const double overshoot = is_near ? kOvershoot : kFarOvershoot;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double least_aside = kInfinity, stride = 1;
  Vector3d last_aside = Vector3d::Zero();
  for (int step = 0, crossings = 0;; ++step) {
    const CubicPatch::Foot at = patch->At(barycentric);
    const double along = (query - at.point_mm).dot(at.normal);
    const Vector3d aside = query - at.point_mm - along * at.normal;
    // Deeper than the surface's radius the steps grow: the foot that was nearest to settling stays.
    const bool grows = !(aside.squaredNorm() < (step > kLeastSteps ? least_aside : kInfinity));
    if (!grows) {
      found.point_mm = centre + at.point_mm;
      found.normal = at.normal;
      found.signed_distance_mm = along;
      least_aside = aside.squaredNorm();
    }
    if (grows || step >= most_steps || (step >= kLeastSteps && least_aside < kSettledMm * kSettledMm)) return found;
    // A whole step goes too far by the distance over the surface's radius, which the step before tells (secant).
    if (is_near && last_aside.squaredNorm() > 0) {
      const double left = aside.dot(last_aside) / last_aside.squaredNorm();
      stride = std::clamp(stride / std::max(0.1, 1 - left), 0.05, 2.0);
    }
    last_aside = aside;
    Vector3d next = barycentric + stride * patch->BarycentricStep(aside);
    int edge;
    if (next.minCoeff(&edge) < -overshoot && crossings < most_crossings && rims[at_triangle][edge] == kSmooth) {
      const std::uint32_t beyond = across[at_triangle][edge];
      if (const std::optional<CubicPatch> its = PatchOf(beyond)) {
        // No farther than some of the triangle's widths beyond it: a cubic is not to be followed into the distance.
        barycentric = its->Barycentric(at.point_mm + stride * aside).cwiseMax(-kFarthestOvershoot);
        barycentric /= barycentric.sum();
        patch = its;
        at_triangle = beyond;
        ++crossings;
        step = -1;
        continue;
      }
    }
    for (int i = 0; i < 3; ++i) next[i] = std::max(next[i], rims[at_triangle][i] == kSmooth ? -overshoot : 0.0);
    barycentric = next / next.sum();
  }
}

double Surface::Tree::Distance(const Vector3d& query, const TriangleTree::Nearest& nearest) const {
  if (nearest.triangle == kNoTriangle || !mesh.corner_normals.empty())
    return Resolve(query, nearest).signed_distance_mm;
  return FacetDistance(query, nearest);
}

absl::StatusOr<std::shared_ptr<const Surface>> Surface::Prepare(TriangleMesh mesh) {
  if (mesh.triangles.empty()) return Refuse("surface.triangles", 0, "at least one");
  if (mesh.triangles.size() > kGreatestTriangleCount)
    return Refuse("surface.triangles", static_cast<double>(mesh.triangles.size()),
                  "at most " + std::to_string(kGreatestTriangleCount));
  if (!mesh.corner_normals.empty() && mesh.corner_normals.size() != mesh.triangles.size())
    return Refuse("surface.corner_normals", static_cast<double>(mesh.corner_normals.size()), "one entry per triangle");
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    const Vector3d& v = mesh.vertices_mm[i];
    if (!(v.cwiseAbs().maxCoeff() <= kGreatestCoordinateMm) || !v.allFinite())
      return Refuse("surface.vertices_mm[" + std::to_string(i) + "]", At(v), "finite and within 1e7 mm");
  }
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t)
      if (v >= mesh.vertices_mm.size())
        return Refuse("surface.triangles", "vertex " + std::to_string(v),
                      "less than " + std::to_string(mesh.vertices_mm.size()));
  for (const auto& normals : mesh.corner_normals)
    for (const Eigen::Vector3f& n : normals)
      if (!(std::abs(n.squaredNorm() - 1) < 1e-3f))
        return Refuse("surface.corner_normals", "a length other than 1", "unit normals");

  auto tree = std::make_unique<Tree>();
  tree->mesh = std::move(mesh);
  // Only vertices that triangles use bound the surface.
  tree->minimum = Vector3d::Constant(std::numeric_limits<double>::infinity());
  tree->maximum = -tree->minimum;
  for (const auto& t : tree->mesh.triangles)
    for (const std::uint32_t v : t) {
      tree->minimum = tree->minimum.cwiseMin(tree->mesh.vertices_mm[v]);
      tree->maximum = tree->maximum.cwiseMax(tree->mesh.vertices_mm[v]);
    }
  tree->centre = (0.5 * (tree->minimum + tree->maximum)).array().round();  // whole millimetres: exact differences
  tree->vertices.reserve(tree->mesh.vertices_mm.size());
  for (const Vector3d& v : tree->mesh.vertices_mm) tree->vertices.push_back(v - tree->centre);
  tree->triangles = std::make_unique<TriangleTree>(tree->vertices, tree->mesh.triangles);
  if (tree->triangles->empty()) return Refuse("surface.triangles", "none has an area", "at least one that has");
  tree->Weld();
  if (const absl::Status status = tree->FindRims(); !status.ok()) return status;
  tree->FindMoments();
  return std::shared_ptr<const Surface>(new Surface(std::move(tree)));
}

Surface::Surface(std::unique_ptr<const Tree> tree) : tree_(std::move(tree)) {}
Surface::~Surface() = default;

SurfacePoint Surface::Closest(const Vector3d& point_mm, std::uint32_t hint) const {
  return ClosestWithin(point_mm, std::numeric_limits<double>::infinity(), hint);
}

SurfacePoint Surface::ClosestWithin(const Vector3d& point_mm, double limit_mm, std::uint32_t hint) const {
  const Vector3d query = point_mm - tree_->centre;
  if (!Findable(query) || !(limit_mm >= 0)) return tree_->Resolve(query, {});
  return tree_->Resolve(query, tree_->triangles->Find(query, limit_mm * limit_mm, hint));
}

SurfaceCurvature Surface::CurvatureAt(const SurfacePoint& found) const {
  const Tree& tree = *tree_;
  if (found.triangle == kNoTriangle || found.feature != SurfaceFeature::kFace) return {};
  std::vector<OrientedPoint> nearby;
  const auto add = [&](std::uint32_t triangle, std::size_t corner) {
    const std::uint32_t vertex = tree.mesh.triangles[triangle][corner], welded = tree.welded[vertex];
    // A mesh without the surface's normals knows none where faces meet.
    if (tree.mesh.corner_normals.empty() && (tree.vertex_rims[welded] & (kSharp | kOpen))) return;
    const Eigen::Vector3f& normal =
        tree.mesh.corner_normals.empty() ? tree.vertex_normals[welded] : tree.mesh.corner_normals[triangle][corner];
    nearby.push_back({tree.vertices[vertex], normal.cast<double>()});
  };
  const std::uint32_t t = found.triangle;
  for (std::size_t i = 0; i < 3; ++i) add(t, i);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t beyond = tree.across[t][i];
    if (beyond == kNoTriangle || (tree.rims[t][i] & (kSharp | kOpen))) continue;
    if (!tree.mesh.corner_normals.empty() && (tree.rims[t][i] & kCreased)) continue;
    for (std::size_t k = 0; k < 3; ++k)
      if (tree.across[beyond][k] == t) add(beyond, k);
  }
  const OrientedPoint foot{found.point_mm - tree.centre, found.normal};
  if (!tree.mesh.corner_normals.empty()) nearby.push_back(foot);  // on the surface, and not a facet's
  return CurvatureFrom(nearby, foot);
}

void Surface::PrepareNear(int thread_count) const {
  std::call_once(tree_->near_once, [&] {
    tree_->near = std::make_unique<const NearCells>(*tree_->triangles, kNearMm, thread_count);
    tree_->near_ready = tree_->near.get();
  });
}

// Points in the order of the near cells; after them those of no cell, neighbours together.
class PlacedPoints {
 public:
  PlacedPoints(const Surface::Tree& tree, std::uint32_t count, Surface::Batch::PointsAt points_at, double limit_mm,
               int thread_count)
      : tree_(tree), near_(tree.near_ready.load()), points_at_(std::move(points_at)), limit_mm_(limit_mm) {
    if (near_ != nullptr) {
      const auto queries_at = [this](std::uint32_t begin, std::size_t some, Vector3d* queries) {
        std::array<std::uint32_t, NearCells::kTogether> indices;
        std::iota(indices.begin(), indices.end(), begin);
        Fetch(indices.data(), some, queries);
      };
      placed_ = PutInCells(*near_, queries_at, count, thread_count);
      in_cells_count_ = placed_.first[near_->cell_count()];
    } else {
      placed_.order.resize(count);
      std::iota(placed_.order.begin(), placed_.order.end(), 0);
    }
    if (!Far()) return;
    PutFarInPlaces(thread_count);
  }

  // take(index, query, nearest) for those at [from, to) of the order.
  template <typename Take>
  void Visit(std::size_t from, std::size_t to, const Take& take) const {
    std::optional<NearBatch> batch;
    if (near_ != nullptr) batch.emplace(*tree_.triangles, *near_);
    std::array<Vector3d, kFetched> queries;
    std::array<TriangleTree::Nearest, NearBatch::kMostPoints> nearest;
    std::uint32_t cell = 0, hint = Surface::kNoTriangle;
    if (near_ != nullptr)
      cell = static_cast<std::uint32_t>(std::upper_bound(placed_.first.begin(), placed_.first.end(), from) -
                                        placed_.first.begin()) -
             1;
    for (std::size_t fetched = from; fetched < to; fetched += kFetched) {
      const std::size_t end = std::min(to, fetched + kFetched);
      Fetch(&placed_.order[fetched], end - fetched, queries.data());
      for (std::size_t at = fetched; at < end;) {
        const Vector3d* here = &queries[at - fetched];
        std::size_t count = std::min(end - at, NearBatch::kMostPoints);
        if (at < in_cells_count_) {
          while (placed_.first[cell + 1] <= at) ++cell;
          count = std::min<std::size_t>(count, placed_.first[cell + 1] - at);
        } else if (Far()) {
          const std::uint64_t place = PlaceOf(here[0]);
          count = static_cast<std::size_t>(
              std::find_if(here + 1, here + count, [&](const Vector3d& q) { return PlaceOf(q) != place; }) - here);
        }
        std::fill(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(count), TriangleTree::Nearest{});
        if (at < in_cells_count_) {
          if (limit_mm_ >= 0) batch->Find(cell, here, count, limit_mm_ * limit_mm_, nearest.data());
        } else if (Far() && limit_mm_ >= 0 && Findable(here[0])) {
          FindFar(here, count, hint, batch.has_value() ? &*batch : nullptr, nearest.data());
        }
        if (nearest[count - 1].triangle != Surface::kNoTriangle) hint = nearest[count - 1].triangle;
        for (std::size_t i = 0; i < count; ++i) take(placed_.order[at + i], here[i], nearest[i]);
        at += count;
      }
    }
  }

 private:
  static constexpr std::size_t kFetched = 1024;  // points asked for at a time: the processor waits for many at once

  // Neighbours together: by place, then by index.
  void PutFarInPlaces(int thread_count) {
    using Placed = std::pair<std::uint64_t, std::uint32_t>;
    std::vector<Placed> outside(placed_.order.size() - in_cells_count_);
    const std::size_t parts = PartCount(thread_count);
    InParts(outside.size(), thread_count, [&](std::size_t begin, std::size_t end, std::size_t) {
      std::array<Vector3d, kFetched> queries;
      for (std::size_t k = begin; k < end; k += kFetched) {
        const std::size_t some = std::min(kFetched, end - k);
        const std::uint32_t* indices = &placed_.order[in_cells_count_ + k];
        Fetch(indices, some, queries.data());
        for (std::size_t i = 0; i < some; ++i) outside[k + i] = {PlaceOf(queries[i]), indices[i]};
      }
      std::sort(outside.begin() + static_cast<std::ptrdiff_t>(begin),
                outside.begin() + static_cast<std::ptrdiff_t>(end));
    });
    for (std::size_t part = 1; part < parts; ++part) {
      const auto at = [&](std::size_t p) {
        return outside.begin() + static_cast<std::ptrdiff_t>(outside.size() * p / parts);
      };
      std::inplace_merge(outside.begin(), at(part), at(part + 1));
    }
    for (std::size_t k = 0; k < outside.size(); ++k) placed_.order[in_cells_count_ + k] = outside[k].second;
  }

  void FindFar(const Vector3d* queries, std::size_t count, std::uint32_t hint, NearBatch* batch,
               TriangleTree::Nearest* nearest) const {
    const double limit_squared = limit_mm_ * limit_mm_;
    if (batch != nullptr) return batch->FindAround(queries, count, limit_squared, hint, nearest);
    tree_.triangles->FindEach(queries, count, limit_squared, hint, nearest);
  }

  void Fetch(const std::uint32_t* indices, std::size_t count, Vector3d* queries) const {
    points_at_(indices, count, queries);
    for (std::size_t i = 0; i < count; ++i) queries[i] -= tree_.centre;
  }
  // Points of no cell may have the surface within the limit.
  bool Far() const { return near_ == nullptr || !(limit_mm_ <= near_->covered_mm()); }

  const Surface::Tree& tree_;
  const NearCells* near_;
  const Surface::Batch::PointsAt points_at_;
  const double limit_mm_;
  CellOrder placed_;
  std::size_t in_cells_count_ = 0;
};

Surface::Batch::Batch(const Surface& surface, std::uint32_t count, PointsAt points_at, double limit_mm,
                      int thread_count)
    : tree_(*surface.tree_),
      placed_(std::make_unique<PlacedPoints>(*surface.tree_, count, std::move(points_at), limit_mm, thread_count)) {}
Surface::Batch::~Batch() = default;

void Surface::Batch::Visit(std::size_t from, std::size_t to,
                           const std::function<void(std::uint32_t, const SurfacePoint&)>& take) const {
  placed_->Visit(from, to, [&](std::uint32_t index, const Vector3d& query, const TriangleTree::Nearest& nearest) {
    take(index, tree_.Resolve(query, nearest));
  });
}

void Surface::SignedDistances(const Points& points_mm, double limit_mm, int thread_count,
                              std::vector<double>* distances_mm) const {
  distances_mm->resize(points_mm.size());
  if (points_mm.size() >= kManyPoints) PrepareNear(thread_count);
  for (std::size_t begin = 0; begin < points_mm.size(); begin += kSlice) {
    const std::size_t count = std::min(kSlice, points_mm.size() - begin);
    const auto points_at = [&](const std::uint32_t* indices, std::size_t some, Vector3d* fetched) {
      for (std::size_t i = 0; i < some; ++i) {
        if (i + kAhead < some) __builtin_prefetch(&points_mm[begin + indices[i + kAhead]]);
        fetched[i] = points_mm[begin + indices[i]];
      }
    };
    const PlacedPoints placed(*tree_, static_cast<std::uint32_t>(count), points_at, limit_mm, thread_count);
    // Points far off come last and take longer.
    ForEachChunk(count, kTurn, thread_count, [&](std::size_t, std::size_t from, std::size_t to) {
      placed.Visit(from, to, [&](std::uint32_t index, const Vector3d& query, const TriangleTree::Nearest& nearest) {
        (*distances_mm)[begin + index] = tree_->Distance(query, nearest);
      });
    });
  }
}

std::size_t Surface::memory_bytes() const {
  const Tree& tree = *tree_;
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  const NearCells* near = tree.near_ready.load();
  return of(tree.mesh.vertices_mm) + of(tree.mesh.triangles) + of(tree.mesh.corner_normals) + of(tree.mesh.faces) +
         of(tree.vertices) + of(tree.welded) + of(tree.vertex_normals) + of(tree.vertex_rims) + of(tree.rims) +
         of(tree.near_rim) + of(tree.across) + tree.sharp.memory_bytes() + tree.triangles->memory_bytes() +
         (near == nullptr ? 0 : near->memory_bytes());
}

const TriangleMesh& Surface::mesh() const { return tree_->mesh; }
Vector3d Surface::minimum_mm() const { return tree_->minimum; }
Vector3d Surface::maximum_mm() const { return tree_->maximum; }
Vector3d Surface::centroid_mm() const { return tree_->centroid; }
double Surface::radius_of_gyration_mm() const { return tree_->radius_of_gyration; }
std::size_t Surface::degenerate_triangle_count() const {
  return tree_->mesh.triangles.size() - tree_->triangles->items().size();
}
double Surface::area_mm2() const { return tree_->area; }

}  // namespace sixpoint::metrology
