// The stored form of a TriangleMesh, little-endian:
//
//   offset  0  8 bytes  magic "SIXPMESH"
//           8  u32      format version, 1
//          12  u32      flags: 1 corner normals follow, 2 faces follow, 4 closed, 8 healed, 16 gaps follow
//          16  u64      vertex count n
//          24  u64      triangle count m
//          32  f64      chordal error, um
//          40  n x 3 f64  vertices, mm;  m x 3 u32  vertex indices;  [m x 9 f32  corner normals];  [m x u16  faces];
//              [f64  healed, mm];  [n x f32  gaps of faces at vertices, mm]
//
// Nothing follows. The length is therefore known from the header, and checked before anything is allocated.
#include "metrology/mesh/mesh_bytes.h"

#include <cmath>
#include <cstring>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "mesh bytes are copied as the machine holds them");
static_assert(sizeof(Eigen::Vector3d) == 24 && sizeof(std::array<Eigen::Vector3f, 3>) == 36);

constexpr char kMagic[] = "SIXPMESH";
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kHasNormals = 1, kHasFaces = 2, kClosed = 4, kHealed = 8, kHasGaps = 16;
constexpr std::size_t kHeaderSize = 40;
constexpr std::uint64_t kGreatestStoredCount = 1u << 28;
constexpr double kGreatestGapMm = 1;

struct Header {
  std::uint32_t version, flags;
  std::uint64_t vertex_count, triangle_count;
  double chordal_error_um;
};
static_assert(sizeof(Header) == kHeaderSize - 8);

std::uint64_t SizeOf(const Header& header) {
  const std::uint64_t triangle = 12 + ((header.flags & kHasNormals) ? 36 : 0) + ((header.flags & kHasFaces) ? 2 : 0);
  const std::uint64_t gaps =
      ((header.flags & kHealed) ? 8 : 0) + ((header.flags & kHasGaps) ? 4 * header.vertex_count : 0);
  return kHeaderSize + 24 * header.vertex_count + triangle * header.triangle_count + gaps;
}

absl::Status RefuseMesh(const std::string& field, const std::string& value, const std::string& wanted) {
  return Refuse("mesh." + field, value, wanted);
}

template <typename T>
void Append(const std::vector<T>& values, std::string* bytes) {
  if (!values.empty()) bytes->append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <typename T>
std::size_t Take(const std::string& bytes, std::size_t offset, std::size_t count, std::vector<T>* values) {
  values->resize(count);
  if (count > 0) std::memcpy(static_cast<void*>(values->data()), bytes.data() + offset, count * sizeof(T));
  return offset + count * sizeof(T);
}

absl::Status CheckValues(const TriangleMesh& mesh) {
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
    if (!vertex.allFinite() || vertex.cwiseAbs().maxCoeff() > kGreatestCoordinateMm)
      return RefuseMesh("vertices_mm", "not finite or beyond 10 km", "finite millimetres");
  }
  for (const auto& triangle : mesh.triangles) {
    for (std::uint32_t index : triangle) {
      if (index >= mesh.vertices_mm.size())
        return RefuseMesh("triangles", std::to_string(index),
                          "an index below " + std::to_string(mesh.vertices_mm.size()));
    }
  }
  for (const auto& corners : mesh.corner_normals) {
    for (const Eigen::Vector3f& normal : corners) {
      if (!(std::abs(normal.norm() - 1.0f) < 1e-3f))
        return RefuseMesh("corner_normals", "not of length 1", "unit vectors");
    }
  }
  if (!(mesh.healed_mm >= 0 && mesh.healed_mm <= kGreatestGapMm))
    return RefuseMesh("healed_mm", NumberText(mesh.healed_mm), "0 to " + NumberText(kGreatestGapMm));
  for (const float gap : mesh.face_gaps_mm) {
    if (!(gap >= 0 && gap <= kGreatestGapMm))
      return RefuseMesh("face_gaps_mm", NumberText(gap), "0 to " + NumberText(kGreatestGapMm));
  }
  return absl::OkStatus();
}

}  // namespace

std::string MeshBytes(const TriangleMesh& mesh) {
  Header header{kVersion,
                (mesh.corner_normals.empty() ? 0 : kHasNormals) | (mesh.faces.empty() ? 0 : kHasFaces) |
                    (mesh.closed ? kClosed : 0) | (mesh.healed_mm > 0 ? kHealed : 0) |
                    (mesh.face_gaps_mm.empty() ? 0 : kHasGaps),
                mesh.vertices_mm.size(), mesh.triangles.size(), mesh.chordal_error_um + 0.0};
  std::string bytes;
  bytes.reserve(SizeOf(header));
  bytes.append(kMagic, 8);
  bytes.append(reinterpret_cast<const char*>(&header), sizeof(header));
  // Adding +0 makes a zero of -0: the two are equal, so their bytes have to be.
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
    const Eigen::Vector3d plain = vertex.array() + 0.0;
    bytes.append(reinterpret_cast<const char*>(plain.data()), sizeof(plain));
  }
  Append(mesh.triangles, &bytes);
  for (const auto& corners : mesh.corner_normals) {
    for (const Eigen::Vector3f& normal : corners) {
      const Eigen::Vector3f plain = normal.array() + 0.0f;
      bytes.append(reinterpret_cast<const char*>(plain.data()), sizeof(plain));
    }
  }
  Append(mesh.faces, &bytes);
  if (mesh.healed_mm > 0) bytes.append(reinterpret_cast<const char*>(&mesh.healed_mm), sizeof(mesh.healed_mm));
  Append(mesh.face_gaps_mm, &bytes);
  return bytes;
}

absl::StatusOr<TriangleMesh> MeshFromBytes(const std::string& bytes) {
  if (bytes.size() < kHeaderSize || std::memcmp(bytes.data(), kMagic, 8) != 0)
    return RefuseMesh("magic", "other bytes", "a stored mesh");
  Header header;
  std::memcpy(&header, bytes.data() + 8, sizeof(header));
  if (header.version != kVersion) return RefuseMesh("version", std::to_string(header.version), "1");
  if (header.flags > (kHasNormals | kHasFaces | kClosed | kHealed | kHasGaps))
    return RefuseMesh("flags", std::to_string(header.flags), "0 to 31");
  if (header.vertex_count > kGreatestStoredCount || header.triangle_count > kGreatestStoredCount)
    return RefuseMesh("triangle_count", std::to_string(header.triangle_count), "at most 2^28");
  const std::uint64_t size = SizeOf(header);
  if (bytes.size() != size)
    return RefuseMesh("size", std::to_string(bytes.size()), std::to_string(size) + " by its header");
  if (!(header.chordal_error_um >= 0) || !std::isfinite(header.chordal_error_um))
    return RefuseMesh("chordal_error_um", NumberText(header.chordal_error_um), ">= 0");

  TriangleMesh mesh;
  mesh.chordal_error_um = header.chordal_error_um;
  mesh.closed = (header.flags & kClosed) != 0;
  std::size_t offset = Take(bytes, kHeaderSize, header.vertex_count, &mesh.vertices_mm);
  offset = Take(bytes, offset, header.triangle_count, &mesh.triangles);
  if (header.flags & kHasNormals) offset = Take(bytes, offset, header.triangle_count, &mesh.corner_normals);
  if (header.flags & kHasFaces) offset = Take(bytes, offset, header.triangle_count, &mesh.faces);
  if (header.flags & kHealed) {
    std::memcpy(&mesh.healed_mm, bytes.data() + offset, sizeof(mesh.healed_mm));
    offset += sizeof(mesh.healed_mm);
  }
  if (header.flags & kHasGaps) Take(bytes, offset, header.vertex_count, &mesh.face_gaps_mm);
  if (absl::Status status = CheckValues(mesh); !status.ok()) return status;
  return mesh;
}

}  // namespace sixpoint::metrology
