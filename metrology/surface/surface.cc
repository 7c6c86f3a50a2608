#include "metrology/surface/surface.h"

#include <absl/status/status.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "metrology/surface/near_cells.h"
#include "metrology/surface/triangle_tree.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kGreatestCoordinateMm = 1e7;
constexpr std::size_t kGreatestTriangleCount = 100'000'000;
// Faces that meet at less than this are not a sharp edge; corner normals that differ by less belong to one smooth face.
const double kSharpCosine = std::cos(20 * M_PI / 180);
const double kSmoothCosine = std::cos(1 * M_PI / 180);
constexpr double kLeastNormalAgreement = 0.2;
constexpr double kGreatestHeightRatio = 0.1;  // of the patch's height to the triangle's longest edge
constexpr double kNearMm = 0.05;              // what the near cells cover: more than a converged fit reaches
constexpr double kOvershoot = 0.25;           // a foot may leave its triangle by this much (barycentric)

// What the border of a triangle is; bits.
enum Rim : std::uint8_t { kSmooth = 0, kCreased = 1, kSharp = 2, kOpen = 4 };

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

// The true surface over a triangle: a cubic height field over its plane, which has the given normals at the corners.
struct Patch {
  Vector3d corner, unit_normal;
  Vector3d dual_1, dual_2;  // barycentric coordinates 1 and 2 of x: dual . (x - corner)
  Vector3d edge_1, edge_2;
  std::array<double, 7> height;  // Bezier: 001 011 | 112 122 | 220 200 pairs, then the middle

  double Height(const Vector3d& b, double* slope_1, double* slope_2) const {
    const double b0 = b[0], b1 = b[1], b2 = b[2];
    const auto& h = height;
    const double d0 =
        3 * (2 * b0 * b1 * h[0] + b1 * b1 * h[1] + b2 * b2 * h[4] + 2 * b0 * b2 * h[5] + 2 * b1 * b2 * h[6]);
    const double d1 =
        3 * (b0 * b0 * h[0] + 2 * b0 * b1 * h[1] + 2 * b1 * b2 * h[2] + b2 * b2 * h[3] + 2 * b0 * b2 * h[6]);
    const double d2 =
        3 * (b1 * b1 * h[2] + 2 * b1 * b2 * h[3] + 2 * b2 * b0 * h[4] + b0 * b0 * h[5] + 2 * b0 * b1 * h[6]);
    *slope_1 = d1 - d0;
    *slope_2 = d2 - d0;
    return 3 * (b0 * b0 * b1 * h[0] + b0 * b1 * b1 * h[1] + b1 * b1 * b2 * h[2] + b1 * b2 * b2 * h[3] +
                b2 * b2 * b0 * h[4] + b2 * b0 * b0 * h[5] + 2 * b0 * b1 * b2 * h[6]);
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
  std::vector<std::uint8_t> near_rim;                // a triangle with a sharp or open edge or corner
  std::vector<std::array<std::uint32_t, 3>> across;  // the triangle beyond edge i

  Vector3d FacetNormal(std::uint32_t t) const {
    const auto& c = mesh.triangles[t];
    return (vertices[c[1]] - vertices[c[0]]).cross(vertices[c[2]] - vertices[c[0]]).normalized();
  }

  void Weld();
  void FindRims();
  void FindMoments();
  std::optional<Patch> PatchOf(std::uint32_t t) const;
  Vector3d PseudoNormal(const TriangleTree::Nearest& nearest) const;
  double EdgeDistance(std::uint32_t t, const Vector3d& foot) const;
  SurfacePoint Resolve(const Vector3d& query, const TriangleTree::Nearest& nearest) const;
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

void Surface::Tree::FindRims() {
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
      rim = kCreased | kSharp;  // more than two faces meet here
      for (std::size_t k = s; k < e; ++k) across[sides[k].triangle][sides[k].edge] = sides[k == s ? s + 1 : s].triangle;
    }
    for (std::size_t k = s; k < e; ++k) rims[sides[k].triangle][sides[k].edge] = rim;
    vertex_rims[sides[s].low] |= rim;
    vertex_rims[sides[s].high] |= rim;
    s = e;
  }
  near_rim.assign(faces.size(), 0);
  for (std::size_t t = 0; t < faces.size(); ++t)
    for (const std::uint32_t v : faces[t]) near_rim[t] |= vertex_rims[welded[v]] & (kSharp | kOpen);
  vertex_normals.resize(vertices.size());
  for (std::size_t v = 0; v < sums.size(); ++v) vertex_normals[v] = sums[v].normalized().cast<float>();
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

std::optional<Patch> Surface::Tree::PatchOf(std::uint32_t t) const {
  if (mesh.corner_normals.empty()) return std::nullopt;
  const auto& c = mesh.triangles[t];
  const std::array<Vector3d, 3> v = {vertices[c[0]], vertices[c[1]], vertices[c[2]]};
  Patch patch;
  patch.corner = v[0];
  patch.edge_1 = v[1] - v[0];
  patch.edge_2 = v[2] - v[0];
  const Vector3d twice_area = patch.edge_1.cross(patch.edge_2);
  patch.unit_normal = twice_area.normalized();
  const double inverse = 1 / twice_area.squaredNorm();
  patch.dual_1 = inverse * patch.edge_2.cross(twice_area);
  patch.dual_2 = inverse * twice_area.cross(patch.edge_1);
  const double longest =
      std::sqrt(std::max({patch.edge_1.squaredNorm(), patch.edge_2.squaredNorm(), (v[2] - v[1]).squaredNorm()}));
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Vector3d edge = v[j] - v[i];
    const Vector3d n_i = mesh.corner_normals[t][i].cast<double>(), n_j = mesh.corner_normals[t][j].cast<double>();
    const double up_i = n_i.dot(patch.unit_normal), up_j = n_j.dot(patch.unit_normal);
    if (!(up_i > kLeastNormalAgreement && up_j > kLeastNormalAgreement)) return std::nullopt;
    patch.height[2 * i] = -n_i.dot(edge) / (3 * up_i);
    patch.height[2 * i + 1] = n_j.dot(edge) / (3 * up_j);
    for (const int k : {2 * i, 2 * i + 1}) {
      if (!(std::abs(patch.height[k]) <= kGreatestHeightRatio * longest)) return std::nullopt;
      sum += patch.height[k];
    }
  }
  patch.height[6] = sum / 4;  // reproduces every quadratic
  return patch;
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

double Surface::Tree::EdgeDistance(std::uint32_t t, const Vector3d& foot) const {
  double squared = std::numeric_limits<double>::infinity();
  const auto& corners = mesh.triangles[t];
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d& corner = vertices[corners[i]];
    if (vertex_rims[welded[corners[i]]] & (kSharp | kOpen)) squared = std::min(squared, (foot - corner).squaredNorm());
    if (!(rims[t][i] & (kSharp | kOpen))) continue;
    const Vector3d &from = vertices[corners[(i + 1) % 3]], along = vertices[corners[(i + 2) % 3]] - from;
    const double at = std::clamp(along.dot(foot - from) / along.squaredNorm(), 0.0, 1.0);
    squared = std::min(squared, (foot - from - at * along).squaredNorm());
  }
  return std::sqrt(squared);
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
  if (found.feature == SurfaceFeature::kFace && near_rim[t]) found.edge_distance_mm = EdgeDistance(t, foot);
  if (found.feature != SurfaceFeature::kFace) found.edge_distance_mm = 0;
  const std::optional<Patch> patch = rim == kSmooth ? PatchOf(t) : std::nullopt;
  if (!patch) {
    const Vector3d pseudo = PseudoNormal(nearest), offset = query - foot;
    const double distance = offset.norm(), sign = offset.dot(pseudo) < 0 ? -1 : 1;
    found.point_mm = centre + foot;
    found.signed_distance_mm = sign * distance;
    // Very near an edge the direction to the query is noise; the pseudo-normal is not.
    found.normal =
        nearest.part == TrianglePart::kInside || distance < 1e-6 ? pseudo : Vector3d(sign / distance * offset);
    return found;
  }
  // Slide the foot along the curved surface until the query stands on its normal; not over a crease.
  Vector3d barycentric = nearest.barycentric, at, normal;
  double along = 0;
  for (int step = 0;; ++step) {
    double slope_1, slope_2;
    const double height = patch->Height(barycentric, &slope_1, &slope_2);
    at = patch->corner + barycentric[1] * patch->edge_1 + barycentric[2] * patch->edge_2 + height * patch->unit_normal;
    normal = (patch->unit_normal - slope_1 * patch->dual_1 - slope_2 * patch->dual_2).normalized();
    along = (query - at).dot(normal);
    if (step == 2) break;
    const Vector3d tangential = query - at - along * normal;
    Vector3d next = barycentric;
    next[1] += patch->dual_1.dot(tangential);
    next[2] += patch->dual_2.dot(tangential);
    next[0] = 1 - next[1] - next[2];
    for (int i = 0; i < 3; ++i) next[i] = std::max(next[i], rims[t][i] == kSmooth ? -kOvershoot : 0.0);
    barycentric = next / next.sum();
  }
  found.point_mm = centre + at;
  found.normal = normal;
  found.signed_distance_mm = along;
  return found;
}

absl::StatusOr<std::shared_ptr<const Surface>> Surface::Prepare(TriangleMesh mesh) {
  const auto refuse = [](const std::string& what) { return absl::InvalidArgumentError("surface." + what); };
  if (mesh.triangles.empty()) return refuse("triangles: 0, want at least one");
  if (mesh.triangles.size() > kGreatestTriangleCount)
    return refuse("triangles: " + std::to_string(mesh.triangles.size()) + ", want at most " +
                  std::to_string(kGreatestTriangleCount));
  if (!mesh.corner_normals.empty() && mesh.corner_normals.size() != mesh.triangles.size())
    return refuse("corner_normals: " + std::to_string(mesh.corner_normals.size()) + ", want one entry per triangle");
  for (const Vector3d& v : mesh.vertices_mm)
    if (!(v.cwiseAbs().maxCoeff() <= kGreatestCoordinateMm) || !v.allFinite())
      return refuse("vertices_mm: a coordinate beyond 1e7 mm or not finite");
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t)
      if (v >= mesh.vertices_mm.size())
        return refuse("triangles: vertex " + std::to_string(v) + ", want less than " +
                      std::to_string(mesh.vertices_mm.size()));
  for (const auto& normals : mesh.corner_normals)
    for (const Eigen::Vector3f& n : normals)
      if (!(std::abs(n.squaredNorm() - 1) < 1e-3f)) return refuse("corner_normals: a length other than 1");

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
  if (tree->triangles->empty()) return refuse("triangles: none has an area");
  tree->Weld();
  tree->FindRims();
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
  if (!(query.cwiseAbs().maxCoeff() <= 1e12) || !query.allFinite() || !(limit_mm >= 0))
    return tree_->Resolve(query, {});
  return tree_->Resolve(query, tree_->triangles->Find(query, limit_mm * limit_mm, hint));
}

void Surface::PrepareNear(int thread_count) const {
  std::call_once(tree_->near_once, [&] {
    tree_->near = std::make_unique<const NearCells>(*tree_->triangles, kNearMm, thread_count);
    tree_->near_ready = tree_->near.get();
  });
}

Surface::Cursor::Cursor(const Surface& surface)
    : surface_(surface),
      near_(std::make_unique<NearCursor>(*surface.tree_->triangles, surface.tree_->near_ready.load())) {}
Surface::Cursor::~Cursor() = default;

SurfacePoint Surface::Cursor::ClosestWithin(const Vector3d& point_mm, double limit_mm, std::uint32_t hint) {
  const Tree& tree = *surface_.tree_;
  const Vector3d query = point_mm - tree.centre;
  if (!(query.cwiseAbs().maxCoeff() <= 1e12) || !query.allFinite() || !(limit_mm >= 0)) return tree.Resolve(query, {});
  const TriangleTree::Nearest nearest = near_->Find(query, limit_mm * limit_mm, hint == kNoTriangle ? hint_ : hint);
  if (nearest.triangle != kNoTriangle) hint_ = nearest.triangle;
  return tree.Resolve(query, nearest);
}

const TriangleMesh& Surface::mesh() const { return tree_->mesh; }
Vector3d Surface::minimum_mm() const { return tree_->minimum; }
Vector3d Surface::maximum_mm() const { return tree_->maximum; }
Vector3d Surface::centroid_mm() const { return tree_->centroid; }
double Surface::radius_of_gyration_mm() const { return tree_->radius_of_gyration; }
double Surface::area_mm2() const { return tree_->area; }

}  // namespace sixpoint::metrology
