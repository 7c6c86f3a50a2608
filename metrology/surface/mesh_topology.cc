#include "metrology/surface/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <unordered_map>
#include <utility>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Every directed edge of the mesh, sorted.
std::vector<Edge> DirectedEdges(const TriangleMesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (int corner = 0; corner < 3; ++corner) edges.emplace_back(triangle[corner], triangle[(corner + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

struct Cell {
  std::int64_t x, y, z;
  bool operator==(const Cell& other) const { return x == other.x && y == other.y && z == other.z; }
};
struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (std::int64_t value : {cell.x, cell.y, cell.z}) {
      hash = (hash ^ static_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15ull;
      hash ^= hash >> 29;
    }
    return hash;
  }
};

Cell BitsOf(const Eigen::Vector3d& vertex) {
  const Eigen::Vector3d plain = vertex.array() + 0.0;  // -0 is 0
  Cell cell;
  std::memcpy(&cell, plain.data(), sizeof(cell));
  return cell;
}

}  // namespace

std::vector<std::uint32_t> Weld(double tolerance_mm, Points* points) {
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells;
  cells.reserve(points->size());
  Points kept;
  auto add = [&](const Cell& home, const Eigen::Vector3d& point) {
    kept.push_back(point);
    cells[home].push_back(static_cast<std::uint32_t>(kept.size() - 1));
    return cells[home].back();
  };
  auto find = [&](const Eigen::Vector3d& point) -> std::uint32_t {
    if (tolerance_mm == 0) {
      const Cell home = BitsOf(point);
      auto cell = cells.find(home);
      return cell == cells.end() ? add(home, point) : cell->second.front();
    }
    const Eigen::Vector3d scaled = point / tolerance_mm;
    const Cell home{std::llround(scaled.x()), std::llround(scaled.y()), std::llround(scaled.z())};
    for (std::int64_t x = home.x - 1; x <= home.x + 1; ++x) {
      for (std::int64_t y = home.y - 1; y <= home.y + 1; ++y) {
        for (std::int64_t z = home.z - 1; z <= home.z + 1; ++z) {
          auto cell = cells.find({x, y, z});
          if (cell == cells.end()) continue;
          for (std::uint32_t candidate : cell->second) {
            if ((kept[candidate] - point).norm() <= tolerance_mm) return candidate;
          }
        }
      }
    }
    return add(home, point);
  };
  std::vector<std::uint32_t> new_index(points->size());
  for (std::size_t i = 0; i < new_index.size(); ++i) new_index[i] = find((*points)[i]);
  *points = std::move(kept);
  return new_index;
}

bool IsClosed(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return false;
  const std::vector<Edge> edges = DirectedEdges(mesh);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && edges[i] == edges[i - 1]) return false;
    if (!std::binary_search(edges.begin(), edges.end(), Edge{edges[i].second, edges[i].first})) return false;
  }
  return true;
}

absl::Status CheckOneSided(const TriangleMesh& mesh) {
  const std::vector<Edge> edges = DirectedEdges(mesh);
  std::size_t branching = 0, turned = 0;
  Edge first_branching, first_turned;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t next = i + 1;
    while (next < edges.size() && edges[next] == edges[i]) ++next;
    const Edge back{edges[i].second, edges[i].first};
    const auto [from, to] = std::equal_range(edges.begin(), edges.end(), back);
    const std::size_t along = next - i, against = static_cast<std::size_t>(to - from);
    i = next;
    if (against > 0 && back < edges[i - 1]) continue;  // counted from the other side
    if (along + against > 2 && branching++ == 0) first_branching = edges[i - 1];
    if (along + against == 2 && along != 1 && turned++ == 0) first_turned = edges[i - 1];
  }
  const auto bad = [&mesh](std::size_t count, const Edge& first, const char* what, const char* wanted) {
    const Eigen::Vector3d middle_mm = 0.5 * (mesh.vertices_mm[first.first] + mesh.vertices_mm[first.second]);
    std::ostringstream found;
    found << count << ' ' << what << ", the first at (" << middle_mm.x() << ", " << middle_mm.y() << ", "
          << middle_mm.z() << ") mm";
    return Refuse("mesh.edges", found.str(), wanted);
  };
  if (branching > 0)
    return bad(branching, first_branching, "with more than two triangles", "at most two: the boundary of one body");
  if (turned > 0)
    return bad(turned, first_turned, "between triangles turned against each other",
               "all corners counter-clockwise seen from outside");
  return absl::OkStatus();
}

MeshGaps GapsOf(const TriangleMesh& mesh) {
  MeshGaps gaps;
  TriangleMesh skin;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d normal =
        (mesh.vertices_mm[b] - mesh.vertices_mm[a]).cross(mesh.vertices_mm[c] - mesh.vertices_mm[a]);
    if (normal.squaredNorm() > 0) {
      skin.triangles.push_back({a, b, c});
    } else {
      ++gaps.degenerate_triangle_count;
    }
  }
  const std::vector<Edge> edges = DirectedEdges(skin);
  // Rims that share a vertex are one: each vertex leads to another of its rim, the first to itself.
  std::vector<std::uint32_t> leads_to(mesh.vertices_mm.size());
  for (std::uint32_t v = 0; v < leads_to.size(); ++v) leads_to[v] = v;
  std::vector<std::uint32_t> on_rim;
  const auto first_of = [&](std::uint32_t v) {
    while (leads_to[v] != v) v = leads_to[v] = leads_to[leads_to[v]];
    return v;
  };
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto [from, to] = edges[i];
    const bool twice = (i > 0 && edges[i - 1] == edges[i]) || (i + 1 < edges.size() && edges[i + 1] == edges[i]);
    if (twice || std::binary_search(edges.begin(), edges.end(), Edge{to, from})) continue;
    gaps.open_rim_length_mm += (mesh.vertices_mm[to] - mesh.vertices_mm[from]).norm();
    const std::uint32_t one = first_of(from), other = first_of(to);
    if (one != other) leads_to[std::max(one, other)] = std::min(one, other);
    on_rim.push_back(from);
  }
  for (std::uint32_t& vertex : on_rim) vertex = first_of(vertex);
  std::sort(on_rim.begin(), on_rim.end());
  gaps.open_rim_count = std::unique(on_rim.begin(), on_rim.end()) - on_rim.begin();
  return gaps;
}

double SignedVolume(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  // About a vertex of the mesh: parts stand metres from their origin.
  const Eigen::Vector3d origin = mesh.vertices_mm[mesh.triangles[0][0]];
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six_volumes +=
        (mesh.vertices_mm[a] - origin).dot((mesh.vertices_mm[b] - origin).cross(mesh.vertices_mm[c] - origin));
  }
  // Borders: follow the unpaired edges from vertex to vertex and close each loop towards its centroid.
  const std::vector<Edge> edges = DirectedEdges(mesh);
  std::vector<Edge> border;
  for (const Edge& edge : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), Edge{edge.second, edge.first})) border.push_back(edge);
  }
  std::vector<bool> used(border.size(), false);
  for (std::size_t start = 0; start < border.size(); ++start) {
    std::vector<Edge> loop;
    std::size_t next = start;
    while (next < border.size() && !used[next]) {
      used[next] = true;
      loop.push_back(border[next]);
      next = std::lower_bound(border.begin(), border.end(), Edge{border[next].second, 0}) - border.begin();
      while (next < border.size() && used[next] && border[next].first == loop.back().second) ++next;
      if (next < border.size() && border[next].first != loop.back().second) break;
    }
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const Edge& edge : loop) centroid += (mesh.vertices_mm[edge.first] - origin) / double(loop.size());
    for (const Edge& edge : loop) {
      six_volumes +=
          centroid.dot((mesh.vertices_mm[edge.second] - origin).cross(mesh.vertices_mm[edge.first] - origin));
    }
  }
  return six_volumes / 6;
}

void TurnOver(TriangleMesh* mesh) {
  for (auto& triangle : mesh->triangles) std::swap(triangle[1], triangle[2]);
  for (auto& corners : mesh->corner_normals) {
    std::swap(corners[1], corners[2]);
    for (Eigen::Vector3f& normal : corners) normal = -normal;
  }
}

}  // namespace sixpoint::metrology
