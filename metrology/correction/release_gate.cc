#include "metrology/correction/release_gate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

constexpr double kCoverage = 2;        // of an axis's standard uncertainty
constexpr double kMostFigure = 1e299;  // a figure that no number holds
constexpr double kLimitSlack = 1e-9;   // of a limit: what text and back may change

bool IsAtLeast(GateCheckKind kind) {
  return kind == GateCheckKind::kInformation || kind == GateCheckKind::kKeepOut ||
         kind == GateCheckKind::kLineOfSight || kind == GateCheckKind::kToolCylinder;
}

const char* UnitOf(GateCheckKind kind) {
  switch (kind) {
    case GateCheckKind::kStartShift:
    case GateCheckKind::kTravel:
    case GateCheckKind::kKeepOut:
    case GateCheckKind::kLineOfSight:
    case GateCheckKind::kToolCylinder:
      return " mm";
    case GateCheckKind::kAxisChange:
    case GateCheckKind::kAxisUncertainty:
      return " deg";
    case GateCheckKind::kStartUncertainty:
    case GateCheckKind::kShapeGouge:
      return " um";
    case GateCheckKind::kRegistrationAge:
      return " h";
    default:
      return "";
  }
}

// The worst of many, by how far each is from its own limit.
class Worst {
 public:
  explicit Worst(GateCheckKind kind) { check_.kind = kind; }
  void Look(const std::string& subject, double value, double limit) {
    const bool sound = std::isfinite(value);
    // A limit of 0 lets nothing pass.
    check_.failed_count += sound && limit > 0 && value <= limit * (1 + kLimitSlack) ? 0 : 1;
    const double badness = sound && limit > 0 ? value / limit : std::numeric_limits<double>::infinity();
    if (check_.value.has_value() && !(badness > worst_)) return;
    worst_ = badness;
    check_.subject = subject;
    check_.value = sound ? value : kMostFigure;
    check_.limit = limit;
  }
  const GateCheck& check() const { return check_; }

 private:
  GateCheck check_;
  double worst_ = 0;
};

// One figure of the whole.
GateCheck AtMost(GateCheckKind kind, std::optional<double> value, double limit) {
  GateCheck check{kind, "", value, limit, 0};
  if (value.has_value() && !std::isfinite(*value)) check.value = kMostFigure;
  check.failed_count = value.has_value() && *value <= limit ? 0 : 1;
  return check;
}
GateCheck AtLeast(GateCheckKind kind, std::optional<double> value, double limit) {
  GateCheck check{kind, "", value, limit, 0};
  check.failed_count = value.has_value() && *value >= limit ? 0 : 1;
  return check;
}

std::string Figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

std::string NameOf(GateCheckKind kind) {
  switch (kind) {
    case GateCheckKind::kStartShift:
      return "START_SHIFT";
    case GateCheckKind::kAxisChange:
      return "AXIS_CHANGE";
    case GateCheckKind::kStartUncertainty:
      return "START_UNCERTAINTY";
    case GateCheckKind::kAxisUncertainty:
      return "AXIS_UNCERTAINTY";
    case GateCheckKind::kDisagreement:
      return "DISAGREEMENT";
    case GateCheckKind::kMerge:
      return "MERGE";
    case GateCheckKind::kCondition:
      return "CONDITION";
    case GateCheckKind::kInformation:
      return "INFORMATION";
    case GateCheckKind::kHeldDirections:
      return "HELD_DIRECTIONS";
    case GateCheckKind::kRegistrationAge:
      return "REGISTRATION_AGE";
    case GateCheckKind::kClamping:
      return "CLAMPING";
    case GateCheckKind::kTravel:
      return "TRAVEL";
    case GateCheckKind::kKeepOut:
      return "KEEP_OUT";
    case GateCheckKind::kLineOfSight:
      return "LINE_OF_SIGHT";
    case GateCheckKind::kCutBefore:
      return "CUT_BEFORE";
    case GateCheckKind::kSensorCalibration:
      return "SENSOR_CALIBRATION";
    case GateCheckKind::kInterimCheck:
      return "INTERIM_CHECK";
    case GateCheckKind::kScrapped:
      return "SCRAPPED";
    case GateCheckKind::kToolCylinder:
      return "TOOL_CYLINDER";
    case GateCheckKind::kModelNotNamed:
      return "MODEL_NOT_NAMED";
    case GateCheckKind::kShapeGouge:
      return "SHAPE_GOUGE";
  }
  return "";
}

std::string TextOf(const GateCheck& check) {
  const std::string unit = UnitOf(check.kind);
  std::string text = NameOf(check.kind) + (check.subject.empty() ? "" : " of " + check.subject) + ": ";
  text += check.value.has_value() ? Figure(*check.value) + unit : "not known";
  text += std::string(", want at ") + (IsAtLeast(check.kind) ? "least " : "most ") + Figure(check.limit) + unit;
  if (check.failed_count > 1) text += "; " + std::to_string(check.failed_count) + " do not pass";
  return text;
}

std::vector<GateCheck> JudgeHoles(const std::vector<NominalHoleGroup>& groups,
                                  const std::vector<CorrectedHoleGroup>& corrected, const GateLimits& limits,
                                  const std::array<std::string, 2>& axes) {
  Worst shift(GateCheckKind::kStartShift), change(GateCheckKind::kAxisChange);
  Worst start(GateCheckKind::kStartUncertainty), axis(GateCheckKind::kAxisUncertainty);
  for (std::size_t i = 0; i < groups.size() && i < corrected.size(); ++i) {
    const CorrectedHoleGroup& group = corrected[i];
    const double rotation_deg = limits.rotation_rad * kDegPerRad;
    change.Look(axes[0] + " in " + group.name, kDegPerRad * std::abs(group.corrected.a_rad - group.nominal.a_rad),
                rotation_deg);
    change.Look(axes[1] + " in " + group.name, kDegPerRad * std::abs(group.corrected.b_rad - group.nominal.b_rad),
                rotation_deg);
    // Both axes turn the direction: their errors may add.
    axis.Look(group.name,
              kDegPerRad * (group.tilt_rad + kCoverage * std::hypot(group.a_standard_uncertainty_rad,
                                                                    group.b_standard_uncertainty_rad,
                                                                    group.tilt_standard_uncertainty_rad)),
              limits.uncertainty_share * groups[i].inclination_tolerance_rad * kDegPerRad);
    for (const CorrectedHole& hole : group.holes) {
      const std::string name = group.name + "/" + hole.name;
      shift.Look(name, (hole.start_mm - hole.nominal_start_mm).norm(), limits.translation_mm);
      start.Look(name, hole.expanded_uncertainty_um, limits.uncertainty_share * 1e3 * groups[i].position_tolerance_mm);
    }
  }
  return {shift.check(), change.check(), start.check(), axis.check()};
}

GateCheck JudgeShapeGouge(const std::vector<std::pair<std::string, double>>& gouge_um) {
  Worst gouge(GateCheckKind::kShapeGouge);
  for (const auto& [path, um] : gouge_um) gouge.Look(path, um, kGreatestShapeGouge_um);
  return gouge.check();
}

std::vector<GateCheck> JudgeRegistration(const RegistrationEvidence& evidence, const GateLimits& limits) {
  std::vector<GateCheck> checks;
  if (evidence.has_disagreement)
    checks.push_back(AtMost(GateCheckKind::kDisagreement, evidence.disagreement, kGreatestDisagreement));
  checks.push_back(AtMost(GateCheckKind::kMerge, evidence.merge_chi_squared, evidence.merge_limit));
  checks.push_back(AtMost(GateCheckKind::kCondition, evidence.condition_number, kGreatestConditionNumber));
  checks.push_back(AtLeast(GateCheckKind::kInformation, evidence.information_kept, kLeastInformationKept));
  checks.push_back(AtMost(GateCheckKind::kHeldDirections, evidence.held_directions, 0));
  GateCheck age = AtMost(GateCheckKind::kRegistrationAge, evidence.age_h, limits.registration_age_h);
  if (!(limits.registration_age_h > 0)) age.failed_count = 1;
  checks.push_back(age);
  return checks;
}

GateCheck CountAgainst(GateCheckKind kind, const std::vector<std::string>& against) {
  GateCheck check{kind, against.empty() ? "" : against.front(), static_cast<double>(against.size()), 0,
                  static_cast<int>(against.size())};
  return check;
}

}  // namespace sixpoint::metrology
