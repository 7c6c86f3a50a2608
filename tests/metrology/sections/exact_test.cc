// Exact outlines: what is evaluated beside what is known in closed form, or found by brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "metrology/sections/edge_circle.h"
#include "metrology/sections/outlines.h"
#include "metrology/sections/section_parameters.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using P = SectionParameter;

constexpr double kDegree = 3.14159265358979323846 / 180;

SectionValues Evaluated(const std::vector<Vector2d>& polygon) {
  const auto made = LoopOutline(polygon);
  EXPECT_TRUE(made.ok()) << made.status();
  if (!made.ok()) return {};
  return ValuesOf(made->fitted.outline, CamberOf(made->fitted.outline, {}));
}

double OffUm(const SectionValues& values, P parameter, double truth) {
  return values[parameter] ? 1e3 * std::abs(*values[parameter] - truth) : 1e9;
}

double OffDeg(const SectionValues& values, P parameter, double truth_rad) {
  return values[parameter] ? std::abs(std::remainder(*values[parameter] - truth_rad, 360 * kDegree)) / kDegree : 1e9;
}

TEST(ExactSections, AreThoseOfFiftyRandomBlades) {
  std::mt19937_64 random(7);
  double chord_um = 0, thickness_um = 0, radius_um = 0, angle_deg = 0;
  for (int i = 0; i < 50; ++i) {
    Blade blade = RandomBlade(random);
    if (i % 3 == 1) blade.trailing = BladeEnd::kSquare;
    if (i % 3 == 2) blade.leading = BladeEnd::kEllipse, blade.flat_laws = true;
    const BladeTruth truth = TruthOf(blade);
    const SectionValues values = Evaluated(PolygonOf(blade, kStepMm));
    SCOPED_TRACE(i);
    EXPECT_EQ(values.leading, EndKind::kRound);
    EXPECT_EQ(values.trailing, i % 3 == 1 ? EndKind::kSquare : EndKind::kRound);
    const double chord = OffUm(values, P::kChordNoseTail, truth.chord_mm);
    const double thickness = OffUm(values, P::kThicknessInscribed, truth.thickness_mm);
    double radius = blade.leading == BladeEnd::kCircle ? OffUm(values, P::kLeadingRadius, truth.lead_radius_mm) : 0;
    if (i % 3 == 1)
      EXPECT_EQ(values.reason(P::kTrailingRadius), NotMeasured::kEndIsSquare);
    else
      radius = std::max(radius, OffUm(values, P::kTrailingRadius, truth.trail_radius_mm));
    const double angle = OffDeg(values, P::kStaggerNoseTail, truth.stagger_rad);
    if (std::max({chord, thickness, radius}) > 1 || angle > 0.003)
      std::printf("blade %d: chord %.3f thickness %.3f radius %.3f um, %.5f deg\n", i, chord, thickness, radius, angle);
    chord_um = std::max(chord_um, chord);
    thickness_um = std::max(thickness_um, thickness);
    radius_um = std::max(radius_um, radius);
    angle_deg = std::max(angle_deg, angle);
  }
  std::printf("50 blades, worst: chord %.3f, thickness %.3f, radius %.3f um; stagger %.5f deg\n", chord_um,
              thickness_um, radius_um, angle_deg);
  EXPECT_LE(chord_um, 2);
  EXPECT_LE(thickness_um, 2);
  EXPECT_LE(radius_um, 2);
  EXPECT_LE(angle_deg, 0.005);
}

// What an algorithm is by its definition, from the polygon alone.
TEST(ExactSections, JawsAndTangentsAreThoseOfBruteForce) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 5; ++i) {
    Blade blade = RandomBlade(random);
    blade.turning_rad = 1.2;
    const std::vector<Vector2d> polygon = PolygonOf(blade, 0.05);
    const SectionValues values = Evaluated(polygon);
    double longest_mm = 0;
    for (const Vector2d& p : polygon)
      for (const Vector2d& q : polygon) longest_mm = std::max(longest_mm, (p - q).norm());
    EXPECT_LE(OffUm(values, P::kChordCaliper, longest_mm), 1);
    // The direction whose line leaves the least of the outline's hollow side bare: all points on one side, turned until that is so.
    ASSERT_TRUE(values[P::kStaggerTangent]);
    const double angle = *values[P::kStaggerTangent];
    const Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    std::vector<double> heights;
    double from = INFINITY, to = -INFINITY;
    for (const Vector2d& p : polygon) {
      heights.push_back(p.dot(across));
      from = std::min(from, p.dot(along));
      to = std::max(to, p.dot(along));
    }
    const double line = *std::min_element(heights.begin(), heights.end());
    double first = INFINITY, last = -INFINITY;
    for (std::size_t k = 0; k < polygon.size(); ++k)
      if (heights[k] < line + 2e-4) {
        first = std::min(first, polygon[k].dot(along));
        last = std::max(last, polygon[k].dot(along));
      }
    EXPECT_GT(last - first, 0.5 * (to - from)) << "touches at two places";
    EXPECT_LE(OffUm(values, P::kChordTangent, to - from), 1);
    EXPECT_GT(std::abs(*values[P::kChordTangent] - *values[P::kChordNoseTail]), 1e-3) << "two methods differ";
  }
}

TEST(ExactSections, FindTheNoseOfAVaneWhoseBackIsFartherFromTheTail) {
  Blade vane;
  vane.arc_mm = 60;
  vane.turning_rad = 2.6;
  vane.bulge_mm = 5;
  vane.skew = 0.9;
  vane.lead_mm = 1.2;
  vane.trail_mm = 0.4;
  const BladeTruth truth = TruthOf(vane);
  const std::vector<Vector2d> polygon = PolygonOf(vane, kStepMm);
  double farthest_mm = 0;
  Vector2d farthest = truth.leading_mm;
  for (const Vector2d& p : polygon)
    if ((p - truth.trailing_mm).norm() > farthest_mm) farthest_mm = (p - truth.trailing_mm).norm(), farthest = p;
  ASSERT_GT((farthest - truth.leading_mm).norm(), 2) << "the case is none";
  const auto made = LoopOutline(polygon);
  ASSERT_TRUE(made.ok()) << made.status();
  const auto camber = CamberOf(made->fitted.outline, LeadingHint{truth.leading_mm});
  const SectionValues values = ValuesOf(made->fitted.outline, camber);
  std::printf(
      "vane: farthest place %.2f mm from the nose; chord off %.3f um, radius off %.3f um, stagger off %.5f deg\n",
      (farthest - truth.leading_mm).norm(), OffUm(values, P::kChordNoseTail, truth.chord_mm),
      OffUm(values, P::kLeadingRadius, truth.lead_radius_mm), OffDeg(values, P::kStaggerNoseTail, truth.stagger_rad));
  EXPECT_LE(OffUm(values, P::kChordNoseTail, truth.chord_mm), 2);
  EXPECT_LE(OffUm(values, P::kLeadingRadius, truth.lead_radius_mm), 2);
  EXPECT_LE(OffDeg(values, P::kStaggerNoseTail, truth.stagger_rad), 0.005);
  EXPECT_GT(std::abs(*values[P::kChordCaliper] - *values[P::kChordNoseTail]), 0.1);
}

// The digits' thickness is laid across the camber line; of a symmetrical section its circles are known: half thickness y(x), each circle touching
// at x has its centre at x + y y' and the radius y sqrt(1 + y'^2).
TEST(ExactSections, AreThoseOfNacaSections) {
  constexpr double kChordMm = 40, kThick = 0.12;
  const auto half = [&](double x) {
    return 5 * kThick *
           (0.2969 * std::sqrt(x) - 0.126 * x - 0.3516 * x * x + 0.2843 * x * x * x - 0.1015 * x * x * x * x);
  };
  double thick_mm = 0;
  for (double x = 0.2; x < 0.4; x += 1e-5) {
    const double slope = (half(x + 1e-6) - half(x - 1e-6)) / 2e-6;
    thick_mm = std::max(thick_mm, 2 * kChordMm * half(x) * std::sqrt(1 + slope * slope));
  }
  const SectionValues open = Evaluated(Naca4(0, 0.4, kThick, kChordMm, false));
  EXPECT_EQ(open.trailing, EndKind::kSquare);
  EXPECT_LE(OffUm(open, P::kChordNoseTail, kChordMm), 2);
  EXPECT_LE(OffDeg(open, P::kStaggerNoseTail, 0), 0.005);
  EXPECT_LE(OffUm(open, P::kThicknessInscribed, thick_mm), 2);
  EXPECT_EQ(open.reason(P::kChordTangent), NotMeasured::kNoDoubleTangent);
  const SectionValues closed = Evaluated(Naca4(0, 0.4, kThick, kChordMm, true));
  EXPECT_EQ(closed.trailing, EndKind::kSharp);
  EXPECT_EQ(closed.reason(P::kTrailingRadius), NotMeasured::kEndIsSharp);
  EXPECT_LE(OffUm(closed, P::kChordNoseTail, kChordMm), 2);
  // Cambered: the nose is at (0, 0), the open tail's middle at (1, 0).
  const SectionValues cambered = Evaluated(Naca4(0.04, 0.4, kThick, kChordMm, false));
  std::printf("NACA 4412: chord off %.3f um, stagger off %.5f deg\n", OffUm(cambered, P::kChordNoseTail, kChordMm),
              OffDeg(cambered, P::kStaggerNoseTail, 0));
  EXPECT_LE(OffUm(cambered, P::kChordNoseTail, kChordMm), 2);
}

TEST(ExactSections, DoNotChangeWithTheFrameOrTheFirstPoint) {
  Blade blade;
  std::vector<Vector2d> polygon = PolygonOf(blade, kStepMm);
  const SectionValues values = Evaluated(polygon);
  const double turn = 0.3;
  std::rotate(polygon.begin(), polygon.begin() + 777, polygon.end());
  std::reverse(polygon.begin(), polygon.end());
  for (Vector2d& p : polygon) p = Eigen::Rotation2Dd(turn) * p + Vector2d(100, -50);
  const SectionValues moved = Evaluated(polygon);
  for (const P p : {P::kChordNoseTail, P::kChordCaliper, P::kChordTangent, P::kThicknessInscribed,
                    P::kThicknessTwoPoint, P::kLeadingRadius, P::kTrailingRadius, P::kCamberHeight})
    EXPECT_LE(OffUm(moved, p, *values[p]), 0.3) << NameOf(p);
  for (const P p : {P::kStaggerNoseTail, P::kStaggerTangent, P::kStaggerCaliper})
    EXPECT_LE(OffDeg(moved, p, *values[p] + turn), 0.001) << NameOf(p);
}

TEST(ExactSections, RefuseWhatIsNoOutline) {
  EXPECT_EQ(LoopOutline({{0, 0}, {1, 0}, {0, 1}}).status().message(), "outline: 3 points, want at least 20");
  std::vector<Vector2d> polygon = PolygonOf({}, 0.1);
  polygon[5].x() = NAN;
  EXPECT_FALSE(LoopOutline(polygon).ok());
  EXPECT_FALSE(PartFromSection({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}}).ok());
  EXPECT_FALSE(PartFromSection({{0, 0, NAN}, {0, 0, 1}, {1, 0, 0}}).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
