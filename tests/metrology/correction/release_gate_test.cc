#include "metrology/correction/release_gate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using ::testing::ElementsAre;

GateLimits Usual() {
  GateLimits limits;
  limits.translation_mm = 2;
  limits.rotation_rad = 3 * kRadPerDeg;
  limits.uncertainty_share = 1.0 / 3;
  limits.registration_age_h = 8;
  return limits;
}

// Two holes that allow 30 um, one well known and one less so.
struct TwoHoles {
  std::vector<NominalHoleGroup> groups{1};
  std::vector<CorrectedHoleGroup> corrected{1};
  TwoHoles() {
    groups[0].name = corrected[0].name = "G1";
    groups[0].position_tolerance_mm = 0.03;
    groups[0].inclination_tolerance_rad = 0.5 * kRadPerDeg;
    for (const double u_um : {4.0, 9.0}) {
      CorrectedHole hole;
      hole.name = "H" + std::to_string(corrected[0].holes.size() + 1);
      hole.start_mm = {0.1 * u_um, 0, 0};
      hole.expanded_uncertainty_um = u_um;
      corrected[0].holes.push_back(hole);
    }
    corrected[0].corrected = {1 * kRadPerDeg, -2 * kRadPerDeg};
    corrected[0].a_standard_uncertainty_rad = 0.003 * kRadPerDeg;
    corrected[0].b_standard_uncertainty_rad = 0.004 * kRadPerDeg;
  }
  std::vector<GateCheck> Judge(const GateLimits& limits) const {
    return JudgeHoles(groups, corrected, limits, {"A", "C"});
  }
};

std::vector<std::string> Texts(const std::vector<GateCheck>& checks, bool passed) {
  std::vector<std::string> texts;
  for (const GateCheck& check : checks)
    if (check.passed() == passed) texts.push_back(TextOf(check));
  return texts;
}

TEST(ReleaseGate, SaysWhereItIsWorst) {
  EXPECT_THAT(Texts(TwoHoles().Judge(Usual()), true),
              ElementsAre("START_SHIFT of G1/H2: 0.9 mm, want at most 2 mm",
                          "AXIS_CHANGE of C in G1: 2 deg, want at most 3 deg",
                          "START_UNCERTAINTY of G1/H2: 9 um, want at most 10 um",
                          "AXIS_UNCERTAINTY of G1: 0.01 deg, want at most 0.1667 deg"));
}

// The finding that this was made for: 119 um on holes that allow 30.
TEST(ReleaseGate, AnUncertaintyBeyondItsShareWaits) {
  TwoHoles holes;
  holes.corrected[0].holes[0].expanded_uncertainty_um = 119;
  EXPECT_THAT(Texts(holes.Judge(Usual()), false),
              ElementsAre("START_UNCERTAINTY of G1/H1: 119 um, want at most 10 um"));
  holes.corrected[0].holes[1].expanded_uncertainty_um = 10.01;
  EXPECT_THAT(Texts(holes.Judge(Usual()), false),
              ElementsAre("START_UNCERTAINTY of G1/H1: 119 um, want at most 10 um; 2 do not pass"));
  // The limit is each hole's own: worst is what is farthest beyond it, not what is largest.
  holes.groups.push_back(holes.groups[0]);
  holes.corrected.push_back(holes.corrected[0]);
  holes.groups[1].name = holes.corrected[1].name = "G2";
  holes.groups[1].position_tolerance_mm = 0.003;
  holes.corrected[1].holes[0].expanded_uncertainty_um = 20;
  EXPECT_EQ(holes.Judge(Usual())[2].subject, "G2/H1");
}

TEST(ReleaseGate, ALimitIsMetExactly) {
  TwoHoles holes;
  holes.corrected[0].holes[0].start_mm = {2, 0, 0};
  EXPECT_TRUE(holes.Judge(Usual())[0].passed());
  holes.corrected[0].holes[0].start_mm = {2.0001, 0, 0};
  EXPECT_FALSE(holes.Judge(Usual())[0].passed());
}

// 0 is no default: it lets nothing pass, not even what has not moved.
TEST(ReleaseGate, ALimitOfNothingLetsNothingPass) {
  TwoHoles holes;
  for (CorrectedHole& hole : holes.corrected[0].holes) hole.start_mm = hole.nominal_start_mm;
  for (const GateCheck& check : holes.Judge(GateLimits())) EXPECT_FALSE(check.passed()) << TextOf(check);
  RegistrationEvidence evidence;
  evidence.merge_chi_squared = 0;
  evidence.condition_number = 1;
  evidence.information_kept = 1;
  EXPECT_THAT(Texts(JudgeRegistration(evidence, GateLimits()), false),
              ElementsAre("REGISTRATION_AGE: 0 h, want at most 0 h"));
}

TEST(ReleaseGate, WhatIsNoNumberDoesNotPass) {
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TwoHoles holes;
    holes.corrected[0].holes[0].start_mm.x() = value;
    holes.corrected[0].holes[0].expanded_uncertainty_um = value;
    holes.corrected[0].a_standard_uncertainty_rad = value;
    const auto checks = holes.Judge(Usual());
    for (const int i : {0, 2, 3}) {
      EXPECT_FALSE(checks[i].passed());
      EXPECT_TRUE(std::isfinite(*checks[i].value)) << TextOf(checks[i]);  // the record holds no other
    }
    RegistrationEvidence evidence;
    evidence.has_disagreement = true;
    evidence.disagreement = evidence.merge_chi_squared = evidence.condition_number = evidence.age_h = value;
    evidence.information_kept = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(Texts(JudgeRegistration(evidence, Usual()), true).size(), 1u);  // no direction was held
  }
}

TEST(ReleaseGate, WhatIsNotKnownDoesNotPass) {
  RegistrationEvidence evidence;
  evidence.has_disagreement = true;
  EXPECT_THAT(Texts(JudgeRegistration(evidence, Usual()), false),
              ElementsAre("DISAGREEMENT: not known, want at most 4.1", "MERGE: not known, want at most 0",
                          "CONDITION: not known, want at most 100", "INFORMATION: not known, want at least 0.5"));
  evidence.condition_number = 5;
  evidence.has_disagreement = false;  // best fit: there is nothing to disagree with
  evidence.merge_chi_squared = 3;
  evidence.merge_limit = 16.3;
  evidence.information_kept = 0.5;
  EXPECT_THAT(Texts(JudgeRegistration(evidence, Usual()), false), ElementsAre());
}

TEST(ReleaseGate, CountsWhatSpeaksAgainstIt) {
  EXPECT_TRUE(CountAgainst(GateCheckKind::kClamping, {}).passed());
  EXPECT_EQ(TextOf(CountAgainst(GateCheckKind::kCutBefore, {"G1/H1", "G1/H2"})),
            "CUT_BEFORE of G1/H1: 2, want at most 0; 2 do not pass");
}

}  // namespace
}  // namespace sixpoint::metrology
