#include "cli/cloud_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "cli/document.h"

namespace sixpoint::cli {
namespace {

using metrology::Points;
using ::testing::HasSubstr;

Points SomePoints() { return {{0.1, -2.5, 1e-17}, {1.0 / 3, 4, -12.25}, {250, 0, 7}}; }

std::string Bytes(float value) {
  std::string bytes(4, '\0');
  std::memcpy(bytes.data(), &value, 4);
  return bytes;
}

std::string AsciiPly(const std::string& count, const std::string& body) {
  return "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex " + count +
         "\nproperty uchar red\nproperty float x\nproperty float y\nproperty double z\nelement face 0\n"
         "property list uchar int vertex_indices\nend_header\n" +
         body;
}

void ExpectRefused(const absl::StatusOr<Points>& points, const std::string& wanted) {
  ASSERT_FALSE(points.ok());
  EXPECT_EQ(points.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(points.status().message()), HasSubstr(wanted));
}

TEST(CloudFiles, PlyAndXyzReadBackToTheSameBits) {
  const auto ply = ParsePly("p", ToPly(SomePoints()));
  const auto xyz = ParseXyz("x", ToXyz(SomePoints()));
  ASSERT_TRUE(ply.ok()) << ply.status();
  ASSERT_TRUE(xyz.ok()) << xyz.status();
  EXPECT_EQ(*ply, SomePoints());
  EXPECT_EQ(*xyz, SomePoints());
}

TEST(CloudFiles, WritesAndReadsByTheEndingOfTheName) {
  for (const char* ending : {".ply", ".xyz"}) {
    const std::string path = ::testing::TempDir() + "/sixpoint_cloud_files_test" + ending;
    ASSERT_TRUE(WriteFile(path, (*CloudWriterFor(path))(SomePoints())).ok());
    const auto points = ReadCloud(path);
    ASSERT_TRUE(points.ok()) << points.status();
    EXPECT_EQ(*points, SomePoints());
    std::filesystem::remove(path);
  }
  EXPECT_EQ((*CloudWriterFor("-"))(SomePoints()), ToXyz(SomePoints()));
  EXPECT_EQ(CloudWriterFor("cloud.obj").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(ReadCloud(::testing::TempDir() + "/cloud.las").ok());
}

TEST(CloudFiles, AsciiPlyTakesCoordinatesFromTheirColumns) {
  const auto points = ParsePly("p", AsciiPly("2", "255 1 2 3\r\n0 4 5 6\r\n"));
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(*points, (Points{{1, 2, 3}, {4, 5, 6}}));
}

TEST(CloudFiles, BinaryPlyStepsOverOtherProperties) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty uchar flag\nproperty float "
      "y\n"
      "property float z\nend_header\n";
  const std::string body = Bytes(1) + "f" + Bytes(2) + Bytes(3) + Bytes(-4) + "f" + Bytes(5) + Bytes(6.5);
  const auto points = ParsePly("p", header + body);
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(*points, (Points{{1, 2, 3}, {-4, 5, 6.5}}));
  ExpectRefused(ParsePly("p", header + body.substr(0, body.size() - 1)), "1 points, want 2");
}

TEST(CloudFiles, RefusesCountsThatTheContentDoesNotHold) {
  ExpectRefused(ParsePly("p", AsciiPly("3", "255 1 2 3\n0 4 5 6\n")), "2 points, want 3");
  ExpectRefused(ParsePly("p", AsciiPly("20000000", "255 1 2 3\n")), "1 points, want 20000000");
  ExpectRefused(ParsePly("p", AsciiPly("99999999999999999999", "")), "'99999999999999999999'");
  ExpectRefused(ParsePly("p", AsciiPly("-1", "")), "'-1'");
  ExpectRefused(ParsePly("p", AsciiPly("0", "")), "'0'");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nPOINTS 2\nDATA ascii\n1 2 3\n"), "1 points, want 2");
  ExpectRefused(ParseXyz("p", "# nothing\n"), "0 points");
}

TEST(CloudFiles, RefusesWhatIsNotFinite) {
  ExpectRefused(ParseXyz("x.xyz", "1 2 3\n4 nan 6\n"), "x.xyz: line 2: 'nan'");
  ExpectRefused(ParseXyz("x.xyz", "1 2 inf\n"), "line 1: 'inf'");
  ExpectRefused(ParseXyz("x.xyz", "1 2 1e999\n"), "'1e999'");
  ExpectRefused(ParseXyz("x.xyz", "1 2 0x10\n"), "'0x10'");
  Points points = SomePoints();
  points[1].y() = std::nan("");
  ExpectRefused(ParsePly("p.ply", ToPly(points)), "p.ply: point 1");
}

TEST(CloudFiles, RefusesLinesThatAreTooShort) {
  ExpectRefused(ParseXyz("x", "1 2\n"), "want 3 numbers");
  ExpectRefused(ParsePly("p", AsciiPly("1", "255 1 2\n")), "want 4 numbers");
}

TEST(CloudFiles, RefusesHeadersThatItCannotTrust) {
  ExpectRefused(ParsePly("p", ""), "'ply'");
  ExpectRefused(ParsePly("p", "ply\n"), "no end_header");
  ExpectRefused(ParsePly("p", "ply\nformat binary_big_endian 1.0\n"), "binary_little_endian");
  ExpectRefused(ParsePly("p", "ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n"),
                "no lists");
  ExpectRefused(ParsePly("p", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
                "no property y");
  ExpectRefused(ParsePly("p", "ply\nformat ascii 1.0\nelement face 1\nelement vertex 1\n"), "before other elements");
  std::string endless = "ply\n";
  for (int i = 0; i < 2000; ++i) endless += "comment x\n";
  ExpectRefused(ParsePly("p", endless + "end_header\n"), "no end_header");
  ExpectRefused(ParsePcd("p", "FIELDS x y\nPOINTS 1\nDATA ascii\n1 2\n"), "all three");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nPOINTS 1\nDATA binary_compressed\n"), "DATA ascii");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nPOINTS 1\nDATA binary\n"), "SIZE or TYPE");
  const std::string binary = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA binary\n";
  ExpectRefused(ParsePcd("p", binary + std::string(23, '\0')), "1 points, want 2");
  ExpectRefused(ParsePcd("p", binary + std::string(20, '\0') + std::string(4, '\xff')), "finite coordinates");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nSIZE 2 2 2\nTYPE I I I\nPOINTS 2\nDATA binary\n"), "F of 4 or 8 bytes");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nSIZE 9 9 9\nTYPE F F F\nPOINTS 2\nDATA binary\n"), "SIZE or TYPE");
  ExpectRefused(ParsePcd("p", "FIELDS x y z\nDATA ascii\n"), "POINTS before DATA");
  ExpectRefused(ParsePcd("p", "FIELDS n x y z\nCOUNT 3 1 1 1\n"), "COUNT 1");
}

TEST(CloudFiles, PcdTakesCoordinatesFromTheirFields) {
  const auto points =
      ParsePcd("p",
               "# .PCD v0.7\nVERSION 0.7\nFIELDS intensity x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
               "WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n9 1 2 3\n9 4 5 6\n");
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(*points, (Points{{1, 2, 3}, {4, 5, 6}}));
}

TEST(CloudFiles, PcdIsReadAsItsBytesToo) {
  std::string bytes = "FIELDS rgb x y z\nSIZE 1 4 8 4\nTYPE U F F F\nCOUNT 1 1 1 1\nPOINTS 2\nDATA binary\n";
  for (const double at : {1.5, -2.25}) {
    const auto x = static_cast<float>(at), z = static_cast<float>(2 * at);
    const double y = at / 3;
    bytes += 'c';
    bytes.append(reinterpret_cast<const char*>(&x), 4).append(reinterpret_cast<const char*>(&y), 8);
    bytes.append(reinterpret_cast<const char*>(&z), 4);
  }
  const auto points = ParsePcd("p", bytes);
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(*points, (Points{{1.5, 0.5, 3}, {-2.25, -0.75, -4.5}}));
}

TEST(CloudFiles, XyzTakesCommasAndIgnoresFurtherColumns) {
  const auto points = ParseXyz("x", "// header\n1,2,3,200\n +4;5\t6 7 8\n");
  ASSERT_TRUE(points.ok()) << points.status();
  EXPECT_EQ(*points, (Points{{1, 2, 3}, {4, 5, 6}}));
}

}  // namespace
}  // namespace sixpoint::cli
