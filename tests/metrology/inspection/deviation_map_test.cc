// Deviations of an egg whose deviation is known in closed form, seen by a scanner through both axes: means by patches, what was not seen, and
// what a profile tolerance says of it. In a harsher world than the kernel's: outliers, chips, uneven density, a pose that is off.
#include "metrology/inspection/deviation_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/inspection/profile.h"
#include "tests/metrology/inspection/pinned_block.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

const Vector3d kAxes_mm(5, 12, 20);  // half of them

// Where the egg's surface has that normal's angles, and its outward normal.
struct OnEgg {
  Vector3d point_mm, normal;
};
OnEgg EggAt(double turn_rad, double height_rad) {
  const Vector3d unit(std::cos(height_rad) * std::cos(turn_rad), std::cos(height_rad) * std::sin(turn_rad),
                      std::sin(height_rad));
  return {kAxes_mm.cwiseProduct(unit), unit.cwiseQuotient(kAxes_mm).normalized()};
}

TriangleMesh EggMesh(int rows) {
  const double pi = std::acos(-1);
  TriangleMesh mesh;
  const int columns = 2 * rows;
  std::vector<Vector3d> normals;
  const auto add = [&](const OnEgg& at) {
    mesh.vertices_mm.push_back(at.point_mm);
    normals.push_back(at.normal);
  };
  add(EggAt(0, -pi / 2));
  for (int i = 1; i < rows; ++i)
    for (int j = 0; j < columns; ++j) add(EggAt(2 * pi * j / columns, pi * i / rows - pi / 2));
  add(EggAt(0, pi / 2));
  const auto vertex = [&](int i, int j) -> std::uint32_t {
    if (i == 0) return 0;
    if (i == rows) return static_cast<std::uint32_t>(mesh.vertices_mm.size() - 1);
    return static_cast<std::uint32_t>(1 + (i - 1) * columns + j % columns);
  };
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      if (i > 0) mesh.triangles.push_back({vertex(i, j), vertex(i, j + 1), vertex(i + 1, j)});
      if (i < rows - 1) mesh.triangles.push_back({vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)});
    }
  for (const TriangleCorners& corners : mesh.triangles) {
    auto& of = mesh.corner_normals.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) of[k] = normals[corners[k]].cast<float>();
  }
  mesh.closed = true;
  return mesh;
}

// A casting: waves of some ten millimetres, and a boss.
double FormOf(const Vector3d& at) { return 0.02 * std::sin(at.y() / 6 + 0.4) + 0.015 * std::cos(at.z() / 8); }
double BossOf(const Vector3d& at) {
  const double from_mm = (at - Vector3d(kAxes_mm.x(), 0, 0)).norm();
  return from_mm < 3 ? 0.2 * std::pow(std::cos(from_mm * std::acos(-1) / 6), 2) : 0;
}

class Egg : public ::testing::Test {
 protected:
  Egg() : plant_(MakePinnedBlock()) {
    plant_.surface = *Surface::Prepare(EggMesh(180));
    patches_ = std::make_shared<SurfacePatches>(*SurfacePatches::Make(*plant_.surface, 1));
  }

  // Points where `seen` says so, `form` off the egg, by two scans; denser where x is positive.
  std::vector<LineScan> Scans(int count, const std::function<double(const Vector3d&)>& form,
                              const std::function<bool(const OnEgg&)>& seen = {}, std::uint64_t seed = 1) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> turn(0, 2 * std::acos(-1)), height(-1, 1), unit(0, 1);
    std::vector<LineScan> scans;
    for (const double b_deg : plant_.b_deg) {
      Points points;
      while (points.size() < static_cast<std::size_t>(count)) {
        const OnEgg at = EggAt(turn(random), std::asin(height(random)));
        if (at.point_mm.x() < 0 && unit(random) < 0.6) continue;
        if (seen && !seen(at)) continue;
        points.push_back(at.point_mm + form(at.point_mm) * at.normal);
      }
      for (int i = 0; i < count / 200; ++i)  // chips and strays
        points.push_back(EggAt(turn(random), std::asin(height(random))).point_mm * (1.2 + unit(random)));
      scans.push_back(Scanned(plant_, b_deg, points, &random));
    }
    return scans;
  }
  absl::StatusOr<DeviationField> Field(const std::vector<LineScan>& scans, const RegisteredPose& pose, int threads = 2,
                                       std::vector<std::vector<std::uint32_t>> regions = {}) const {
    DeviationOptions options;
    options.threads = threads;
    DeviationMap map(plant_.surface, patches_, PartMapping(pose, plant_.sensor, plant_.axes), options,
                     std::move(regions));
    for (const LineScan& scan : scans)
      if (absl::Status added = map.Add(scan); !added.ok()) return added;
    return map.Finish();
  }
  std::vector<std::uint32_t> All() const {
    std::vector<std::uint32_t> all(patches_->patches().size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    return all;
  }

  PinnedBlock plant_;
  std::shared_ptr<const SurfacePatches> patches_;
};

TEST_F(Egg, PatchesAreItsArea) {
  // Thomsen's is good to a hundredth; the mesh's own area is exact.
  EXPECT_NEAR(patches_->area_mm2() / plant_.surface->area_mm2(), 1, 1e-9);
  double greatest_mm2 = 0;
  for (const SurfacePatch& patch : patches_->patches()) greatest_mm2 = std::max(greatest_mm2, patch.area_mm2);
  EXPECT_LT(greatest_mm2, std::sqrt(3) + 1e-9);  // of a cell, cut across
  EXPECT_THAT(std::string(SurfacePatches::Make(*plant_.surface, 0.01).status().message()),
              HasSubstr("patch_mm: 0.01, want 0.1 to 20"));
}

// A sliver of a metre is sampled along its length alone; a surface of very many is refused before it takes minutes.
TEST(SurfacePatchesOf, SliversAreNotSampledAcross) {
  const auto slivers = [](int count) {
    TriangleMesh mesh;
    for (int i = 0; i <= count; ++i) {
      mesh.vertices_mm.emplace_back(0, 1e-4 * i, 0);
      mesh.vertices_mm.emplace_back(1000, 1e-4 * i, 0);
    }
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
      mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
      mesh.triangles.push_back({2 * i + 1, 2 * i + 3, 2 * i + 2});
    }
    return *Surface::Prepare(mesh);
  };
  const auto few = SurfacePatches::Make(*slivers(10), 0.1);
  ASSERT_TRUE(few.ok()) << few.status();
  EXPECT_NEAR(few->area_mm2(), 1, 1e-9);
  EXPECT_THAT(std::string(SurfacePatches::Make(*slivers(2000), 0.1).status().message()),
              HasSubstr("patch_mm: 0.1, want a greater one"));
}

TEST_F(Egg, MeansAreThoseOfItsForm) {
  const auto field = Field(Scans(400'000, FormOf), plant_.pose);
  ASSERT_TRUE(field.ok()) << field.status();
  double worst_um = 0, squares = 0, weight = 0;
  for (std::size_t p = 0; p < field->patches.size(); ++p) {
    const PatchDeviation& found = field->patches[p];
    if (!found.mean_mm || found.point_count < 100) continue;
    const double off_um = 1e3 * (*found.mean_mm - FormOf(patches_->patches()[p].centre_mm));
    worst_um = std::max(worst_um, std::abs(off_um));
    squares += found.point_count * off_um * off_um;
    weight += found.point_count;
    // 2 um along the sensor's ray, and what the form changes within a millimetre.
    EXPECT_LT(found.standard_deviation_mm, 4e-3);
  }
  std::printf("means of patches off the form: rms %.3f um, worst %.3f um\n", std::sqrt(squares / weight), worst_um);
  EXPECT_LT(std::sqrt(squares / weight), 0.35);
  EXPECT_LT(worst_um, 3);
  EXPECT_GT(field->whole.seen_area_mm2 / field->whole.area_mm2, 0.98);
  EXPECT_GT(field->points.far_off, 1000);
  EXPECT_EQ(field->points.at_edges, 0);
}

TEST_F(Egg, OfRegionsAreTheirStatistics) {
  std::vector<std::uint32_t> upper;
  for (const std::uint32_t p : All())
    if (patches_->patches()[p].centre_mm.z() > 10) upper.push_back(p);
  const auto field =
      Field(Scans(300'000, [](const Vector3d& at) { return at.z() > 10 ? 0.05 : -0.02; }), plant_.pose, 2, {upper});
  ASSERT_TRUE(field.ok()) << field.status();
  ASSERT_EQ(field->regions.size(), 1u);
  const DeviationStatistics& region = field->regions[0];
  ASSERT_TRUE(region.values && field->whole.values);
  EXPECT_NEAR(region.values->p50_mm, 0.05, 2e-4);
  EXPECT_NEAR(region.values->mean_mm, 0.05, 3e-3);  // patches across z = 10 have both
  EXPECT_NEAR(field->whole.values->p05_mm, -0.02, 5e-3);
  EXPECT_LT(region.area_mm2, 0.5 * field->whole.area_mm2);
  EXPECT_GT(patches_->patches()[field->whole.values->highest].centre_mm.z(), 9);
}

TEST_F(Egg, GivesTheSameBitsOnAnyNumberOfThreads) {
  const auto scans = Scans(60'000, FormOf);
  const auto one = Field(scans, plant_.pose, 1), four = Field(scans, plant_.pose, 4);
  ASSERT_TRUE(one.ok() && four.ok());
  for (std::size_t p = 0; p < one->patches.size(); ++p) {
    EXPECT_EQ(one->patches[p].mean_mm, four->patches[p].mean_mm);
    EXPECT_EQ(one->patches[p].standard_uncertainty_mm, four->patches[p].standard_uncertainty_mm);
  }
  EXPECT_EQ(one->whole.values->p95_mm, four->whole.values->p95_mm);
}

TEST_F(Egg, OutOfProfileIsFoundWithItsArea) {
  const auto field = Field(Scans(300'000, [](const Vector3d& at) { return FormOf(at) + BossOf(at); }), plant_.pose);
  ASSERT_TRUE(field.ok()) << field.status();
  ProfileTolerance tolerance;
  tolerance.lower_mm = -0.06;
  tolerance.upper_mm = 0.1;
  const auto finding = JudgeProfile(*field, All(), tolerance);
  ASSERT_TRUE(finding.ok()) << finding.status();
  EXPECT_EQ(finding->verdict, Verdict::kNotConform);
  ASSERT_EQ(finding->areas.size(), 1u);
  const ProfileArea& area = finding->areas[0];
  EXPECT_TRUE(area.above);
  EXPECT_LT((patches_->patches()[area.worst].centre_mm - Vector3d(kAxes_mm.x(), 0, 0)).norm(), 1.2);
  EXPECT_NEAR(area.worst_mm, 0.2 + FormOf({5, 0, 0}), 0.02);  // the mean of a millimetre about its top
  // Where form and boss are more than 0.1 mm together: within 1.55 mm of its top, 7.5 mm2; patches are whole.
  EXPECT_GT(area.area_mm2, 5);
  EXPECT_LT(area.area_mm2, 10);

  tolerance.upper_mm = 0.3;
  EXPECT_EQ(JudgeProfile(*field, All(), tolerance)->verdict, Verdict::kConform);
}

TEST_F(Egg, WhatWasNotSeenPassesNothing) {
  const auto field = Field(Scans(200'000, FormOf, [](const OnEgg& at) { return at.point_mm.y() > 0; }), plant_.pose);
  ASSERT_TRUE(field.ok()) << field.status();
  const auto finding = JudgeProfile(*field, All(), {ProfileZone::kFormAndLocation, -0.1, 0.1, 0.95});
  ASSERT_TRUE(finding.ok());
  EXPECT_EQ(finding->verdict, Verdict::kNotMeasured);
  EXPECT_NEAR(finding->coverage, 0.5, 0.03);
  EXPECT_THAT(finding->reason, HasSubstr("want 95 % or more"));
  // What is out is out, however little was seen.
  EXPECT_EQ(JudgeProfile(*field, All(), {ProfileZone::kFormAndLocation, -0.1, 0.01, 0.95})->verdict,
            Verdict::kNotConform);
}

// A pose that is off moves the zone of form and location, and not that of form.
TEST_F(Egg, FormIsFreeOfThePose) {
  const auto scans = Scans(200'000, FormOf);
  const auto field = Field(scans, plant_.pose);
  RegisteredPose off = plant_.pose;
  off.zero_from_part = Perturbed(off.zero_from_part, (Vector6d() << 1e-3, -5e-4, 8e-4, 0.03, -0.02, 0.04).finished(),
                                 off.noise.reference_mm);
  const auto moved = Field(scans, off);
  ASSERT_TRUE(field.ok() && moved.ok());
  const ProfileTolerance form{ProfileZone::kForm, -0.1, 0.1, 0.9};
  const auto one = JudgeProfile(*field, All(), form), other = JudgeProfile(*moved, All(), form);
  ASSERT_TRUE(one.ok() && other.ok());
  double worst_um = 0, squares = 0, count = 0, moved_um = 0;
  for (std::size_t p = 0; p < one->deviations_mm.size(); ++p) {
    if (std::isnan(one->deviations_mm[p]) || std::isnan(other->deviations_mm[p])) continue;
    if (field->patches[p].point_count < 50) continue;
    const double off_um = 1e3 * std::abs(one->deviations_mm[p] - other->deviations_mm[p]);
    worst_um = std::max(worst_um, off_um);
    squares += off_um * off_um;
    ++count;
    moved_um = std::max(moved_um, 1e3 * std::abs(*field->patches[p].mean_mm - *moved->patches[p].mean_mm));
  }
  std::printf("by the pose: deviations %.1f um, form %.2f um at most, rms %.2f\n", moved_um, worst_um,
              std::sqrt(squares / count));
  EXPECT_LT(std::sqrt(squares / count), 0.5);
  EXPECT_GT(moved_um, 40);
  EXPECT_LT(worst_um, 5);  // of second order: 60 um aside, on radii down to 1.25 mm
}

// Poses drawn as uncertain as they are stated: the truth lies within U of a patch in 95 % of draws; and the form's U holds none of the pose.
TEST_F(Egg, StatesWhatThePoseLeavesOpen) {
  const auto scans = Scans(40'000, FormOf);
  RegisteredPose stated = plant_.pose;
  Vector6d sigmas;
  sigmas << 1e-4, 5e-5, 8e-5, 4e-3, 3e-3, 5e-3;
  stated.noise.values = sigmas.cwiseAbs2().asDiagonal();
  const auto truth = Field(scans, plant_.pose);
  ASSERT_TRUE(truth.ok());
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  int inside = 0, all = 0;
  for (int draw = 0; draw < 40; ++draw) {
    RegisteredPose drawn = stated;
    Vector6d change;
    for (int k = 0; k < 6; ++k) change[k] = sigmas[k] * normal(random);
    drawn.zero_from_part = Perturbed(drawn.zero_from_part, change, drawn.noise.reference_mm);
    const auto field = Field(scans, drawn);
    ASSERT_TRUE(field.ok());
    for (std::size_t p = 0; p < field->patches.size(); p += 17) {
      if (!field->patches[p].mean_mm || !truth->patches[p].mean_mm || field->patches[p].point_count < 30) continue;
      ++all;
      inside += std::abs(*field->patches[p].mean_mm - *truth->patches[p].mean_mm) <=
                field->patches[p].expanded_uncertainty_mm;
    }
    if (draw > 0) continue;
    const auto form = JudgeProfile(*field, All(), {ProfileZone::kForm, -0.1, 0.1, 0.9});
    for (std::size_t p = 0; p < form->deviations_mm.size(); ++p)
      if (field->patches[p].point_count > 30) {
        EXPECT_LT(form->expanded_uncertainties_mm[p], 0.3 * field->patches[p].expanded_uncertainty_mm + 1e-3);
      }
  }
  const double percent = 100.0 * inside / all;
  std::printf("patches whose true mean lies within U: %.1f %% of %d\n", percent, all);
  EXPECT_GT(percent, 90);  // 40 draws of one pose each: a standard deviation of some 2 %
  EXPECT_LT(percent, 99.5);
}

TEST_F(Egg, RefusesWhatIsMalformedByName) {
  EXPECT_THAT(std::string(Field({}, plant_.pose).status().message()), HasSubstr("no patch of the CAD has 10 points"));
  const auto field = Field(Scans(20'000, FormOf), plant_.pose);
  ASSERT_TRUE(field.ok()) << field.status();
  const auto refusal = [&](const std::vector<std::uint32_t>& patches, const ProfileTolerance& tolerance) {
    return std::string(JudgeProfile(*field, patches, tolerance).status().message());
  };
  EXPECT_THAT(refusal(All(), {ProfileZone::kForm, 0.1, -0.1, 0.9}),
              HasSubstr("tolerance.lower_mm: 0.1, want less than upper_mm, which is -0.1"));
  EXPECT_THAT(refusal({}, {ProfileZone::kForm, -0.1, 0.1, 0.9}), HasSubstr("patches: none, want one at least"));
  EXPECT_THAT(refusal(All(), {ProfileZone::kForm, -0.1, 0.1, 2}),
              HasSubstr("tolerance.least_coverage: 2, want 0 to 1"));
  DeviationOptions options;
  options.greatest_point_count = 10;
  DeviationMap map(plant_.surface, patches_, PartMapping(plant_.pose, plant_.sensor, plant_.axes), options);
  EXPECT_TRUE(absl::IsResourceExhausted(map.Add(Scans(20, FormOf)[0])));
  options = {};
  options.keep_going = [] { return false; };
  DeviationMap stopped(plant_.surface, patches_, PartMapping(plant_.pose, plant_.sensor, plant_.axes), options);
  EXPECT_TRUE(absl::IsCancelled(stopped.Add(Scans(20, FormOf)[0])));
}

// Both walls of a plate as thin as a trailing edge: no point is taken for the other wall's.
TEST(ThinPlate, HasTwoWalls) {
  PinnedBlock plant = MakePinnedBlock();
  TriangleMesh mesh = BlockMesh();
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex.z() *= 0.02;  // 0.2 mm
  plant.surface = *Surface::Prepare(mesh);
  const auto patches = std::make_shared<SurfacePatches>(*SurfacePatches::Make(*plant.surface, 1));
  DeviationMap map(plant.surface, patches, PartMapping(plant.pose, plant.sensor, plant.axes), {});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(-14.9, 14.9);
  Points points;
  for (int i = 0; i < 100'000; ++i) points.emplace_back(anywhere(random), anywhere(random), i % 2 == 0 ? 0.02 : -0.23);
  ASSERT_TRUE(map.Add(Scanned(plant, plant.b_deg[0], points, &random)).ok());
  const auto field = map.Finish();
  ASSERT_TRUE(field.ok());
  int seen = 0;
  for (std::size_t p = 0; p < field->patches.size(); ++p) {
    if (!field->patches[p].mean_mm) continue;
    ++seen;
    EXPECT_NEAR(*field->patches[p].mean_mm, patches->patches()[p].normal.z() > 0 ? 0.02 : 0.03, 1.5e-3);
  }
  EXPECT_GT(seen, 1500);
}

}  // namespace
}  // namespace sixpoint::metrology
