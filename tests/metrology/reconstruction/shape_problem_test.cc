// What a reconstruction measures and asks, beside sheets of which all is known in closed form.
#include "metrology/reconstruction/shape_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

#include "metrology/frames/angles.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using sixpoint::testing::kPatch_mm;

constexpr double kHalf_mm = 8, kStep_mm = 0.05, kUncertainty_mm = 3e-4;

struct Wave {
  double high_mm = 0, of_mm = 1, along_mm = 0;  // the blank's has gone along itself
  double Height(double x) const { return high_mm * std::sin(2 * kPi * (x - along_mm) / of_mm); }
  Vector3d Normal(double x) const {
    const double turn = 2 * kPi / of_mm;
    return Vector3d(-high_mm * turn * std::cos(turn * (x - along_mm)), 0, 1).normalized();
  }
  Vector3d At(double x, double y) const { return Vector3d(x, y, Height(x)); }
};

// An open sheet about the origin that looks up, with vertices and normals of the wave.
std::shared_ptr<const Surface> Sheet(const Wave& wave) {
  TriangleMesh mesh;
  const int across = static_cast<int>(std::lround(2 * kHalf_mm / kStep_mm)), along = 8;
  for (int i = 0; i <= across; ++i)
    for (int j = 0; j <= along; ++j)
      mesh.vertices_mm.push_back(wave.At(-kHalf_mm + kStep_mm * i, -kHalf_mm + 2 * kHalf_mm / along * j));
  const auto triangle = [&](int a, int b, int c) {
    mesh.triangles.push_back(
        {static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
    std::array<Eigen::Vector3f, 3> normals;
    for (std::size_t k = 0; k < 3; ++k)
      normals[k] = wave.Normal(mesh.vertices_mm[mesh.triangles.back()[k]].x()).cast<float>();
    mesh.corner_normals.push_back(normals);
  };
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < along; ++j) {
      const int a = i * (along + 1) + j, b = a + along + 1;
      triangle(a, b, b + 1);
      triangle(a, b + 1, a + 1);
    }
  return *Surface::Prepare(std::move(mesh));
}

// Machined right of x, fixed left of it.
std::vector<ShapeRegion> MachinedRightOf(double x, double allowance_mm) {
  std::vector<ShapeRegion> regions(2);
  regions[0].name = "right";
  regions[0].where.minimum_mm = Vector3d(x, -100, -100);
  regions[0].allowance_mm = allowance_mm;
  regions[0].lower_mm = -1;
  regions[0].upper_mm = 1;
  regions[1] = regions[0];
  regions[1].name = "left";
  regions[1].where = SurfaceRegion();
  regions[1].rest = true;
  regions[1].kind = RegionKind::kFixed;
  return regions;
}

ReconstructionOptions ProblemOptions() {
  ReconstructionOptions options;
  options.patch_mm = kPatch_mm;
  options.blend_mm = 0;
  return options;
}

struct Asked {
  DesignPlaces design;
  std::vector<ShapeRegion> regions;
  ReconstructionOptions options = ProblemOptions();
  std::vector<BlankPatch> blank;

  Asked(const Wave& wave, double machined_from, double allowance_mm)
      : design(*SampleDesign(Sheet(wave), 0.3, 2)), regions(MachinedRightOf(machined_from, allowance_mm)) {}
  ShapeProblem Problem() const {
    return ShapeProblem(design, blank, regions, *AssignRegions(design, regions), options);
  }
  FreeFormDeformation Shifted(const ShapeProblem& problem, const Vector3d& by_mm) const {
    const ControlLattice lattice = problem.LatticeOf(4);
    ControlDisplacements controls_mm(3, static_cast<Eigen::Index>(lattice.control_count()));
    controls_mm.colwise() = by_mm;
    return *FreeFormDeformation::Make(lattice, controls_mm);
  }
};

// Patches over the middle of the sheet, each so high above z = 0.
void AddPatches(double least_x, double most_x, const std::function<double(int i, int j)>& height_mm,
                std::vector<BlankPatch>* blank) {
  for (int i = static_cast<int>(std::ceil(least_x / kPatch_mm)); i * kPatch_mm <= most_x; ++i)
    for (int j = -8; j <= 8; ++j)
      blank->push_back({Vector3d(i * kPatch_mm, j * kPatch_mm, height_mm(i, j)), Vector3d::UnitZ(), kUncertainty_mm});
}

// How far a fixed patch is asked to move, and what noise may explain, as its limits tell.
struct Following {
  double middle_mm, half_mm;
};
Following FollowingOf(const ShapeProblem& problem, const FreeFormDeformation& still, std::size_t patch) {
  const DisplacementLimit limit = problem.Limits(still, 0)[problem.PatchLimit(patch)];
  EXPECT_EQ(limit.most_kind, LimitKind::kFixed);
  return {(limit.least_mm + limit.most_mm) / 2, (limit.most_mm - limit.least_mm) / 2};
}

std::size_t PatchAt(const std::vector<BlankPatch>& blank, double x, double y) {
  for (std::size_t j = 0; j < blank.size(); ++j)
    if (std::abs(blank[j].point_mm.x() - x) < 1e-9 && std::abs(blank[j].point_mm.y() - y) < 1e-9) return j;
  ADD_FAILURE() << "no patch there";
  return 0;
}

// Nine patches stand within 1.5 patches of one: of a tilted plane with signs to and fro a ninth of these is left, and a third of the uncertainty.
TEST(EvenFixed, LeavesANinthOfSignsToAndFroAndAllOfATilt) {
  Asked asked({}, 4, 0);
  constexpr double kSign_mm = 9e-4, kTilt = 2e-3;
  const auto height = [](int i, int j) { return kTilt * kPatch_mm * i + ((i + j) % 2 == 0 ? kSign_mm : -kSign_mm); };
  AddPatches(-6, 6, height, &asked.blank);
  ShapeProblem problem = asked.Problem();
  problem.LookAt(nullptr);
  const auto still = *FreeFormDeformation::Still(problem.LatticeOf(4));
  const std::size_t inner = PatchAt(asked.blank, -2, 0), odd = PatchAt(asked.blank, -2, 0.5);
  const std::size_t corner = PatchAt(asked.blank, -6, -4), machined = PatchAt(asked.blank, 5, 0);
  EXPECT_NEAR(FollowingOf(problem, still, inner).middle_mm, -2 * kTilt + kSign_mm, 1e-9);
  problem.EvenFixed();
  for (const bool anew : {false, true}) {
    if (anew) problem.LookAt(nullptr);
    EXPECT_NEAR(FollowingOf(problem, still, inner).middle_mm, -2 * kTilt + kSign_mm / 9, 1e-9);
    EXPECT_NEAR(FollowingOf(problem, still, odd).middle_mm, -2 * kTilt - kSign_mm / 9, 1e-9);
    EXPECT_NEAR(FollowingOf(problem, still, inner).half_mm,
                asked.options.fixed_within_mm + asked.options.coverage_factor * kUncertainty_mm / 3, 1e-9);
    // Two beside a corner's, and one across: what is left leans inwards by a quarter of a patch.
    EXPECT_NEAR(FollowingOf(problem, still, corner).middle_mm, (-6 + kPatch_mm / 2) * kTilt, 1e-9);
    // What is machined stays as it was measured.
    EXPECT_NEAR(problem.Limits(still, 0)[problem.PatchLimit(machined)].most_mm,
                5 * kTilt + kSign_mm - asked.options.coverage_factor * kUncertainty_mm, 1e-9);
  }
}

// A blank whose waves have gone along by t: with s above, its stock is s + A (sin k(x - t) - sin k x), least s - 2 A sin(k t / 2). Its patches stand
// where there is more.
struct WavesApart {
  static constexpr double kHigh_mm = 0.01, kOf_mm = 1.5, kAlong_mm = 0.15, kStock_mm = 0.05;
  static double Least_mm() { return kStock_mm - 2 * kHigh_mm * std::sin(kPi * kAlong_mm / kOf_mm); }

  Asked asked;
  explicit WavesApart(double allowance_mm) : asked({kHigh_mm, kOf_mm, 0}, -100, allowance_mm) {
    const Wave blank{kHigh_mm, kOf_mm, kAlong_mm};
    // Beside the least, a sixth of a wave to either side: there half of what the waves take is left.
    for (int wave = -4; wave <= 4; ++wave)
      for (const double aside : {-1.0 / 6, 1.0 / 6, 0.5})
        for (int j = -8; j <= 8; ++j) {
          const double x = kAlong_mm / 2 + (wave + aside) * kOf_mm;
          asked.blank.push_back({blank.At(x, j * kPatch_mm) + kStock_mm * Vector3d::UnitZ(), blank.Normal(x), 0});
        }
  }
  // How many guesses lack stock beside a design raised by so much, known to lack nothing before.
  std::size_t Lacking(double raised_mm, double known_along_mm = kAlong_mm, double known_up_mm = kStock_mm) const {
    ShapeProblem problem = asked.Problem();
    problem.LookAt(nullptr);
    EXPECT_EQ(problem.Misses().Most(), 0) << "the patches themselves lack";
    const auto blank_as = asked.Shifted(problem, Vector3d(known_along_mm, 0, known_up_mm));
    problem.LookAt(&blank_as);
    problem.GuessBetween(blank_as);
    const auto still = asked.Shifted(problem, Vector3d::Zero());
    problem.LookAt(&still);
    const std::size_t before = problem.TakeLacking(still);
    if (raised_mm == 0) return before;
    EXPECT_EQ(before, 0u);
    const auto raised = asked.Shifted(problem, Vector3d(0, 0, raised_mm));
    problem.LookAt(&raised);
    const std::size_t taken = problem.TakeLacking(raised);
    // They are patches now: what they lack is among the misses, to what lies between the places that were asked.
    if (taken > 0) {
      EXPECT_NEAR(problem.Misses().missed_mm[0], asked.regions[0].allowance_mm + raised_mm - Least_mm(), 1e-3);
    }
    return taken;
  }
};

// Places stand within 0.1 mm of the least stock: within 1 um of it, the waves bending by 0.18 a millimetre. Cosines of 2.4 deg take 0.1 um.
TEST(BetweenPatches, WhatTheWavesTakeIsAskedAndNoMore) {
  const double least_mm = WavesApart::Least_mm();
  EXPECT_EQ(WavesApart(least_mm - 5e-4).Lacking(0), 0u);
  EXPECT_GT(WavesApart(least_mm + 1.5e-3).Lacking(0), 0u);
}

// What the fit of the whole leaves is taken from the patches about.
TEST(BetweenPatches, PatchesTellWhatTheFitDoesNot) {
  const double least_mm = WavesApart::Least_mm(), known_mm = WavesApart::kStock_mm - 2e-3;
  EXPECT_EQ(WavesApart(least_mm - 5e-4).Lacking(0, WavesApart::kAlong_mm, known_mm), 0u);
  EXPECT_GT(WavesApart(least_mm + 1.5e-3).Lacking(0, WavesApart::kAlong_mm, known_mm), 0u);
}

// What had plenty is not looked at again until the shape has come near.
TEST(BetweenPatches, WhatHadStockLacksItWhereTheShapeHasCome) {
  const double spare_mm = 8e-3;
  EXPECT_EQ(WavesApart(WavesApart::Least_mm() - spare_mm).Lacking(spare_mm - 5e-4), 0u);
  EXPECT_GT(WavesApart(WavesApart::Least_mm() - spare_mm).Lacking(spare_mm + 1.5e-3), 0u);
}

// Without the waves' shift nothing is lost between them.
TEST(BetweenPatches, WavesInStepLackNothing) { EXPECT_EQ(WavesApart(0.03).Lacking(0, 0, 0.05), 0u); }

TEST(Transition, IsTheGreatestDistanceAndSlopeOfAPlaneBesideTheCut) {
  constexpr double kSlope = 1.2e-3, kUp_mm = 2e-4;
  Asked asked({}, 0, 0);
  AddPatches(
      -6, 4, [](int i, int) { return kUp_mm + kSlope * kPatch_mm * i; }, &asked.blank);
  ShapeProblem problem = asked.Problem();
  problem.LookAt(nullptr);
  const ShapeTransition transition = problem.Transition();
  EXPECT_NEAR(transition.kink_rad, std::atan(kSlope), 1e-9);
  EXPECT_EQ(transition.kink_region, 1u);
  // Beside the cut are those within four patches of a machined place, the first of which stands inside by less than one: three of them.
  EXPECT_NEAR(transition.step_mm, 3 * kPatch_mm * kSlope - kUp_mm, 1e-9);
}

// The slope is of the patches within three widths, so a step in the slope far from the cut changes nothing; a line of patches holds none.
TEST(Transition, MindsPatchesWithinReachAndNoLine) {
  Asked far({}, 0, 0), line({}, 0, 0);
  AddPatches(
      -7.5, 0, [](int i, int) { return i < -8 ? 0.1 : 0.0; }, &far.blank);
  ShapeProblem problem = far.Problem();
  problem.LookAt(nullptr);
  EXPECT_NEAR(problem.Transition().kink_rad, 0, 1e-12);
  for (int i = -12; i < 0; ++i)
    line.blank.push_back({Vector3d(i * kPatch_mm / 2, 0, 1e-3 * i), Vector3d::UnitZ(), kUncertainty_mm});
  ShapeProblem alone = line.Problem();
  alone.LookAt(nullptr);
  EXPECT_EQ(alone.Transition().kink_rad, 0);
  EXPECT_GT(alone.Transition().step_mm, 0);
}

// Where the transition kinks, the shape is asked to be nearer than what is left there; elsewhere, and where nothing kinks, nothing is asked anew.
TEST(Transition, WhereItKinksTheShapeIsAskedToBeNearer) {
  constexpr double kSlope = 1.2e-3, kNearer = 0.75;
  Asked asked({}, 0, 0);
  AddPatches(
      -6, 4, [](int i, int) { return i < 0 ? kSlope * kPatch_mm * i : 0.0; }, &asked.blank);
  ShapeProblem problem = asked.Problem();
  problem.LookAt(nullptr);
  const FreeFormDeformation still = asked.Shifted(problem, Vector3d::Zero());
  const auto half_widths_mm = [&] {
    std::vector<double> widths_mm;
    const auto limits = problem.Limits(still, 0);
    for (std::size_t j = 0; j < asked.blank.size(); ++j) {
      const DisplacementLimit& limit = limits[problem.PatchLimit(j)];
      const bool is_fixed = limit.most_kind == LimitKind::kFixed;
      widths_mm.push_back(is_fixed ? (limit.most_mm - limit.least_mm) / 2 : -1);
    }
    return widths_mm;
  };
  const auto before_mm = half_widths_mm();
  EXPECT_FALSE(problem.NarrowAtKinks(1.01 * std::atan(kSlope)));
  EXPECT_EQ(half_widths_mm(), before_mm);
  EXPECT_TRUE(problem.NarrowAtKinks(0.99 * std::atan(kSlope)));
  const auto after_mm = half_widths_mm();
  std::size_t narrowed = 0;
  for (std::size_t j = 0; j < before_mm.size(); ++j) {
    if (before_mm[j] < 0) continue;
    EXPECT_LE(after_mm[j], before_mm[j]);
    if (after_mm[j] == before_mm[j]) continue;
    ++narrowed;
    const double x_mm = asked.blank[j].point_mm.x();
    EXPECT_GT(x_mm, -4) << "far from the cut";
    // About a place within three patches of it something is left by this at most.
    const double left_mm = kSlope * (std::abs(x_mm) + 3 * kPatch_mm);
    EXPECT_LE(after_mm[j], kNearer * left_mm + asked.options.coverage_factor * kUncertainty_mm + 1e-9);
  }
  EXPECT_GT(narrowed, 10u);
  // Asked again, what is left is the same, and so is what is asked.
  EXPECT_TRUE(problem.NarrowAtKinks(0.99 * std::atan(kSlope)));
  EXPECT_EQ(half_widths_mm(), after_mm);
}

// What is left out where it had room is what is missed nowhere: beside every deformation the misses are those of one who measures all.
TEST(LookAt, WhatMayBeMissedIsAsIfAllWereMeasured) {
  Asked asked({0.01, 1.5, 0}, 0, 0.02);
  asked.options.blend_mm = 2;
  AddPatches(
      -7, 7, [](int i, int j) { return i < 0 ? 1e-3 : 0.06 + 1e-3 * (i * 7 % 5) + 1e-3 * (j * 3 % 4); }, &asked.blank);
  ShapeProblem one = asked.Problem(), other = asked.Problem();
  one.LookAt(nullptr);
  other.LookAt(nullptr);
  std::size_t missed = 0, kept = 0;
  const ControlLattice lattice = one.LatticeOf(4);
  ControlDisplacements controls_mm = ControlDisplacements::Zero(3, static_cast<Eigen::Index>(lattice.control_count()));
  std::mt19937_64 random(5);
  std::normal_distribution<double> draw(0, 1);
  for (int step = 0; step < 12; ++step) {
    const double by_mm = step % 3 == 0 ? 0.02 : 1e-3;
    for (Eigen::Index k = 0; k < controls_mm.cols(); ++k)
      for (int axis = 0; axis < 3; ++axis) controls_mm(axis, k) = 0.5 * controls_mm(axis, k) + by_mm * draw(random);
    const auto deformation = *FreeFormDeformation::Make(lattice, controls_mm);
    one.LookAt(&deformation, LookFor::kMissed);
    other.LookAt(&deformation);
    const ShapeMisses quick = one.Misses(), all = other.Misses();
    for (std::size_t k = 0; k < kLimitKinds; ++k) {
      // To what a place that has moved by a nanometre is off.
      EXPECT_NEAR(quick.missed_mm[k], all.missed_mm[k], 3e-6) << "step " << step << ", kind " << k;
      ++(all.missed_mm[k] > 0 ? missed : kept);
    }
  }
  EXPECT_GT(missed, 5u);
  EXPECT_GT(kept, 5u);
}

}  // namespace
}  // namespace sixpoint::metrology
