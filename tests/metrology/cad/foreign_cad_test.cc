// CAD as other systems write it: healed where its faces say how, marked where they do not, and one of its solids.
#include "tests/metrology/cad/foreign_cad.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "metrology/cad/tessellation.h"
#include "metrology/frames/angles.h"
#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/volume.h"
#include "metrology/surface/surface.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<TriangleMesh> Read(CadFormat format, const std::string& bytes, const std::string& solid = "") {
  const std::string path = std::filesystem::temp_directory_path() / ("foreign-cad-" + std::to_string(getpid()));
  std::ofstream(path, std::ios::binary) << bytes;
  TessellationOptions options;
  options.solid = solid;
  auto mesh = TessellateCad(format, path, options);
  std::filesystem::remove(path);
  return mesh;
}

float WidestGapMm(const TriangleMesh& mesh) {
  return mesh.face_gaps_mm.empty() ? 0 : *std::max_element(mesh.face_gaps_mm.begin(), mesh.face_gaps_mm.end());
}

// Of vertices from a cylinder of radius 5, height 20.
double FarthestFromCylinder(const TriangleMesh& mesh) {
  double farthest = 0;
  for (const Eigen::Vector3d& v : mesh.vertices_mm)
    farthest = std::max(farthest, std::abs(std::max({v.head<2>().norm() - 5, -v.z(), v.z() - 20})));
  return farthest;
}

std::string Refusal(const absl::StatusOr<TriangleMesh>& mesh) {
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

// The faces say where they meet: nothing is left of edges that another system's file has off them.
TEST(ForeignCad, EdgesOffTheirFacesAreHealedToWhereThoseMeet) {
  for (const double by_mm : {0.008, 0.033, 0.06, 0.095}) {
    for (const CadFormat format : {CadFormat::kStep, CadFormat::kIges}) {
      SCOPED_TRACE(std::to_string(by_mm) + (format == CadFormat::kStep ? " step" : " iges"));
      const bool step = format == CadFormat::kStep;
      const auto mesh = Read(format, step ? testing::StepOfRaisedEdges(by_mm) : testing::IgesOfRaisedEdges(by_mm));
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_TRUE(mesh->closed);
      // Told from 10 um on. IGES keeps six or seven digits of a number.
      EXPECT_NEAR(mesh->healed_mm, by_mm > 0.01 ? by_mm : 0, 1e-5);
      EXPECT_EQ(WidestGapMm(*mesh), 0);
      EXPECT_LT(FarthestFromCylinder(*mesh), 2e-5);
      EXPECT_LE(mesh->chordal_error_um, 0.55);
      // Nowhere further from the surface than the chordal error, over 785 mm2.
      EXPECT_NEAR(SignedVolume(*mesh), kPi * 500, 0.55e-3 * 785);
      std::printf("%s, edges %.0f um off: healed %.2f um, vertices within %.3f um of the cylinder, %zu triangles\n",
                  step ? "STEP" : "IGES", 1e3 * by_mm, 1e3 * mesh->healed_mm, 1e3 * FarthestFromCylinder(*mesh),
                  mesh->triangles.size());
    }
  }
}

TEST(ForeignCad, WhatAGapLeavesIsToldWhereItIs) {
  for (const double step_mm : {0.0, 0.015, 0.033, 0.06, 0.095}) {
    SCOPED_TRACE(step_mm);
    const auto mesh = Read(CadFormat::kStep, testing::StepOfSteppedHalves(step_mm));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_TRUE(mesh->closed);
    // In the middle between faces that go on smoothly but for the step; told beyond 10 um.
    const double left_mm = step_mm / 2 > 0.01 ? step_mm / 2 : 0;
    EXPECT_NEAR(WidestGapMm(*mesh), left_mm, 1e-6);
    for (std::size_t v = 0; v < mesh->face_gaps_mm.size(); ++v) {
      const Eigen::Vector3d& at = mesh->vertices_mm[v];
      if (mesh->face_gaps_mm[v] > 0) {
        ASSERT_LT(std::abs(at.y()), 1e-3) << at.transpose();
        ASSERT_NEAR(std::abs(at.x()), 5 + step_mm / 2, 1e-3) << at.transpose();
      } else {
        ASSERT_FALSE(left_mm > 0 && std::abs(at.y()) < 1e-6 && at.head<2>().norm() > 5.001) << at.transpose();
      }
    }
    const double volume = kPi * 10 * (25 + (5 + step_mm) * (5 + step_mm));
    EXPECT_NEAR(SignedVolume(*mesh), volume, 0.55e-3 * 800 + 2 * step_mm * 0.5 * 20);  // the strips, of half a mm
    std::printf("step of %.0f um: a gap of %.2f um is left, %zu triangles\n", 1e3 * step_mm, 1e3 * WidestGapMm(*mesh),
                mesh->triangles.size());
    const auto surface = Surface::Prepare(*mesh);
    ASSERT_TRUE(surface.ok()) << surface.status();
    EXPECT_EQ((*surface)->HasGaps(), left_mm > 0);
    EXPECT_NEAR((*surface)->GapNear({5, 0.5, 10}), left_mm, 1e-6);
    EXPECT_EQ((*surface)->GapNear({4.7, 1.6, 10}), 0) << "beyond 1 mm";
    EXPECT_EQ((*surface)->GapNear({0, 5, 10}), 0);
    // Off the strips each face is itself.
    EXPECT_NEAR((*surface)->Closest({0, -6, 10}).signed_distance_mm, 1 - step_mm, 1e-4);
    EXPECT_NEAR((*surface)->Closest({0, 6, 10}).signed_distance_mm, 1, 1e-4);
  }
}

TEST(ForeignCad, AGapBeyondATenthOfAMillimetreIsRefusedWithItsPlace) {
  EXPECT_THAT(Refusal(Read(CadFormat::kStep, testing::StepOfRaisedEdges(0.12))),
              AllOf(HasSubstr("cad.faces: an edge 0.12 mm off its face at ("), HasSubstr("20.12) mm"),
                    HasSubstr("want edges within 0.1 mm of their faces")));
  EXPECT_THAT(Refusal(Read(CadFormat::kStep, testing::StepOfSteppedHalves(0.12))),
              HasSubstr("cad.faces: an edge 0.12 mm off its face at ("));
}

TEST(ForeignCad, TheSameFileGivesTheSameBytesAndTheyComeBack) {
  const std::string step = testing::StepOfSteppedHalves(0.06);
  const auto one = Read(CadFormat::kStep, step), other = Read(CadFormat::kStep, step);
  ASSERT_TRUE(one.ok() && other.ok());
  const std::string bytes = MeshBytes(*one);
  EXPECT_EQ(bytes, MeshBytes(*other));
  const auto back = MeshFromBytes(bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->healed_mm, one->healed_mm);
  EXPECT_EQ(back->face_gaps_mm, one->face_gaps_mm);
}

const std::vector<testing::NamedBox> kBoxes = {{"blade", 5}, {"fixture", 8}, {"clamp", 2}};
double VolumeOf(const testing::NamedBox& box) { return 6 * std::pow(box.size_mm, 3); }

TEST(ForeignCad, OneSolidOfSeveralIsTaken) {
  const std::string flat = testing::StepOfAssembly(kBoxes), nested = testing::StepOfNestedAssembly(kBoxes);
  for (const std::string& step : {flat, nested}) {
    for (std::size_t i = 0; i < kBoxes.size(); ++i) {
      for (const std::string& asked : {kBoxes[i].name, std::to_string(i + 1)}) {
        SCOPED_TRACE(asked);
        const auto mesh = Read(CadFormat::kStep, step, asked);
        ASSERT_TRUE(mesh.ok()) << mesh.status();
        EXPECT_TRUE(mesh->closed);
        EXPECT_NEAR(SignedVolume(*mesh), VolumeOf(kBoxes[i]), 1e-9 * VolumeOf(kBoxes[i]));
      }
    }
  }
  // Where its assembly places it.
  const Eigen::Vector3d clamp = BoundsOf(*Read(CadFormat::kStep, flat, "clamp")).min();
  EXPECT_LT((clamp - Eigen::Vector3d(200, 0, 0)).norm(), 1e-9);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 1, 0.5).normalized(), about(1, 2, 3);
  const Eigen::Vector3d placed =
      Eigen::Vector3d(500, 20, -30) + about + Eigen::AngleAxisd(0.7, axis) * (Eigen::Vector3d(200, 0, 0) - about);
  const auto nested_clamp = Read(CadFormat::kStep, nested, "clamp");
  const bool there = std::any_of(nested_clamp->vertices_mm.begin(), nested_clamp->vertices_mm.end(),
                                 [&](const Eigen::Vector3d& v) { return (v - placed).norm() < 1e-9; });
  EXPECT_TRUE(there);
}

TEST(ForeignCad, InchesAreMillimetres) {
  const auto mesh = Read(CadFormat::kStep, testing::StepOfAssembly(kBoxes, "INCH"), "clamp");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  // The writer takes its numbers as inches.
  EXPECT_NEAR(SignedVolume(*mesh), VolumeOf(kBoxes[2]) * std::pow(25.4, 3), 1e-6 * std::pow(25.4, 3));
}

TEST(ForeignCad, IgesSolidsAreTakenByTheirNumber) {
  const std::string iges = testing::IgesOfBoxes(kBoxes);
  EXPECT_THAT(Refusal(Read(CadFormat::kIges, iges)), HasSubstr("1 (750 mm3), 2 (3072 mm3), 3 (48 mm3)"));
  const auto mesh = Read(CadFormat::kIges, iges, "2");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(SignedVolume(*mesh), VolumeOf(kBoxes[1]), 1e-5);
}

TEST(ForeignCad, ASolidThatIsNotToldApartIsRefused) {
  const std::string step = testing::StepOfAssembly(kBoxes);
  const std::string listed = "want its name or number of 1 \"blade\" (750 mm3), 2 \"fixture\" (3072 mm3), 3 \"clamp\"";
  EXPECT_THAT(Refusal(Read(CadFormat::kStep, step)), HasSubstr("part.solid: none of 3 solids, " + listed));
  for (const char* asked : {"4", "0", "-1", "rotor", "Blade"})
    EXPECT_THAT(Refusal(Read(CadFormat::kStep, step, asked)),
                HasSubstr("part.solid: " + std::string(asked) + ", " + listed));
  const std::string twins = testing::StepOfAssembly({{"blade", 5}, {"blade", 8}});
  EXPECT_THAT(Refusal(Read(CadFormat::kStep, twins, "blade")),
              HasSubstr("part.solid: blade, the name of 2 solids, want"));
  const auto second = Read(CadFormat::kStep, twins, "2");
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_NEAR(SignedVolume(*second), 3072, 1e-6);
  // A file with one solid may be asked for it, and for no other.
  EXPECT_TRUE(Read(CadFormat::kStep, testing::StepOfAssembly({{"blade", 5}}), "1").ok());
  EXPECT_THAT(Refusal(Read(CadFormat::kStep, testing::StepOfAssembly({{"blade", 5}}), "2")),
              HasSubstr("part.solid: 2"));
}

TEST(ForeignCad, AListOfSolidsEnds) {
  const std::string wanted =
      Refusal(Read(CadFormat::kStep, testing::StepOfAssembly(std::vector<testing::NamedBox>(40, {"b", 1}))));
  EXPECT_THAT(wanted, HasSubstr("12 \"b\" (6 mm3) and 28 more"));
}

TEST(ForeignCad, ABladeOnItsPlatformWithHolesHasItsVolume) {
  const auto plain = Read(CadFormat::kStep, testing::StepOfBlade({}));
  ASSERT_TRUE(plain.ok()) << plain.status();
  const auto drilled = Read(CadFormat::kStep, testing::StepOfBlade({{10, 20}, 0.5}));
  ASSERT_TRUE(drilled.ok()) << drilled.status();
  EXPECT_TRUE(plain->closed && drilled->closed);
  // A segment of a circle of radius (7^2 + 5^2) / 10, and the plate.
  const double radius = 7.4, half_angle = std::asin(7 / radius);
  const double segment = radius * radius * (half_angle - std::sin(half_angle) * std::cos(half_angle));
  EXPECT_NEAR(SignedVolume(*plain), 30 * segment + 20 * 12 * 4, 1);  // chordal error over 1800 mm2
  // Two holes of 1 mm through 5 mm at most, less what the round side lacks over them: under 0.02 mm.
  EXPECT_NEAR(SignedVolume(*plain) - SignedVolume(*drilled), 2 * kPi * 0.25 * 5, 0.05);
}

}  // namespace
}  // namespace sixpoint::metrology
