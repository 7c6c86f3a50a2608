// Points as a scanner leaves them: noise, waver, outliers, platforms, ends that were not seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "metrology/sections/section_uncertainty.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using P = SectionParameter;

MeasuredSection Measured(const Points& points, const OutlineOptions& options = {},
                         const UncertaintyOptions& uncertainty = {}) {
  const auto outline = MeasuredOutline(points, {}, options);
  EXPECT_TRUE(outline.ok()) << outline.status();
  if (!outline.ok()) return {};
  const auto section = MeasureSection(*outline, uncertainty);
  EXPECT_TRUE(section.ok()) << section.status();
  return section.ok() ? *section : MeasuredSection{};
}

void ExpectWithin(const MeasuredSection& section, P p, double truth, double factor) {
  ASSERT_TRUE(section.values[p]) << NameOf(p) << ": " << ReasonOf(section.values.reason(p));
  EXPECT_LE(std::abs(*section.values[p] - truth), factor * section.uncertainty(p).standard + 1e-6)
      << NameOf(p) << " u " << section.uncertainty(p).standard;
}

// Four standard uncertainties: by chance beyond in 1 of 16,000.
constexpr double kChance = 4;

TEST(MeasuredSections, AreWithinTheirUncertaintiesOfTheTruth) {
  std::mt19937_64 random(21);
  for (int i = 0; i < 4; ++i) {
    Blade blade = RandomBlade(random);
    if (i % 2 == 1) blade.trailing = BladeEnd::kSquare;
    const BladeTruth truth = TruthOf(blade);
    Measuring measuring;
    measuring.form_mm = FourierForm(0.005, 2, 8, random);
    measuring.lean = {0.05, 0.15};
    measuring.outliers = 0.01;
    const std::vector<Vector2d> polygon = PolygonOf(blade, kStepMm);
    const auto nominal = LoopOutline(polygon);
    UncertaintyOptions uncertainty;
    uncertainty.nominal = &nominal->fitted.outline;
    const Points points = MeasuredOn(polygon, measuring, random);
    const auto began = std::chrono::steady_clock::now();
    const MeasuredSection section = Measured(points, {}, uncertainty);
    std::printf("blade %d: waver %.2f um over %.2f mm, %.0f ms\n", i, 1e3 * section.form.sigma_mm,
                section.form.length_mm,
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
    ExpectWithin(section, P::kChordNoseTail, truth.chord_mm, kChance);
    ExpectWithin(section, P::kStaggerNoseTail, truth.stagger_rad, kChance);
    ExpectWithin(section, P::kThicknessInscribed, truth.thickness_mm, kChance);
    ExpectWithin(section, P::kLeadingRadius, truth.lead_radius_mm, kChance);
    if (i % 2 == 1)
      EXPECT_EQ(section.values.reason(P::kTrailingRadius), NotMeasured::kEndIsSquare);
    else
      ExpectWithin(section, P::kTrailingRadius, truth.trail_radius_mm, kChance);
    EXPECT_GT(section.form.sigma_mm, 0.002);
    EXPECT_LT(section.form.sigma_mm, 0.02);
    ASSERT_TRUE(section.profile);
    EXPECT_GT(section.profile->deviation.location.Width(), 0.008);
  }
}

// The polygon begins at the pressure side's leading end and comes to the trailing end half way round.
double TrailingPart(const std::vector<Vector2d>& polygon, const Vector2d& tip) {
  double at = 0, best = INFINITY, found = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    if ((polygon[i] - tip).norm() < best) best = (polygon[i] - tip).norm(), found = at;
    at += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
  }
  return found / at;
}

TEST(MeasuredSections, LeaveOutWhatWasNotSeenAndKeepTheRest) {
  std::mt19937_64 random(22);
  const Blade blade;
  const BladeTruth truth = TruthOf(blade);
  const std::vector<Vector2d> polygon = PolygonOf(blade, kStepMm);
  const double tail = TrailingPart(polygon, truth.trailing_mm), nose = TrailingPart(polygon, truth.leading_mm);
  const MeasuredSection whole = Measured(MeasuredOn(polygon, {}, random));
  for (const double end : {tail, nose}) {
    Measuring measuring;
    measuring.seen = [&](double part) { return std::abs(std::remainder(part - end, 1)) > 0.02; };
    const MeasuredSection partial = Measured(MeasuredOn(polygon, measuring, random));
    const bool is_tail = end == tail;
    EXPECT_EQ(is_tail ? partial.values.trailing : partial.values.leading, EndKind::kNotSeen);
    const NotMeasured reason = is_tail ? NotMeasured::kTrailingEndNotSeen : NotMeasured::kLeadingEndNotSeen;
    for (const P p : {P::kChordNoseTail, P::kStaggerNoseTail, is_tail ? P::kTrailingRadius : P::kLeadingRadius}) {
      EXPECT_FALSE(partial.values[p]) << NameOf(p);
      EXPECT_EQ(partial.values.reason(p), reason) << NameOf(p) << ": " << ReasonOf(partial.values.reason(p));
    }
    for (const P p : {P::kThicknessInscribed, P::kThicknessTwoPoint, is_tail ? P::kLeadingRadius : P::kTrailingRadius})
      ExpectWithin(partial, p, *whole.values[p], 6);
  }
}

TEST(MeasuredSections, MeasureATruncatedEndAsTheFlatItIs) {
  std::mt19937_64 random(23);
  const Blade blade;
  const BladeTruth truth = TruthOf(blade);
  // Cut off 2 mm before the tail, across.
  const Vector2d out = (truth.trailing_mm - CamberPoint(blade, 0.999)).normalized();
  const double cut = out.dot(truth.trailing_mm) - 2;
  std::vector<Vector2d> polygon;
  const std::vector<Vector2d> all = PolygonOf(blade, kStepMm);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector2d &a = all[i], &b = all[(i + 1) % all.size()];
    if (out.dot(a) <= cut) polygon.push_back(a);
    if ((out.dot(a) <= cut) != (out.dot(b) <= cut))
      polygon.push_back(a + (cut - out.dot(a)) / out.dot(b - a) * (b - a));
  }
  const MeasuredSection whole = Measured(MeasuredOn(all, {}, random));
  const MeasuredSection section = Measured(MeasuredOn(polygon, {}, random));
  EXPECT_EQ(section.values.trailing, EndKind::kSquare);
  EXPECT_EQ(section.values.reason(P::kTrailingRadius), NotMeasured::kEndIsSquare);
  ASSERT_TRUE(section.values[P::kTrailingX]);
  EXPECT_NEAR(out.dot(Vector2d(*section.values[P::kTrailingX], *section.values[P::kTrailingY])), cut, 0.003);
  ExpectWithin(section, P::kLeadingRadius, *whole.values[P::kLeadingRadius], 6);
  ExpectWithin(section, P::kThicknessInscribed, *whole.values[P::kThicknessInscribed], 6);
}

// Both places beside a corner may come upon the same one; taken for two, the outline went around twice and its leading end was lost.
int CornersOf(const SectionOutline& outline) {
  const auto& nodes = outline.fitted.outline.nodes();
  return static_cast<int>(
      std::count_if(nodes.begin(), nodes.end(), [](const OutlineNode& node) { return node.before == Join::kCorner; }));
}

// A radius as small as the corners' reach, seen by few points: where an end is known to be round its tip is where it is.
TEST(MeasuredSections, HaveNoCornersWhereEndsAreKnownToBeRound) {
  std::mt19937_64 random(31);
  Blade blade;
  blade.trail_mm = 0.45;
  Measuring measuring;
  measuring.count = 1500;
  OutlineOptions options;
  int taken_for_corners = 0;
  for (int i = 0; i < 12; ++i) {
    const Points points = MeasuredOn(PolygonOf(blade, kStepMm), measuring, random);
    options.without_corners = false;
    const auto free = MeasuredOutline(points, {}, options);
    ASSERT_TRUE(free.ok()) << free.status();
    taken_for_corners += CornersOf(*free) > 0 ? 1 : 0;
    options.without_corners = true;
    const auto round = MeasuredOutline(points, {}, options);
    ASSERT_TRUE(round.ok()) << round.status();
    EXPECT_EQ(CornersOf(*round), 0);
    const auto camber = CamberOf(round->fitted.outline, {});
    ASSERT_TRUE(camber.has_value());
    EXPECT_EQ(camber->trailing.kind, EndKind::kRound);
    // 25 points about the end, 2 um of noise, a window that reaches half around it.
    EXPECT_LT((camber->trailing.tip_mm - TruthOf(blade).trailing_mm).norm(), 0.06);
  }
  std::printf("%d of 12 ends were taken for corners otherwise\n", taken_for_corners);
  EXPECT_GT(taken_for_corners, 0);
}

TEST(MeasuredSections, GoAroundOnce) {
  int square = 0;
  // 1250 is the blade that showed it.
  for (const unsigned seed : {1250u, 3001u, 3002u, 3003u, 3004u, 3005u, 3006u, 3007u, 3008u, 3009u}) {
    std::mt19937_64 random(seed);
    Blade blade = RandomBlade(random);
    blade.trailing = BladeEnd::kSquare;
    const std::vector<Vector2d> polygon = PolygonOf(blade, 0.02);
    double around_mm = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i)
      around_mm += (polygon[(i + 1) % polygon.size()] - polygon[i]).norm();
    Measuring measuring;
    measuring.lean = {0.05, 0.1};
    OutlineOptions options;
    options.noise_um = 2;
    const auto outline = MeasuredOutline(MeasuredOn(polygon, measuring, random), {}, options);
    ASSERT_TRUE(outline.ok()) << outline.status();
    const Outline& fitted = outline->fitted.outline;
    EXPECT_NEAR(fitted.length_mm(), around_mm, 0.003 * around_mm) << "seed " << seed;
    for (std::size_t i = 0; i < fitted.size(); ++i)
      if (fitted.nodes()[i].before == Join::kCorner) ++square;
    const auto camber = CamberOf(fitted, {});
    ASSERT_TRUE(camber);
    EXPECT_LT((camber->leading.tip_mm - TruthOf(blade).leading_mm).norm(), 0.02) << "seed " << seed;
  }
  EXPECT_EQ(square, 20);
}

TEST(MeasuredSections, AreTheSameBitsInAnyOrderOnAnyNumberOfThreads) {
  std::mt19937_64 random(24);
  Points points = MeasuredOn(PolygonOf({}, kStepMm), {}, random);
  const MeasuredSection one = Measured(points);
  std::shuffle(points.begin(), points.end(), random);
  OutlineOptions options;
  options.thread_count = 2;
  UncertaintyOptions uncertainty;
  uncertainty.thread_count = 3;
  const MeasuredSection other = Measured(points, options, uncertainty);
  for (std::size_t i = 0; i < kSectionParameterCount; ++i) {
    const auto p = static_cast<P>(i);
    EXPECT_EQ(one.values[p], other.values[p]) << NameOf(p);
    EXPECT_EQ(one.uncertainty(p).expanded, other.uncertainty(p).expanded) << NameOf(p);
  }
}

TEST(MeasuredSections, TakeTheOutlineThatTheNominalSays) {
  std::mt19937_64 random(25);
  const std::vector<Vector2d> polygon = PolygonOf({}, kStepMm);
  Points points = MeasuredOn(polygon, {}, random);
  Blade beside;
  beside.place_mm = {3, 28};
  const Points others = MeasuredOn(PolygonOf(beside, kStepMm), {}, random);
  points.insert(points.end(), others.begin(), others.end());
  const auto several = MeasuredOutline(points, {}, {});
  ASSERT_FALSE(several.ok());
  EXPECT_EQ(several.status().message(),
            "points: 2 outlines in the section, want one, or a nominal outline that says which");
  const auto nominal = LoopOutline(polygon);
  OutlineOptions options;
  options.nominal = &nominal->fitted.outline;
  ExpectWithin(Measured(points, options), P::kChordNoseTail, TruthOf({}).chord_mm, kChance);
}

TEST(MeasuredSections, TurnWithThePose) {
  std::mt19937_64 random(26);
  Matrix6d values = Matrix6d::Zero();
  values(2, 2) = 1e-8;   // 0.1 mrad about z
  values(3, 3) = 25e-6;  // 5 um along x
  UncertaintyOptions uncertainty;
  uncertainty.pose.emplace(values, Eigen::Vector3d::Zero());
  const MeasuredSection section = Measured(MeasuredOn(PolygonOf({}, kStepMm), {}, random), {}, uncertainty);
  // One tenth of a milliradian is the stagger's, five micrometres the tip's; lengths feel neither.
  EXPECT_NEAR(section.uncertainty(P::kStaggerNoseTail).by_pose, 1e-4, 2e-6);
  const double y = *section.values[P::kLeadingY];
  EXPECT_NEAR(section.uncertainty(P::kLeadingX).by_pose, std::hypot(0.005, 1e-4 * y), 1e-4);
  EXPECT_LT(section.uncertainty(P::kChordNoseTail).by_pose, 5e-5);
  EXPECT_LT(section.uncertainty(P::kThicknessInscribed).by_pose, 5e-5);
}

TEST(MeasuredSections, RefuseByName) {
  std::mt19937_64 random(27);
  const Points points = MeasuredOn(PolygonOf({}, kStepMm), {}, random);
  SectionPlane above;
  above.origin_mm.z() = 5;
  EXPECT_EQ(MeasuredOutline(points, above, {}).status().message(),
            "points: 0 near the plane, want at least 20: it misses the part");
  OutlineOptions options;
  options.half_width_mm = 0;
  options.noise_um = NAN;
  EXPECT_EQ(MeasuredOutline(points, {}, options).status().message(),
            "half_width_mm: 0, want 0.001 to 10; noise_um: NaN, want 0 to 1000");
  Matrix6d values = Matrix6d::Identity();
  values(1, 1) = -1;
  UncertaintyOptions uncertainty;
  uncertainty.pose.emplace(values, Eigen::Vector3d::Zero());
  EXPECT_FALSE(MeasureSection(*MeasuredOutline(points, {}, {}), uncertainty).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
