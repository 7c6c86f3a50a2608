#include "metrology/mesh/mesh_bytes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>

#include "metrology/mesh/triangle_mesh.h"
#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

TriangleMesh FullMesh() {
  TriangleMesh mesh = Tetrahedron({6350.0, -1.0 / 3, 1e-9});
  for (int i = 0; i < 4; ++i) {
    mesh.corner_normals.push_back(
        {Eigen::Vector3f(0.6f, 0.8f, 0), Eigen::Vector3f::UnitY(), -Eigen::Vector3f::UnitZ()});
    mesh.faces.push_back(static_cast<std::uint16_t>(65532 + i));
  }
  mesh.chordal_error_um = 0.1;
  return mesh;
}

void ExpectEqual(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(a.vertices_mm, b.vertices_mm);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.corner_normals, b.corner_normals);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.chordal_error_um, b.chordal_error_um);
  EXPECT_EQ(a.closed, b.closed);
}

std::string MessageOfBytes(const std::string& bytes) { return std::string(MeshFromBytes(bytes).status().message()); }

template <typename T>
std::string With(std::string bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
  return bytes;
}

TEST(MeshBytes, ComeBackBitForBit) {
  for (const TriangleMesh& mesh : {FullMesh(), Tetrahedron()}) {
    const auto read = MeshFromBytes(MeshBytes(mesh));
    ASSERT_TRUE(read.ok()) << read.status();
    ExpectEqual(*read, mesh);
  }
}

TEST(MeshBytes, HaveTheSizeThatTheFormatSays) {
  EXPECT_EQ(MeshBytes(Tetrahedron()).size(), 40u + 4 * 24 + 4 * 12);
  EXPECT_EQ(MeshBytes(FullMesh()).size(), 40u + 4 * 24 + 4 * (12 + 36 + 2));
}

TEST(MeshBytes, OfEqualMeshesAreEqual) {
  TriangleMesh negative_zero = Tetrahedron();
  negative_zero.vertices_mm[0].x() = -0.0;
  EXPECT_EQ(MeshBytes(negative_zero), MeshBytes(Tetrahedron()));
}

TEST(MeshBytes, RefusesEveryTruncationAndAnyBytesAfter) {
  const std::string bytes = MeshBytes(FullMesh());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    ASSERT_EQ(MeshFromBytes(bytes.substr(0, size)).status().code(), absl::StatusCode::kInvalidArgument) << size;
  EXPECT_THAT(MessageOfBytes(bytes + "x"), HasSubstr("mesh.size"));
}

TEST(MeshBytes, RefusesCountsThatTheBytesCannotHoldBeforeAllocating) {
  const std::string bytes = MeshBytes(FullMesh());
  // 2^61 vertices of 24 bytes are 0 bytes, modulo 2^64.
  for (const std::uint64_t count : {std::uint64_t{1} << 61, std::uint64_t{1} << 32, std::uint64_t{1} << 27}) {
    EXPECT_FALSE(MeshFromBytes(With(bytes, 16, count)).ok()) << count;
    EXPECT_FALSE(MeshFromBytes(With(bytes, 24, count)).ok()) << count;
  }
}

TEST(MeshBytes, NamesWhatIsWrong) {
  const std::string bytes = MeshBytes(FullMesh());
  EXPECT_THAT(MessageOfBytes("PLY"), HasSubstr("mesh.magic"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 8, std::uint32_t{2})), HasSubstr("mesh.version: 2, want 1"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 12, std::uint32_t{32})), HasSubstr("mesh.flags: 32, want 0 to 31"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 32, std::numeric_limits<double>::quiet_NaN())),
              HasSubstr("mesh.chordal_error_um"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 40, std::numeric_limits<double>::infinity())), HasSubstr("mesh.vertices_mm"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 40 + 4 * 24, std::uint32_t{4})),
              HasSubstr("mesh.triangles: 4, want an index below 4"));
  EXPECT_THAT(MessageOfBytes(With(bytes, 40 + 4 * 36, 0.5f)), HasSubstr("mesh.corner_normals"));
}

TEST(MeshBytes, SurvivesRandomDamage) {
  const std::string bytes = MeshBytes(FullMesh());
  std::mt19937 random(1);
  int read_count = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    std::string damaged = bytes;
    for (int i = 0; i < 4; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    const auto mesh = MeshFromBytes(damaged);
    if (!mesh.ok()) continue;
    ++read_count;
    for (const auto& triangle : mesh->triangles)
      for (const std::uint32_t index : triangle) ASSERT_LT(index, mesh->vertices_mm.size());
  }
  EXPECT_GT(read_count, 0);  // some damage falls on coordinates only
}

}  // namespace
}  // namespace sixpoint::metrology
