#include "metrology/cad/tessellation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "metrology/frames/angles.h"
#include "metrology/mesh/volume.h"
#include "tests/metrology/cad/sample_cad.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
using testing::SampleShape;

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& bytes) {
    std::string name = (std::filesystem::temp_directory_path() / "tessellation-XXXXXX").string();
    const int descriptor = mkstemp(name.data());
    if (descriptor < 0) std::abort();
    path_ = name;
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

absl::StatusOr<TriangleMesh> Tessellated(CadFormat format, const std::string& bytes, double error_um = 1) {
  TessellationOptions options;
  options.chordal_error_um = error_um;
  return TessellateCad(format, TemporaryFile(bytes).path(), options);
}

double AreaOf(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (mesh.vertices_mm[b] - mesh.vertices_mm[a]).cross(mesh.vertices_mm[c] - mesh.vertices_mm[a]).norm();
  return area;
}

// Corner normals agree with their facets everywhere: nothing is folded or inside out.
void ExpectFacingOut(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.corner_normals.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3d facet =
        (mesh.vertices_mm[b] - mesh.vertices_mm[a]).cross(mesh.vertices_mm[c] - mesh.vertices_mm[a]).normalized();
    for (const Eigen::Vector3f& normal : mesh.corner_normals[i]) ASSERT_GT(facet.dot(normal.cast<double>()), 0.9);
  }
}

struct ClosedForm {
  SampleShape shape;
  double volume_mm3, area_mm2;
};
const double kFrustumSide = kPi * (6 + 2) * std::sqrt(9.0 * 9 + 4 * 4);
const ClosedForm kClosedForms[] = {
    {SampleShape::kBox, 6000, 2 * (200 + 300 + 600)},
    {SampleShape::kCylinder, kPi * 500, kPi*(50 + 200)},
    {SampleShape::kSphere, 4 * kPi * 512 / 3, 4 * kPi * 64},
    {SampleShape::kTorus, 2 * kPi* kPi * 10 * 9, 4 * kPi* kPi * 10 * 3},
    {SampleShape::kFarCylinder, kPi * 500, kPi*(50 + 200)},
    {SampleShape::kMirroredCone, kPi * 9 / 3 * (36 + 12 + 4), kFrustumSide + kPi*(36 + 4)},
};

TEST(Tessellation, MeetsClosedFormsWithinTheMeasuredError) {
  for (const ClosedForm& form : kClosedForms) {
    SCOPED_TRACE(static_cast<int>(form.shape));
    for (const double error_um : {4.0, 1.0}) {
      const auto mesh = Tessellated(CadFormat::kStep, testing::StepOf(form.shape), error_um);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_TRUE(mesh->closed);
      EXPECT_LE(mesh->chordal_error_um, error_um);
      // Nowhere further from the surface than the error: so much volume at most. STEP keeps 15 digits.
      EXPECT_NEAR(SignedVolume(*mesh), form.volume_mm3, 1e-3 * error_um * form.area_mm2 + 1e-9 * form.volume_mm3);
      // An offset by h changes the area by 2 h times the mean curvature, here below 0.5 / mm.
      EXPECT_NEAR(AreaOf(*mesh), form.area_mm2, 1e-3 * error_um * form.area_mm2);
      ExpectFacingOut(*mesh);
    }
  }
}

TEST(Tessellation, TheErrorThatItReportsIsTheErrorThatThereIs) {
  const double radius_mm = 8;
  const auto mesh = Tessellated(CadFormat::kStep, testing::StepOf(SampleShape::kSphere), 2);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  double worst_um = 0;
  for (const auto& [a, b, c] : mesh->triangles) {
    const Eigen::Vector3d corners[3] = {mesh->vertices_mm[a], mesh->vertices_mm[b], mesh->vertices_mm[c]};
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; i + j <= 8; ++j) {
        const Eigen::Vector3d point = (i * corners[0] + j * corners[1] + (8 - i - j) * corners[2]) / 8;
        worst_um = std::max(worst_um, 1e3 * std::abs(point.norm() - radius_mm));
      }
    }
  }
  // Sampled at centroids and edge midpoints it may miss a little of the greatest sagitta, never much.
  EXPECT_LE(worst_um, 1.15 * mesh->chordal_error_um);
  EXPECT_GE(worst_um, 0.85 * mesh->chordal_error_um);
}

TEST(Tessellation, NormalsAreThoseOfTheTrueSurface) {
  const auto mesh = Tessellated(CadFormat::kStep, testing::StepOf(SampleShape::kSphere));
  ASSERT_TRUE(mesh.ok());
  for (std::size_t i = 0; i < mesh->triangles.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d radial = mesh->vertices_mm[mesh->triangles[i][c]].normalized();
      const double tolerance = std::abs(radial.z()) > 0.9999 ? 0.01 : 1e-5;  // at a pole the facet's stands in
      ASSERT_LT((mesh->corner_normals[i][c].cast<double>() - radial).norm(), tolerance);
    }
  }
}

TEST(Tessellation, FacesKeepTheirNumbers) {
  const auto mesh = Tessellated(CadFormat::kStep, testing::StepOf(SampleShape::kBox));
  ASSERT_TRUE(mesh.ok());
  std::vector<int> count(6);
  for (const std::uint16_t face : mesh->faces) ++count.at(face);
  EXPECT_THAT(count, ::testing::Each(2));
}

TEST(Tessellation, IgesInInchesIsTheSameBodyInMillimetres) {
  for (const ClosedForm& form : {kClosedForms[0], kClosedForms[1], kClosedForms[3]}) {
    const auto mesh = Tessellated(CadFormat::kIges, testing::IgesOf(form.shape));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_TRUE(mesh->closed) << "sewn";
    EXPECT_NEAR(SignedVolume(*mesh), form.volume_mm3, 1e-3 * form.area_mm2 + 1e-6 * form.volume_mm3);
    ExpectFacingOut(*mesh);
  }
}

TEST(Tessellation, RefusesWhatItCannotUse) {
  const auto message = [](CadFormat format, const std::string& bytes) {
    const auto mesh = Tessellated(format, bytes);
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(mesh.status().message());
  };
  const std::string box = testing::StepOf(SampleShape::kBox);
  EXPECT_THAT(message(CadFormat::kStep, "no CAD at all"), HasSubstr("cad.content"));
  EXPECT_THAT(message(CadFormat::kIges, "no CAD at all"), HasSubstr("cad.content"));
  EXPECT_THAT(message(CadFormat::kIges, box), HasSubstr("cad.content"));
  EXPECT_THAT(message(CadFormat::kStep, testing::StepOf(SampleShape::kHugeBox)), HasSubstr("cad.extent_mm: 20000"));
  EXPECT_THAT(message(CadFormat::kStep, testing::StepOf(SampleShape::kTinyBox)), HasSubstr("cad.extent_mm: 0.02"));
  TessellationOptions options;
  options.chordal_error_um = 0;
  EXPECT_THAT(std::string(TessellateCad(CadFormat::kStep, "x", options).status().message()),
              HasSubstr("cad.chordal_error_um"));
}

std::string PlantFile(const char* name) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  return std::string(shared == nullptr ? "" : shared) + "/data/plant-a/" + name;
}

// A turbine vane from 1996: one B-spline surface in inches, 6.35 m from its origin; and a solid made of it.
TEST(Tessellation, ARealVaneIsTheSameFromStepAndFromIges) {
  if (!std::filesystem::exists(PlantFile("cad.step"))) GTEST_SKIP() << "no shared/data/plant-a";
  TessellationOptions options;
  options.chordal_error_um = 2;
  const auto step = TessellateCad(CadFormat::kStep, PlantFile("cad.step"), options);
  const auto iges = TessellateCad(CadFormat::kIges, PlantFile("cad.igs"), options);
  ASSERT_TRUE(step.ok()) << step.status();
  ASSERT_TRUE(iges.ok()) << iges.status();
  EXPECT_LE(step->chordal_error_um, 2);
  EXPECT_LE(iges->chordal_error_um, 2);
  EXPECT_TRUE(step->closed);
  EXPECT_FALSE(iges->closed);  // the airfoil alone, open at its ends
  EXPECT_GT(SignedVolume(*step), 0);
  // Both within 2 um over 4260 mm2, and the ends' curves within 2 um.
  EXPECT_NEAR(SignedVolume(*step), SignedVolume(*iges), 2 * 2e-3 * 4260);
  Eigen::Vector3d low[2], high[2];
  const TriangleMesh* meshes[2] = {&*step, &*iges};
  for (int i = 0; i < 2; ++i) {
    low[i] = high[i] = meshes[i]->vertices_mm[0];
    for (const Eigen::Vector3d& vertex : meshes[i]->vertices_mm) {
      low[i] = low[i].cwiseMin(vertex);
      high[i] = high[i].cwiseMax(vertex);
    }
    ExpectFacingOut(*meshes[i]);
  }
  EXPECT_LT((low[0] - low[1]).cwiseAbs().maxCoeff(), 4e-3);
  EXPECT_LT((high[0] - high[1]).cwiseAbs().maxCoeff(), 4e-3);
  EXPECT_GT(low[0].x(), 6350);
}

}  // namespace
}  // namespace sixpoint::metrology
