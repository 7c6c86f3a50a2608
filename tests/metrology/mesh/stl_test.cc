#include "metrology/mesh/stl.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <random>
#include <sstream>

#include "metrology/mesh/skin.h"
#include "metrology/mesh/volume.h"
#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

void AppendFloat(float value, std::string* out) {
  char bytes[4];
  std::memcpy(bytes, &value, 4);
  out->append(bytes, 4);
}

std::string BinaryStl(const TriangleMesh& mesh) {
  std::string out = "solid, says many a binary file too";
  out.resize(80, ' ');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  out.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) AppendFloat(0, &out);
    for (const std::uint32_t index : triangle)
      for (const double value : mesh.vertices_mm[index]) AppendFloat(static_cast<float>(value), &out);
    out.append(2, '\0');
  }
  return out;
}

std::string AsciiStl(const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "solid a name of several words\n";
  for (const auto& triangle : mesh.triangles) {
    out << "  facet normal nan 0 0\n outer loop\r\n";
    for (const std::uint32_t index : triangle) out << "vertex " << mesh.vertices_mm[index].transpose() << "\n";
    out << "endloop endfacet\n";
  }
  out << "endsolid a name\n";
  return out.str();
}

std::string MessageOfStl(const std::string& bytes, double unit_mm = 1) {
  const auto mesh = ReadStl(bytes, unit_mm);
  return mesh.ok() ? "read" : std::string(mesh.status().message());
}

TEST(Stl, RefusesWhatBoundsNoBodyAndNamesThePlace) {
  TriangleMesh fin = Tetrahedron(), turned = Tetrahedron();
  fin.vertices_mm.emplace_back(0, -1, -1);
  fin.triangles.push_back({0, 1, 4});
  std::swap(turned.triangles[1][0], turned.triangles[1][1]);
  EXPECT_THAT(MessageOfStl(BinaryStl(fin)), HasSubstr("1 with more than two triangles, the first at (0.5, 0, 0) mm"));
  EXPECT_THAT(MessageOfStl(BinaryStl(turned)), HasSubstr("3 between triangles turned against each other"));
  EXPECT_THAT(MessageOfStl(BinaryStl(Tetrahedron({2e7, 0, 0}))), HasSubstr("want at most 1e7 mm"));
  EXPECT_THAT(MessageOfStl(BinaryStl(Tetrahedron({2e4, 0, 0})), 1000), HasSubstr("want at most 1e7 mm"));
}

TEST(Stl, BinaryAndAsciiGiveTheSameClosedBody) {
  for (const std::string& bytes : {BinaryStl(Tetrahedron()), AsciiStl(Tetrahedron())}) {
    const auto mesh = ReadStl(bytes, 1);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->vertices_mm.size(), 4u);
    EXPECT_EQ(mesh->triangles.size(), 4u);
    EXPECT_TRUE(mesh->closed);
    EXPECT_TRUE(mesh->corner_normals.empty());
    EXPECT_NEAR(SignedVolume(*mesh), 1.0 / 6, 1e-12);
  }
}

TEST(Stl, UnitsScaleTheBody) {
  const auto mesh = ReadStl(BinaryStl(Tetrahedron()), 25.4);
  ASSERT_TRUE(mesh.ok());
  EXPECT_NEAR(SignedVolume(*mesh), 25.4 * 25.4 * 25.4 / 6, 1e-9);
}

TEST(Stl, ABodyWrittenInsideOutIsTurned) {
  TriangleMesh inside_out = Tetrahedron();
  TurnOver(&inside_out);
  const auto mesh = ReadStl(BinaryStl(inside_out), 1);
  ASSERT_TRUE(mesh.ok());
  EXPECT_NEAR(SignedVolume(*mesh), 1.0 / 6, 1e-12);
}

TEST(Stl, AnOpenSurfaceIsNotClosed) {
  TriangleMesh open = Tetrahedron();
  open.triangles.pop_back();
  const auto mesh = ReadStl(AsciiStl(open), 1);
  ASSERT_TRUE(mesh.ok());
  EXPECT_FALSE(mesh->closed);
}

TEST(Stl, RefusesWhatIsNoStl) {
  const std::string binary = BinaryStl(Tetrahedron()), ascii = AsciiStl(Tetrahedron());
  EXPECT_THAT(MessageOfStl(""), HasSubstr("stl.size: 0"));
  EXPECT_THAT(MessageOfStl(std::string(4000, 'x')), HasSubstr("stl.size: 4000"));
  EXPECT_THAT(MessageOfStl(binary.substr(0, binary.size() - 1)), HasSubstr("stl."));
  EXPECT_THAT(MessageOfStl(binary, 0), HasSubstr("stl.unit_mm"));
  EXPECT_THAT(MessageOfStl(binary, std::numeric_limits<double>::quiet_NaN()), HasSubstr("stl.unit_mm"));
  EXPECT_THAT(MessageOfStl(ascii.substr(0, ascii.size() / 2)), HasSubstr("stl.facets["));
  EXPECT_THAT(MessageOfStl("solid empty\nendsolid empty\n"), HasSubstr("stl.facets"));
  // A header that promises 4 billion triangles in 84 bytes.
  std::string promise = binary.substr(0, 84);
  std::memset(promise.data() + 80, 0xff, 4);
  EXPECT_THAT(MessageOfStl(promise), HasSubstr("stl."));
}

TEST(Stl, RefusesNumbersThatAreNotFinite) {
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TriangleMesh mesh = Tetrahedron();
    mesh.vertices_mm[3].y() = value;
    EXPECT_THAT(MessageOfStl(BinaryStl(mesh)), HasSubstr("facets[1].vertex: not finite"));
    EXPECT_THAT(MessageOfStl(AsciiStl(mesh)), HasSubstr("facets[1]"));
  }
}

TEST(Stl, RefusesTrianglesWithoutAnArea) {
  TriangleMesh flat = Tetrahedron();
  for (Eigen::Vector3d& vertex : flat.vertices_mm) vertex = Eigen::Vector3d(vertex.x(), 0, 0);
  EXPECT_THAT(MessageOfStl(BinaryStl(flat)), HasSubstr("none with an area"));
}

// In a line along an edge, and on one corner: the body is as it was.
TEST(Stl, KeepsTrianglesWithoutAreaApartFromTheBody) {
  TriangleMesh body = Tetrahedron();
  body.vertices_mm.push_back((body.vertices_mm[0] + body.vertices_mm[1]) / 2);
  body.triangles.insert(body.triangles.begin(), {0, 1, 4});
  body.triangles.insert(body.triangles.begin() + 2, {2, 2, 3});
  const auto mesh = ReadStl(BinaryStl(body), 1);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->closed);
  EXPECT_EQ(mesh->triangles.size(), 6u);
  EXPECT_EQ(GapsOf(*mesh).degenerate_triangle_count, 2);
  EXPECT_EQ(GapsOf(*mesh).open_rim_count, 0);
}

TEST(Stl, SurvivesRandomDamage) {
  std::mt19937 random(2);
  for (const std::string& bytes : {BinaryStl(Tetrahedron()), AsciiStl(Tetrahedron())}) {
    int refused_count = 0;
    for (int trial = 0; trial < 3000; ++trial) {
      std::string damaged = bytes;
      for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
      refused_count += !ReadStl(damaged, 1).ok();
    }
    EXPECT_GT(refused_count, 0);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
