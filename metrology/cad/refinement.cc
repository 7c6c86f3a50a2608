#include "metrology/cad/refinement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "metrology/cad/cad_refusal.h"
#include "metrology/cad/healing.h"
#include "metrology/mesh/cubic_patch.h"
#include "refusal/message_text.h"

namespace sixpoint::metrology {
namespace {

constexpr int kGreatestPassCount = 24;
// Facets stay within about 11 degrees of the surface, down to edges of this many chordal errors.
constexpr double kLeastCosine = 0.98, kFlatEdgeFactor = 2;
// Across a gap a facet leans by the gap over its length, however small: not looked at below this many gaps.
constexpr double kGapEdgeFactor = 6;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

double DistanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * along).norm();
}

std::uint64_t Key(std::uint32_t a, std::uint32_t b) { return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b); }

// Between two nodes of a face; once split it is never looked at again.
struct Edge {
  std::uint32_t a, b;  // a < b
  std::uint32_t border = kNone;
  Eigen::Vector2d middle_uv;
  Eigen::Vector3d middle_mm;
  double gap_mm = 0;       // of its middle, on a border
  double distance_mm = 0;  // of the true middle from the nearer triangle's plane, and of a curve from its chord
  double allowance_mm = 0;
  bool split = false;
  std::uint32_t middle_node = kNone;
};

struct Triangle {
  std::array<std::uint32_t, 3> nodes;  // as its face's parameters run
  std::array<std::uint32_t, 3> edges;  // edge c joins nodes c and c + 1
  Eigen::Vector3d middle_mm;           // the true surface at the centroid of the parameters
  std::uint8_t longest = 0;            // edge
  double patch_distance_mm = 0;        // of the true middles from the cubic patch over the triangle
};

class Refiner {
 public:
  Refiner(CoarseMesh coarse, const ShapeGeometry& shape, const RefinementOptions& options)
      : mesh_(std::move(coarse)),
        shape_(shape),
        options_(options),
        middles_(shape, options.healed_from_mm, &edges_off_) {}

  absl::StatusOr<TriangleMesh> Run() {
    Prepare();
    if (absl::Status met = edges_off_.Check(options_.greatest_gap_mm); !met.ok()) return met;
    for (int pass = 0; pass < kGreatestPassCount && Mark(); ++pass) {
      Split();
      if (absl::Status met = edges_off_.Check(options_.greatest_gap_mm); !met.ok()) return met;
      if (triangles_.size() > options_.greatest_triangle_count)
        return absl::ResourceExhaustedError("cad.triangle_count: " + std::to_string(triangles_.size()) +
                                            ", want at most " + std::to_string(options_.greatest_triangle_count));
    }
    return Finish();
  }

 private:
  const Eigen::Vector3d& At(std::uint32_t node) const { return mesh_.vertices_mm[mesh_.nodes[node].vertex]; }
  Eigen::Vector3d Across(const std::array<std::uint32_t, 3>& nodes) const {
    return (At(nodes[1]) - At(nodes[0])).cross(At(nodes[2]) - At(nodes[0]));
  }

  void Prepare() {
    HealVertices(shape_, options_.healed_from_mm, &mesh_, &edges_off_);
    for (std::uint32_t i = 0; i < mesh_.borders.size(); ++i) middles_.AddBorder(i, mesh_.borders[i].chord);
    for (std::uint32_t c = 0; c < mesh_.chords.size(); ++c) middles_.Find(mesh_, c);
    for (const CoarseMesh::Node& node : mesh_.nodes) AddNodeValues(node);
    for (std::uint32_t i = 0; i < mesh_.borders.size(); ++i)
      border_of_[Key(mesh_.borders[i].nodes[0], mesh_.borders[i].nodes[1])] = i;
    // A face's triangles all run one way in its parameters; which way is outward is for the whole face to say, since a
    // thin triangle may be folded over.
    std::vector<double> agreement;
    for (const auto& nodes : mesh_.triangles) {
      const std::uint16_t face = mesh_.nodes[nodes[0]].face;
      agreement.resize(std::max<std::size_t>(agreement.size(), face + 1));
      agreement[face] += Across(nodes).dot(normals_[nodes[0]] + normals_[nodes[1]] + normals_[nodes[2]]);
    }
    for (auto nodes : mesh_.triangles) {
      if (agreement[mesh_.nodes[nodes[0]].face] < 0) std::swap(nodes[1], nodes[2]);
      AddTriangle(nodes, &triangles_);
    }
  }

  void AddNodeValues(const CoarseMesh::Node& node) {
    gaps_mm_.push_back((shape_.FacePoint(node.face, node.uv) - mesh_.vertices_mm[node.vertex]).norm());
    normals_.push_back(shape_.FaceNormal(node.face, node.uv));
  }
  std::uint32_t AddNode(std::uint32_t vertex, std::uint16_t face, const Eigen::Vector2d& uv) {
    mesh_.nodes.push_back({vertex, face, uv, -1});
    AddNodeValues(mesh_.nodes.back());
    return static_cast<std::uint32_t>(mesh_.nodes.size() - 1);
  }
  std::uint32_t AddVertex(const Eigen::Vector3d& point_mm) {
    mesh_.vertices_mm.push_back(point_mm);
    return static_cast<std::uint32_t>(mesh_.vertices_mm.size() - 1);
  }

  void AddTriangle(const std::array<std::uint32_t, 3>& nodes, std::vector<Triangle>* out) {
    Triangle triangle;
    triangle.nodes = nodes;
    for (int c = 0; c < 3; ++c) triangle.edges[c] = FindEdge(nodes[c], nodes[(c + 1) % 3]);
    triangle.middle_mm = shape_.FacePoint(mesh_.nodes[nodes[0]].face, MeanUv({nodes[0], nodes[1], nodes[2]}));
    triangle.longest = Longest(triangle.edges);
    triangle.patch_distance_mm = PatchDistance(triangle);
    out->push_back(triangle);
  }

  // At a pole the surface has no normal of its own; the facet's stands in.
  Eigen::Vector3d CornerNormal(std::uint32_t node, const Eigen::Vector3d& facet_normal) const {
    return normals_[node].isZero() ? facet_normal : normals_[node];
  }

  // What the prepared surface will be off by: to the patch, or to the facet where no patch is fit to stand.
  double PatchDistance(const Triangle& triangle) const {
    const auto& [a, b, c] = triangle.nodes;
    const Eigen::Vector3d across = Across(triangle.nodes);
    if (!(across.norm() > 0)) return 0;
    const Eigen::Vector3d facet = across.normalized();
    const std::optional<CubicPatch> patch = CubicPatch::Over(
        {At(a), At(b), At(c)}, {CornerNormal(a, facet), CornerNormal(b, facet), CornerNormal(c, facet)});
    double distance = 0;
    for (const Eigen::Vector3d* truth : {&triangle.middle_mm, &edges_[triangle.edges[0]].middle_mm,
                                         &edges_[triangle.edges[1]].middle_mm, &edges_[triangle.edges[2]].middle_mm}) {
      if (!patch) {
        distance = std::max(distance, std::abs((*truth - At(a)).dot(facet)));
        continue;
      }
      const CubicPatch::Foot foot = patch->At(patch->Barycentric(*truth));
      distance = std::max(distance, std::abs((*truth - foot.point_mm).dot(foot.normal)));
    }
    return distance;
  }

  std::uint32_t FindEdge(std::uint32_t from, std::uint32_t to) {
    auto [found, fresh] = edge_of_.try_emplace(Key(from, to), static_cast<std::uint32_t>(edges_.size()));
    if (!fresh) return found->second;
    Edge edge;
    edge.a = std::min(from, to);
    edge.b = std::max(from, to);
    if (auto border = border_of_.find(found->first); border != border_of_.end()) edge.border = border->second;
    edge.middle_uv = edge.border == kNone ? MeanUv({edge.a, edge.b}) : middles_.uv(edge.border);
    edge.middle_mm = shape_.FacePoint(mesh_.nodes[edge.a].face, edge.middle_uv);
    if (edge.border != kNone)
      edge.gap_mm = Told((edge.middle_mm - middles_.point_mm(mesh_.borders[edge.border].chord)).norm());
    edge.allowance_mm = options_.chordal_error_mm + std::max({gaps_mm_[edge.a], gaps_mm_[edge.b], edge.gap_mm});
    edges_.push_back(edge);
    return found->second;
  }

  // A pole's free parameter has no say.
  Eigen::Vector2d MeanUv(std::initializer_list<std::uint32_t> nodes) const {
    Eigen::Vector2d mean;
    for (int parameter = 0; parameter < 2; ++parameter) {
      double sum = 0, all = 0;
      int count = 0;
      for (const std::uint32_t node : nodes) {
        all += mesh_.nodes[node].uv[parameter];
        if (mesh_.nodes[node].free_parameter == parameter) continue;
        sum += mesh_.nodes[node].uv[parameter];
        ++count;
      }
      mean[parameter] = count > 0 ? sum / count : all / static_cast<double>(nodes.size());
    }
    return mean;
  }

  // Which of a triangle's edges is longest; among equals the one that every triangle would choose.
  std::uint8_t Longest(const std::array<std::uint32_t, 3>& edges) const {
    auto rank = [&](std::uint32_t e) {
      const Edge& edge = edges_[e];
      const std::uint64_t key = edge.border == kNone ? Key(edge.a, edge.b) : mesh_.borders[edge.border].chord;
      return std::make_pair((At(edge.a) - At(edge.b)).squaredNorm(), key);
    };
    std::uint8_t longest = 0;
    for (std::uint8_t c = 1; c < 3; ++c) {
      if (rank(edges[c]) > rank(edges[longest])) longest = c;
    }
    return longest;
  }

  // Measures the mesh (error_mm_) and marks what to split; false when there is nothing.
  bool Mark() {
    error_mm_ = 0;
    for (Edge& edge : edges_) edge.distance_mm = std::numeric_limits<double>::infinity();
    for (const Triangle& triangle : triangles_) {
      Eigen::Vector3d facet = Across(triangle.nodes);
      if (!(facet.norm() > 0)) continue;
      facet.normalize();
      for (std::uint32_t e : triangle.edges) {
        Edge& edge = edges_[e];
        edge.distance_mm = std::min(edge.distance_mm, std::abs((edge.middle_mm - At(edge.a)).dot(facet)));
      }
      const double distance = std::abs((triangle.middle_mm - At(triangle.nodes[0])).dot(facet));
      error_mm_ = std::max(error_mm_, distance);
      double gap = 0, slope = 1;
      for (std::uint32_t node : triangle.nodes) {
        gap = std::max(gap, gaps_mm_[node]);
        if (!normals_[node].isZero()) slope = std::min(slope, normals_[node].dot(facet));
      }
      Edge& longest = edges_[triangle.edges[triangle.longest]];
      const bool tilted = slope < kLeastCosine;
      const bool off = triangle.patch_distance_mm > options_.patch_error_mm + gap;
      const bool long_enough =
          Length(longest) > std::max(kFlatEdgeFactor * options_.chordal_error_mm, kGapEdgeFactor * gap);
      const bool at_gap = Told(gap) > 0 && Length(longest) > options_.gap_piece_mm;
      if ((long_enough && (tilted || off)) || distance > options_.chordal_error_mm + gap || at_gap)
        longest.split = true;
    }
    for (Edge& edge : edges_) {
      if (edge.middle_node != kNone || !std::isfinite(edge.distance_mm)) continue;
      if (edge.border != kNone) edge.distance_mm = std::max(edge.distance_mm, CurveDistance(edge));
      error_mm_ = std::max(error_mm_, edge.distance_mm);
      const bool at_gap = edge.gap_mm > 0 && Length(edge) > options_.gap_piece_mm;
      if ((edge.distance_mm > edge.allowance_mm || at_gap) && Length(edge) > 0) edge.split = true;
    }
    return Propagate();
  }

  double Length(const Edge& edge) const { return (At(edge.a) - At(edge.b)).norm(); }
  double CurveDistance(const Edge& edge) const {
    return DistanceToSegment(middles_.point_mm(mesh_.borders[edge.border].chord), At(edge.a), At(edge.b));
  }
  // A gap, where it is one to tell of.
  double Told(double gap_mm) const { return gap_mm > options_.least_gap_mm ? gap_mm : 0; }

  // A triangle is never cut without its longest edge, and a chord is cut for both its faces; so angles stay at least
  // half of what they were (Rivara 1984). False when nothing is marked.
  bool Propagate() {
    std::vector<bool> chord_split(mesh_.chords.size(), false);
    bool any = false;
    for (bool changed = true; changed;) {
      changed = false;
      for (Edge& edge : edges_) {
        if (edge.border == kNone || edge.middle_node != kNone) continue;
        const std::uint32_t chord = mesh_.borders[edge.border].chord;
        if (edge.split && !chord_split[chord]) changed = chord_split[chord] = true;
        edge.split = chord_split[chord];
      }
      for (const Triangle& triangle : triangles_) {
        const auto& [e, f, g] = triangle.edges;
        if (!edges_[e].split && !edges_[f].split && !edges_[g].split) continue;
        any = true;
        Edge& longest = edges_[triangle.edges[triangle.longest]];
        if (!longest.split) changed = longest.split = true;
      }
    }
    return any;
  }

  void Split() {
    SplitBorders();
    const std::size_t edge_count = edges_.size();
    for (std::size_t e = 0; e < edge_count; ++e) {
      Edge& edge = edges_[e];
      if (edge.split && edge.border == kNone && edge.middle_node == kNone)
        edge.middle_node = AddNode(AddVertex(edge.middle_mm), mesh_.nodes[edge.a].face, edge.middle_uv);
    }
    std::vector<Triangle> triangles;
    triangles.reserve(2 * triangles_.size());
    for (const Triangle& triangle : triangles_) SplitTriangle(triangle, &triangles);
    triangles_ = std::move(triangles);
  }

  // A chord's middle is one vertex for every face along it.
  void SplitBorders() {
    std::vector<std::uint32_t> vertex(mesh_.chords.size(), kNone), second_half(mesh_.chords.size(), kNone);
    std::vector<CoarseMesh::Border> added;  // edges_ is walked meanwhile
    for (Edge& edge : edges_) {
      if (!edge.split || edge.border == kNone || edge.middle_node != kNone) continue;
      const std::uint32_t c = mesh_.borders[edge.border].chord;
      if (vertex[c] == kNone) {
        CoarseMesh::Chord& chord = mesh_.chords[c];
        const double middle = (chord.first + chord.last) / 2;
        vertex[c] = AddVertex(middles_.point_mm(c));
        second_half[c] = static_cast<std::uint32_t>(mesh_.chords.size());
        const CoarseMesh::Chord half{chord.curve, middle, chord.last};
        chord.last = middle;
        mesh_.chords.push_back(half);
      }
      edge.middle_node = AddNode(vertex[c], mesh_.nodes[edge.a].face, edge.middle_uv);
      CoarseMesh::Border& border = mesh_.borders[edge.border];
      added.push_back({{edge.middle_node, border.nodes[1]}, second_half[c], border.curve_on_face});
      border.nodes[1] = edge.middle_node;
      border_of_[Key(border.nodes[0], border.nodes[1])] = edge.border;
    }
    for (const CoarseMesh::Border& border : added) AddBorder(border);
    for (std::uint32_t c = 0; c < vertex.size(); ++c) {
      if (vertex[c] == kNone) continue;
      middles_.Find(mesh_, c);
      middles_.Find(mesh_, second_half[c]);
    }
  }

  void AddBorder(const CoarseMesh::Border& border) {
    border_of_[Key(border.nodes[0], border.nodes[1])] = static_cast<std::uint32_t>(mesh_.borders.size());
    middles_.AddBorder(static_cast<std::uint32_t>(mesh_.borders.size()), border.chord);
    mesh_.borders.push_back(border);
  }

  // First the triangle is halved at its longest edge, then each half at the edge of the triangle that it holds.
  void SplitTriangle(const Triangle& triangle, std::vector<Triangle>* out) {
    const int longest = triangle.longest, next = (longest + 1) % 3, last = (longest + 2) % 3;
    const std::uint32_t cut = edges_[triangle.edges[longest]].middle_node;
    if (cut == kNone) {
      out->push_back(triangle);
      return;
    }
    auto add_half = [&](std::uint32_t from, std::uint32_t to, std::uint32_t outer) {
      if (outer == kNone) {
        AddTriangle({cut, from, to}, out);
      } else {
        AddTriangle({cut, from, outer}, out);
        AddTriangle({cut, outer, to}, out);
      }
    };
    const std::uint32_t outer_next = edges_[triangle.edges[next]].middle_node;
    const std::uint32_t outer_last = edges_[triangle.edges[last]].middle_node;
    add_half(triangle.nodes[next], triangle.nodes[last], outer_next);
    add_half(triangle.nodes[last], triangle.nodes[longest], outer_last);
  }

  absl::StatusOr<TriangleMesh> Finish() const {
    const double gap_mm = gaps_mm_.empty() ? 0 : *std::max_element(gaps_mm_.begin(), gaps_mm_.end());
    if (!(error_mm_ <= options_.chordal_error_mm + gap_mm))
      return RefuseCad("chordal_error_um", Rounded(1e3 * error_mm_),
                       "at most " + Rounded(1e3 * options_.chordal_error_mm));
    TriangleMesh mesh;
    mesh.chordal_error_um = 1e3 * error_mm_;
    mesh.vertices_mm = mesh_.vertices_mm;
    mesh.healed_mm = Told(edges_off_.distance_mm);
    if (Told(gap_mm) > 0) {
      mesh.face_gaps_mm.assign(mesh.vertices_mm.size(), 0);
      for (std::size_t node = 0; node < gaps_mm_.size(); ++node) {
        float& gap = mesh.face_gaps_mm[mesh_.nodes[node].vertex];
        gap = std::max(gap, static_cast<float>(Told(gaps_mm_[node])));
      }
    }
    for (const Triangle& triangle : triangles_) {
      std::array<std::uint32_t, 3> vertices;
      std::array<Eigen::Vector3f, 3> normals;
      const Eigen::Vector3d across = Across(triangle.nodes);
      for (int c = 0; c < 3; ++c) {
        const std::uint32_t node = triangle.nodes[c];
        vertices[c] = mesh_.nodes[node].vertex;
        normals[c] = CornerNormal(node, across.normalized()).cast<float>();
      }
      if (!(across.norm() > 0)) continue;
      mesh.triangles.push_back(vertices);
      mesh.corner_normals.push_back(normals);
      mesh.faces.push_back(mesh_.nodes[triangle.nodes[0]].face);
    }
    return mesh;
  }

  CoarseMesh mesh_;
  const ShapeGeometry& shape_;
  const RefinementOptions& options_;
  std::vector<double> gaps_mm_;           // of each node: distance of its vertex from its face
  std::vector<Eigen::Vector3d> normals_;  // of each node
  std::vector<Edge> edges_;
  std::vector<Triangle> triangles_;
  std::unordered_map<std::uint64_t, std::uint32_t> border_of_, edge_of_;
  EdgesOff edges_off_;
  ChordMiddles middles_;
  double error_mm_ = 0;
};

}  // namespace

absl::StatusOr<TriangleMesh> Refine(CoarseMesh coarse, const ShapeGeometry& shape, const RefinementOptions& options) {
  return Refiner(std::move(coarse), shape, options).Run();
}

}  // namespace sixpoint::metrology
