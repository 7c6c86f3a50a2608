// Shapes for blanks that no lattice made, judged by a surface made anew; blanks that hold no shape, with what is known to cure them.
#include "metrology/reconstruction/reconstruct_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "refusal/refusal.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using sixpoint::testing::BlankOf;
using sixpoint::testing::kPatch_mm;
using sixpoint::testing::Ramp;

constexpr double kEdge_mm = 9;  // from the middle of the chord: beyond are the edges

// A blade of 36 mm chord and 10 mm thickness whose edges have radii of 1.4 mm; made ready once.
const DesignPlaces& ShapeDesign() {
  static const DesignPlaces kDesign = *SampleDesign(sixpoint::testing::LensBlade({18, 5, 24}, 90), 0.3, 2);
  return kDesign;
}

const DesignPlaces& PatchPlaces() {
  static const DesignPlaces kPlaces = *SampleDesign(ShapeDesign().surface, kPatch_mm, 2);
  return kPlaces;
}

std::vector<ShapeRegion> EdgesFootAndBody() {
  ShapeRegion leading, trailing, foot, body;
  leading.name = "leading edge";
  leading.where.minimum_mm = Vector3d(kEdge_mm, -100, -15);
  leading.lower_mm = -1.2;
  leading.upper_mm = 1.2;
  leading.allowance_mm = 0.05;
  trailing = leading;
  trailing.name = "trailing edge";
  trailing.where.minimum_mm = Vector3d(-100, -100, -15);
  trailing.where.maximum_mm = Vector3d(-kEdge_mm, 100, 100);
  foot.name = "foot";
  foot.where.maximum_mm = Vector3d(100, 100, -19);
  foot.kind = RegionKind::kDatum;
  body.name = "body";
  body.rest = true;
  body.kind = RegionKind::kFixed;
  body.lower_mm = -0.5;
  body.upper_mm = 0.5;
  return {leading, trailing, foot, body};
}

ReconstructionOptions ShapeOptions() {
  ReconstructionOptions options;
  options.finest_spacing_mm = 2;
  options.patch_mm = kPatch_mm;
  return options;
}

// Waves and a twist above the foot; edges that are short by so much at mid span, and have stock elsewhere.
BlankOf Blank(double lacking_mm, double wave_mm) {
  return [=](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    const double above = Ramp((x.z() + 19) / 12);
    const Vector3d twist = 0.004 * (x.z() + 19) / 40 * Vector3d(-x.y(), x.x(), 0);
    const double wave = wave_mm * std::sin(x.z() / 5) * std::cos(x.x() / 5);
    const double in_edge = Ramp((std::abs(x.x()) - kEdge_mm) / 9) * Ramp((x.z() + 15) / 10);
    // Along the chord: an edge that is short keeps its radius.
    const double lacks = std::exp(-x.z() * x.z() / 100);
    const Vector3d short_of = -lacking_mm * lacks * Vector3d(x.x() > 0 ? 1 : -1, 0, 0);
    return x + above * (twist + wave * normal) + in_edge * (short_of + 0.4 * (1 - lacks) * normal);
  };
}

std::vector<BlankPatch> Patches(const BlankOf& blank, std::uint64_t seed = 1, bool heavy_tails = false) {
  std::mt19937_64 random(seed);
  return sixpoint::testing::Measured(
      sixpoint::testing::BlankPoints(*ShapeDesign().surface, PatchPlaces().places, blank), 3e-4, heavy_tails, &random);
}

struct Judged {
  double least_allowance_mm = 1e9, fixed_mm = 0, beyond_band_mm = -1e9, datum_mm = 0;
};

// At places that were in no patch and no limit.
Judged Judge(const Reconstruction& made, const std::vector<ShapeRegion>& regions, const BlankOf& blank) {
  Judged judged;
  const auto shape = sixpoint::testing::MovedSurface(*ShapeDesign().surface, *made.deformation);
  const DesignPlaces between = *SampleDesign(ShapeDesign().surface, 0.55, 2);
  for (const sixpoint::testing::BlankPoint& point :
       sixpoint::testing::BlankPoints(*ShapeDesign().surface, between.places, blank)) {
    const ShapeRegion& region = regions[RegionAt(regions, point.place_mm, point.normal)];
    const double distance_mm = shape->Closest(point.point_mm).signed_distance_mm;
    const Vector3d moved_mm = point.place_mm + *made.deformation->DisplacementAt(point.place_mm);
    const double off_mm = ShapeDesign().surface->Closest(moved_mm).signed_distance_mm;
    if (region.kind == RegionKind::kDatum) {
      judged.datum_mm = std::max(judged.datum_mm, std::abs(off_mm));
      continue;
    }
    judged.beyond_band_mm = std::max({judged.beyond_band_mm, region.lower_mm - off_mm, off_mm - region.upper_mm});
    if (region.kind == RegionKind::kFixed) judged.fixed_mm = std::max(judged.fixed_mm, std::abs(distance_mm));
    // Deep in the edge, where all of the allowance is wanted.
    if (region.kind == RegionKind::kMachined && std::abs(point.place_mm.x()) > kEdge_mm + 6.5 &&
        point.place_mm.z() > -8)
      judged.least_allowance_mm = std::min(judged.least_allowance_mm, distance_mm);
  }
  return judged;
}

void ExpectKept(const Reconstruction& made, const BlankOf& blank) {
  ASSERT_EQ(made.outcome, ShapeOutcome::kReconstructed) << made.remark;
  const Judged judged = Judge(made, EdgesFootAndBody(), blank);
  EXPECT_GT(judged.least_allowance_mm, 0.05 - 5e-4);  // the limit, and what reads as 0.000 beside it
  EXPECT_LT(judged.beyond_band_mm, 0);
  EXPECT_LT(judged.fixed_mm, 0.005);
  EXPECT_LT(judged.datum_mm, 0.0015);
  EXPECT_LT(made.worst_step_mm, 0.002 + 1e-3);
  EXPECT_LT(made.worst_kink_rad, 0.1 * 3.14159265 / 180);
}

TEST(ReconstructShape, EdgesThatLackStockAreMovedIntoTheBlank) {
  const BlankOf blank = Blank(0.969, 0.05);
  const auto made = ReconstructShape(ShapeDesign(), Patches(blank), EdgesFootAndBody(), ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  ExpectKept(*made, blank);
  EXPECT_FALSE(made->holding.empty());
  EXPECT_FALSE(made->proof.has_value());
  EXPECT_GT(made->regions[0].greatest_band_use, 0.7);
  EXPECT_GT(made->regions[0].seen_part, 0.99);
  std::printf("%d levels, %d passes, %zu controls, %zu holding, step %.2f um, kink %.4f deg\n", made->level_count,
              made->pass_count, made->control_count, made->holding.size(), 1e3 * made->worst_step_mm,
              made->worst_kink_rad * 180 / 3.14159265);
}

TEST(ReconstructShape, HeavyTailsOfTheNoiseChangeNothing) {
  const BlankOf blank = Blank(0.6, 0.05);
  const auto made = ReconstructShape(ShapeDesign(), Patches(blank, 7, true), EdgesFootAndBody(), ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  ExpectKept(*made, blank);
}

// Nothing lacks: what is fixed is followed, and the rest is left as it was drawn.
TEST(ReconstructShape, ABlankAsDrawnLeavesTheDesign) {
  auto regions = EdgesFootAndBody();
  regions[0].allowance_mm = regions[1].allowance_mm = 0;
  std::vector<BlankPatch> patches = Patches([](const Vector3d& x, const Vector3d&) { return x; });
  for (BlankPatch& patch : patches) patch.standard_uncertainty_mm = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const DesignPlace& place = PatchPlaces().places[i];
    const bool in_edge = std::abs(place.point_mm.x()) > kEdge_mm && place.point_mm.z() > -15;
    patches[i].point_mm = place.point_mm + (in_edge ? 0.1 : 0.0) * place.normal;
  }
  const auto made = ReconstructShape(ShapeDesign(), patches, regions, ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->outcome, ShapeOutcome::kReconstructed) << made->remark;
  EXPECT_EQ(made->level_count, 1);
  EXPECT_LT(made->deformation->controls_mm().colwise().norm().maxCoeff(), 2e-4);
}

// An edge that lacks 1 mm in the middle where its band gives 0.7: with the guard, 0.35 and what the noise adds are lacking, of either kind.
TEST(ReconstructShape, ABlankThatIsTooSmallIsProvenSo) {
  const BlankOf blank = Blank(1, 0);
  auto regions = EdgesFootAndBody();
  regions[0].lower_mm = regions[1].lower_mm = -0.7;
  const auto made = ReconstructShape(ShapeDesign(), Patches(blank), regions, ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->outcome, ShapeOutcome::kInfeasible) << made->remark;
  EXPECT_FALSE(made->deformation.has_value());
  ASSERT_TRUE(made->proof.has_value());
  EXPECT_TRUE(made->proof->of_any_shape);
  EXPECT_GT(made->proof->lacking_mm, 0.15);
  double share = 0;
  for (const HoldingPlace& place : made->proof->conflicts) {
    share += place.share;
    EXPECT_LE(place.region, 1u);
    EXPECT_LT(std::abs(place.place_mm.z()), 5);
  }
  EXPECT_NEAR(share, 1, 1e-12);
  // The worst patch: how far it lies inside, and 50 um and two sigma.
  double worst_mm = 0;
  for (const BlankPatch& patch : Patches(blank)) {
    const SurfacePoint on = ShapeDesign().surface->Closest(patch.point_mm);
    if (std::abs(on.point_mm.x()) > kEdge_mm + 4) worst_mm = std::max(worst_mm, -on.signed_distance_mm);
  }
  const double lacking_mm = worst_mm + 0.05 + 2 * 3e-4 - 0.7;
  for (const auto& relaxed : {made->proof->tolerance, made->proof->stock}) {
    ASSERT_TRUE(relaxed.has_value());
    EXPECT_NEAR(relaxed->at_least_mm, lacking_mm, 0.002);
    EXPECT_GE(relaxed->at_most_mm, relaxed->at_least_mm);
    EXPECT_NEAR(relaxed->at_most_mm, lacking_mm, 0.004);
  }
}

// A fixed wall out of its own tolerance: more stock elsewhere would not help, a wider tolerance would.
TEST(ReconstructShape, AFixedWallOutOfToleranceIsCuredByToleranceAlone) {
  const auto bulged = [](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    return x + 0.7 * std::exp(-(x - Vector3d(0, 5, 0)).squaredNorm() / 60) * normal;
  };
  auto regions = EdgesFootAndBody();
  regions[0].allowance_mm = regions[1].allowance_mm = 0;
  const auto made = ReconstructShape(ShapeDesign(), Patches(bulged), regions, ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_EQ(made->outcome, ShapeOutcome::kInfeasible) << made->remark;
  EXPECT_FALSE(made->proof->stock.has_value());
  ASSERT_TRUE(made->proof->tolerance.has_value());
  EXPECT_NEAR(made->proof->tolerance->at_least_mm, 0.195, 0.01);
  EXPECT_EQ(made->proof->conflicts[0].region, 3u);
}

TEST(ReconstructShape, WhatWasNotSeenIsNeverAssumed) {
  const BlankOf blank = Blank(0.3, 0.03);
  std::vector<BlankPatch> patches = Patches(blank), seen;
  for (const BlankPatch& patch : patches)
    if (!(patch.point_mm.x() > kEdge_mm && patch.point_mm.z() > 5)) seen.push_back(patch);
  const auto made = ReconstructShape(ShapeDesign(), seen, EdgesFootAndBody(), ShapeOptions());
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->outcome, ShapeOutcome::kNotDetermined);
  EXPECT_NE(made->remark.find("leading edge"), std::string::npos) << made->remark;
  EXPECT_EQ(made->remark.find("trailing edge"), std::string::npos) << made->remark;
  EXPECT_FALSE(made->deformation.has_value());
  auto options = ShapeOptions();
  options.least_seen_part = 0.5;
  EXPECT_EQ(ReconstructShape(ShapeDesign(), seen, EdgesFootAndBody(), options)->outcome, ShapeOutcome::kReconstructed);
}

TEST(ReconstructShape, SameBitsOnAnyNumberOfThreads) {
  const auto patches = Patches(Blank(0.8, 0.05));
  auto options = ShapeOptions();
  options.threads = 1;
  const auto one = ReconstructShape(ShapeDesign(), patches, EdgesFootAndBody(), options);
  options.threads = 4;
  const auto other = ReconstructShape(ShapeDesign(), patches, EdgesFootAndBody(), options);
  ASSERT_TRUE(one->deformation && other->deformation);
  EXPECT_TRUE(one->deformation->controls_mm() == other->deformation->controls_mm());
}

std::string Refused(const std::vector<BlankPatch>& blank, const std::vector<ShapeRegion>& regions,
                    const ReconstructionOptions& options) {
  const auto made = ReconstructShape(ShapeDesign(), blank, regions, options);
  if (made.ok()) return made->remark;
  EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument);
  const auto violations = ViolationsOf(made.status());
  return violations.empty() ? "?" : violations[0].field + ": " + violations[0].value;
}

TEST(ReconstructShape, RefusesByName) {
  using ::testing::StartsWith;
  const std::vector<BlankPatch> patches(1, {Vector3d(0, 5, 0), Vector3d::UnitY(), 1e-3});
  const auto with = [&](const std::function<void(std::vector<ShapeRegion>*)>& change) {
    auto regions = EdgesFootAndBody();
    change(&regions);
    return Refused(patches, regions, ShapeOptions());
  };
  EXPECT_THAT(with([](auto* regions) { (*regions)[0].lower_mm = 2; }), StartsWith("regions[0].lower_mm: 2"));
  EXPECT_THAT(with([](auto* regions) { (*regions)[0].allowance_mm = NAN; }), StartsWith("regions[0].allowance_mm"));
  EXPECT_THAT(with([](auto* regions) { (*regions)[0].where.minimum_mm = Vector3d(NAN, 0, 0); }),
              StartsWith("regions[0].where"));
  EXPECT_THAT(with([](auto* regions) { regions->erase(regions->begin(), regions->begin() + 2); }),
              StartsWith("regions: none machined"));
  EXPECT_THAT(with([](auto* regions) { regions->pop_back(); }), ::testing::HasSubstr("places in none"));
  EXPECT_THAT(with([](auto* regions) { regions->push_back(regions->back()); }), StartsWith("regions: 2 with the rest"));
  EXPECT_THAT(with([](auto* regions) { (*regions)[2].where.maximum_mm = Vector3d(100, 100, -10); }),
              ::testing::AllOf(StartsWith("regions[2]: overlaps regions["), ::testing::HasSubstr(" at (")));
  EXPECT_THAT(with([](auto* regions) { regions->clear(); }), StartsWith("regions: 0"));
  EXPECT_THAT(Refused({}, EdgesFootAndBody(), ShapeOptions()), StartsWith("blank: no patch"));
  EXPECT_THAT(Refused({{Vector3d(NAN, 0, 0), Vector3d::UnitX(), 0}}, EdgesFootAndBody(), ShapeOptions()),
              StartsWith("blank[0]"));
  EXPECT_THAT(Refused({{Vector3d::Zero(), Vector3d(2, 0, 0), 0}}, EdgesFootAndBody(), ShapeOptions()),
              StartsWith("blank[0]"));
  auto options = ShapeOptions();
  options.finest_spacing_mm = 0;
  EXPECT_THAT(Refused(patches, EdgesFootAndBody(), options), StartsWith("options.finest_spacing_mm"));
}

// Waves that cells of 8 mm cannot follow: which region, and what remained.
TEST(ReconstructShape, RefusesALatticeThatIsTooCoarse) {
  auto options = ShapeOptions();
  options.finest_spacing_mm = 8;
  EXPECT_THAT(Refused(Patches(Blank(0.1, 0.3)), EdgesFootAndBody(), options),
              ::testing::AllOf(::testing::StartsWith("options.finest_spacing_mm: 8 mm is too coarse"),
                               ::testing::HasSubstr("region body"), ::testing::HasSubstr("kinks by"),
                               ::testing::HasSubstr(" deg")));
}

// Waves of 12.6 mm: said before any pass, by one programme. Each of its rounds asks whether to go on and minds 64 limits more; a full set of 1500 is
// never reached.
TEST(ReconstructShape, ALatticeThatCannotFollowIsRefusedInBoundedWork) {
  auto options = ShapeOptions();
  options.finest_spacing_mm = 8;
  options.fixed_within_mm = options.step_mm = 1e-3;
  int rounds = 0;
  options.keep_going = [&] {
    ++rounds;
    return true;
  };
  const auto wavy = [](const Vector3d& x, const Vector3d& normal) -> Vector3d {
    return x + 0.1 * Ramp((x.z() + 19) / 12) * std::sin(x.z() / 2) * std::cos(x.x() / 2) * normal;
  };
  EXPECT_THAT(Refused(Patches(wavy), EdgesFootAndBody(), options),
              ::testing::AllOf(::testing::StartsWith("options.finest_spacing_mm: 8 mm is too coarse"),
                               ::testing::HasSubstr("region body is missed by at least"), ::testing::HasSubstr(" um")));
  EXPECT_GT(rounds, 0);
  EXPECT_LT(rounds, 1500 / 64);
}

}  // namespace
}  // namespace sixpoint::metrology
