#include "metrology/mesh/stl.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "metrology/mesh/skin.h"
#include "metrology/mesh/volume.h"
#include "metrology/mesh/weld.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kBinaryHeader = 84, kBinaryTriangle = 50;
// ASCII takes about 250 bytes a facet; this bounds what a short file can make us hold.
constexpr std::size_t kGreatestFacetCount = 8'000'000;

absl::Status RefuseStl(const std::string& field, const std::string& value, const std::string& wanted) {
  return Refuse("stl." + field, value, wanted);
}

absl::StatusOr<Points> ReadBinary(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  if (count > kGreatestFacetCount) return RefuseStl("triangle_count", std::to_string(count), "at most 8000000");
  Points corners;
  corners.reserve(3 * std::size_t{count});
  for (std::size_t triangle = 0; triangle < count; ++triangle) {
    const char* at = bytes.data() + kBinaryHeader + triangle * kBinaryTriangle + 12;  // past the facet's normal
    for (int corner = 0; corner < 3; ++corner, at += 12) {
      float values[3];
      std::memcpy(values, at, 12);
      corners.emplace_back(values[0], values[1], values[2]);
    }
  }
  return corners;
}

std::string_view NextWord(std::string_view* rest) {
  const std::size_t begin = rest->find_first_not_of(" \t\r\n\f\v");
  if (begin == std::string_view::npos) return *rest = {};
  std::size_t end = rest->find_first_of(" \t\r\n\f\v", begin);
  if (end == std::string_view::npos) end = rest->size();
  const std::string_view word = rest->substr(begin, end - begin);
  rest->remove_prefix(end);
  return word;
}

bool NextNumber(std::string_view* rest, double* value) {
  std::string_view word = NextWord(rest);
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto result = std::from_chars(word.data(), word.data() + word.size(), *value);
  return result.ec == std::errc() && result.ptr == word.data() + word.size();
}

// solid NAME; facet normal x y z; outer loop; vertex x y z (three times); endloop; endfacet; ...; endsolid
absl::StatusOr<Points> ReadAscii(std::string_view rest) {
  Points corners;
  rest.remove_prefix(std::min(rest.find('\n'), rest.size()));  // the name may be any words
  while (true) {
    std::string_view word = NextWord(&rest);
    if (word == "endsolid") return corners;
    const std::string facet = "facets[" + std::to_string(corners.size() / 3) + "]";
    if (word != "facet" || NextWord(&rest) != "normal")
      return RefuseStl(facet, std::string(word.substr(0, 32)), "facet normal");
    for (int i = 0; i < 3; ++i) NextWord(&rest);  // exporters write nan here; the normal is not used
    if (NextWord(&rest) != "outer" || NextWord(&rest) != "loop") return RefuseStl(facet, "no loop", "outer loop");
    for (int corner = 0; corner < 3; ++corner) {
      Eigen::Vector3d vertex;
      if (NextWord(&rest) != "vertex" || !NextNumber(&rest, &vertex.x()) || !NextNumber(&rest, &vertex.y()) ||
          !NextNumber(&rest, &vertex.z()))
        return RefuseStl(facet, "unreadable vertex", "vertex x y z, three times");
      corners.push_back(vertex);
    }
    if (NextWord(&rest) != "endloop" || NextWord(&rest) != "endfacet")
      return RefuseStl(facet, "not ended", "endloop endfacet");
    if (corners.size() > 3 * kGreatestFacetCount) return RefuseStl("triangle_count", "more", "at most 8000000");
  }
}

bool IsBinary(std::string_view bytes) {
  // The length decides: many binary files begin with "solid" too.
  if (bytes.size() < kBinaryHeader) return false;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  return bytes.size() == kBinaryHeader + std::uint64_t{count} * kBinaryTriangle;
}

}  // namespace

absl::StatusOr<TriangleMesh> ReadStl(std::string_view bytes, double unit_mm) {
  if (!(unit_mm >= 1e-6 && unit_mm <= 1e4)) return RefuseStl("unit_mm", NumberText(unit_mm), "1e-6 to 1e4");
  const bool binary = IsBinary(bytes);
  if (!binary && bytes.substr(0, 5) != "solid")
    return RefuseStl("size", std::to_string(bytes.size()),
                     "84 + 50 x triangle count (binary), or a text that begins with solid");
  absl::StatusOr<Points> corners = binary ? ReadBinary(bytes) : ReadAscii(bytes);
  if (!corners.ok()) return corners.status();

  TriangleMesh mesh;
  mesh.vertices_mm = *std::move(corners);
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
    Eigen::Vector3d& vertex = mesh.vertices_mm[i];
    vertex *= unit_mm;
    if (!vertex.allFinite())
      return RefuseStl("facets[" + std::to_string(i / 3) + "].vertex", "not finite", "finite coordinates");
    if (!(vertex.cwiseAbs().maxCoeff() <= kGreatestCoordinateMm))
      return RefuseStl("facets[" + std::to_string(i / 3) + "].vertex",
                       "a coordinate of " + Rounded(vertex.cwiseAbs().maxCoeff()) + " mm",
                       "at most 1e7 mm; is unit_mm right?");
  }
  const std::vector<std::uint32_t> welded = Weld(0, &mesh.vertices_mm);
  std::vector<TriangleCorners> without_area;
  for (std::size_t i = 0; i + 2 < welded.size(); i += 3) {
    const TriangleCorners triangle{welded[i], welded[i + 1], welded[i + 2]};
    const Eigen::Vector3d& a = mesh.vertices_mm[triangle[0]];
    const Eigen::Vector3d across = (mesh.vertices_mm[triangle[1]] - a).cross(mesh.vertices_mm[triangle[2]] - a);
    (across.squaredNorm() > 0 ? mesh.triangles : without_area).push_back(triangle);
  }
  if (mesh.triangles.empty()) return RefuseStl("facets", "none with an area", "at least one");
  if (absl::Status status = CheckOneSided(mesh); !status.ok()) return status;
  mesh.closed = IsClosed(mesh);
  if (mesh.closed && SignedVolume(mesh) < 0) TurnOver(&mesh);
  // They bound nothing, but that the file has them is to be seen (GapsOf).
  mesh.triangles.insert(mesh.triangles.end(), without_area.begin(), without_area.end());
  return mesh;
}

}  // namespace sixpoint::metrology
