// What a blade's inspection finds of each hole: from its pin's points to the verdict.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "metrology/inspection/blade_inspection.h"
#include "metrology/inspection/part_mapping.h"
#include "metrology/linear_algebra/symmetric.h"

namespace sixpoint::metrology {
namespace {

std::string FartherThan(const char* what, double reach_mm, double offset_mm) {
  char text[128];
  std::snprintf(text, sizeof text,
                "a %s stands %.3f mm from the hole's axis, want at most %.3f: another hole's, or none", what, offset_mm,
                reach_mm);
  return text;
}

// What is said of the pins that go into it is none of its own.
NominalPin BareHole(NominalPin hole) {
  hole.gauge.reset();
  hole.standing.reset();
  return hole;
}

template <typename PinPoints>
Points InPart(const PinPoints& points) {
  Points in_part;
  in_part.reserve(points.size());
  for (const auto& point : points) in_part.push_back(point.in_part_mm);
  return in_part;
}

}  // namespace

std::vector<MovedHole> BladeInspection::MovedBy(const NominalPin& nominal, const HoleError& error) const {
  std::vector<MovedHole> all;
  for (const Eigen::Isometry3d& other : options_.other_zero_from_part) {
    const Eigen::Isometry3d moved = other.inverse(Eigen::Isometry) * mapping_.pose().zero_from_part;
    const Eigen::Vector3d axis = moved.linear() * error.axis_in_part;
    Eigen::Vector3d start = moved * error.start_in_part_mm;
    start += nominal.normal.dot(nominal.start_mm - start) / nominal.normal.dot(axis) * axis;  // onto the surface again
    all.push_back({start, axis});
  }
  return all;
}

// An error lies within the difference, either way, as likely here as there: a standard uncertainty of difference / sqrt(3).
void BladeInspection::AddPositioning(const std::vector<MovedHole>& moved, HoleFinding* finding) {
  HoleError& error = finding->error;
  for (const MovedHole& other : moved) {
    const Eigen::Vector3d& axis = other.axis_in_part;
    finding->positioning_difference_mm =
        std::max(finding->positioning_difference_mm, (other.start_in_part_mm - error.start_in_part_mm).norm());
    finding->positioning_difference_rad =
        std::max(finding->positioning_difference_rad,
                 std::atan2(axis.cross(error.axis_in_part).norm(), axis.dot(error.axis_in_part)));
  }
  const auto add = [](double difference, double* standard_uncertainty, double* coverage_factor) {
    const double own = *standard_uncertainty, more = difference / std::sqrt(3.0);
    if (!(more > 0)) return;
    *standard_uncertainty = std::hypot(own, more);
    *coverage_factor = std::hypot(*coverage_factor * own, 2 * more) / *standard_uncertainty;
  };
  add(finding->positioning_difference_mm, &error.position_standard_uncertainty_mm, &error.position_coverage_factor);
  add(finding->positioning_difference_rad, &error.inclination_standard_uncertainty_rad,
      &error.inclination_coverage_factor);
}

BladeInspection::Judged BladeInspection::JudgedHole(std::size_t hole) const {
  std::optional<Judged> first;
  for (const double clearance_mm : options_.pin_clearances_mm) {
    Judged judged = ByPin(hole, clearance_mm);
    if (judged.finding.instrument != HoleInstrument::kNone) return judged;
    if (!first) first = std::move(judged);  // why not is said of all its points
  }
  Judged by_bore = ByBore(hole);
  if (by_bore.finding.instrument != HoleInstrument::kNone) return by_bore;
  first->finding.bore_reason = std::move(by_bore.finding.reason);
  return *std::move(first);
}

BladeInspection::Judged BladeInspection::ByPin(std::size_t hole, double clearance_mm) const {
  const InspectedHole& wanted = holes_[hole];
  std::vector<PinPoint> points;
  for (const PinPoint& point : pin_points_[hole])
    if (point.deviation_mm > clearance_mm) points.push_back(point);
  PinFit fit = FitPin(wanted.pin, InPart(points), options_.pin);
  if (fit.measured && !(fit.offset_mm.norm() <= reach_mm_[hole])) {
    fit.measured = false;
    fit.reason = FartherThan("pin", reach_mm_[hole], fit.offset_mm.norm());
  }
  return ByCylinder(hole, wanted.pin, fit, points, HoleInstrument::kPin);
}

BladeInspection::Judged BladeInspection::ByBore(std::size_t hole) const {
  const NominalPin& drawn = holes_[hole].pin;
  PinFit fit = FitBore(drawn, InPart(bore_points_[hole]), options_.pin, options_.bore);
  if (fit.measured && !(fit.offset_mm.norm() <= reach_mm_[hole])) {
    fit.measured = false;
    fit.reason = FartherThan("bore", reach_mm_[hole], fit.offset_mm.norm());
  }
  int above = 0;
  for (const PinPoint& point : pin_points_[hole])
    above += (point.in_part_mm - drawn.start_mm).cross(drawn.axis).norm() < drawn.hole_diameter_mm / 2;
  if (fit.measured && above > options_.bore.greatest_point_count_above) {
    fit.measured = false;
    fit.reason = std::to_string(above) + " points stand above the surface over the hole, want at most " +
                 std::to_string(options_.bore.greatest_point_count_above) + ": a pin or a chip";
  }
  return ByCylinder(hole, BareHole(drawn), fit, bore_points_[hole], HoleInstrument::kBore);
}

BladeInspection::Judged BladeInspection::ByCylinder(std::size_t hole, const NominalPin& pin, const PinFit& fit,
                                                    const std::vector<PinPoint>& points,
                                                    HoleInstrument instrument) const {
  Judged judged;
  HoleFinding& finding = judged.finding;
  finding.point_count = static_cast<int>(fit.used.size());
  finding.pin_residual_rms_um = fit.residual_rms_um;
  finding.pin_radius_mm = fit.radius_mm;
  finding.reason = fit.reason;
  if (!fit.measured) return judged;

  const bool by_pin = instrument == HoleInstrument::kPin;
  finding.instrument = instrument;
  finding.form = FormOf(fit);
  const PinPlay play = by_pin ? PlayOf(pin, fit, options_.pin) : PinPlay{0, pin.hole_depth_mm, 0, {}};
  finding.pin_half_play_mm = play.half_mm;
  const std::vector<Part> parts = PartsOf(fit, points, play, instrument, *finding.form);
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  for (const Part& part : parts) covariance += part.covariance;
  finding.error = HoleErrorOf(pin, fit, covariance);
  MeasuredHole& measured = judged.measured;
  measured = {static_cast<int>(hole),
              finding.error.start_in_part_mm,
              finding.error.axis_in_part,
              finding.error.start_per_parameter,
              {},
              MovedBy(pin, finding.error)};
  for (const Part& part : parts) measured.sources.push_back(part.cause);
  Expand(parts, &finding);
  finding.position_stated_expanded_uncertainty_mm = finding.position_expanded_uncertainty_mm;
  finding.inclination_stated_expanded_uncertainty_rad = finding.inclination_expanded_uncertainty_rad;
  AddPositioning(measured.moved, &finding);
  Expand(parts, &finding);
  finding.displacement = DisplacementOf(pin, fit, measured);
  if (by_pin) finding.pin_diameter = PinDiameterOf(pin, fit, measured, options_.pin);
  finding.hole_diameter =
      by_pin ? DiameterByPin(pin, fit) : HoleDiameterFinding{DiameterOfBore(fit, measured, options_.pin), ""};
  Judge(holes_[hole], play, &finding);
  return judged;
}

std::vector<HolePitch> BladeInspection::PitchesOf(const std::vector<Judged>& holes) const {
  const auto end_of = [&](std::size_t hole) {
    const HoleFinding& finding = holes[hole].finding;
    const bool measured = finding.instrument != HoleInstrument::kNone;
    return PitchEnd{holes_[hole].pin.start_mm, holes_[hole].pin.hole_diameter_mm,
                    measured ? &holes[hole].measured : nullptr,
                    finding.hole_diameter.found ? &*finding.hole_diameter.found : nullptr};
  };
  std::vector<HolePitch> pitches;
  std::map<std::string, std::size_t> last;  // of each group
  for (std::size_t next = 0; next < holes_.size(); ++next) {
    const auto [before, begins] = last.try_emplace(holes_[next].group, next);
    if (begins) continue;
    HolePitch pitch = PitchOf(end_of(before->second), end_of(next));
    pitch.hole = before->second;
    pitch.next = next;
    pitches.push_back(std::move(pitch));
    before->second = next;
  }
  return pitches;
}

std::vector<BladeInspection::Part> BladeInspection::PartsOf(const PinFit& fit, const std::vector<PinPoint>& points,
                                                            const PinPlay& play, HoleInstrument instrument,
                                                            const CylinderForm& form) const {
  const double known = std::numeric_limits<double>::infinity();
  const bool by_pin = instrument == HoleInstrument::kPin;
  const RegisteredPose& pose = mapping_.pose();
  Eigen::Matrix<double, 5, kMappingInputs> sensitivity;
  sensitivity.setZero();
  for (std::size_t i = 0; i < fit.used.size(); ++i) {
    const PinPoint& point = points[fit.used[i]];
    sensitivity += fit.gain[i] * mapping_.Sensitivity(point.in_part_mm, point.in_sensor_mm, scans_[point.scan]);
  }
  const Eigen::Matrix<double, 5, 6> per_pose = sensitivity.leftCols<6>();
  std::vector<Part> parts;
  const auto own = [&](const char* source, const Eigen::Matrix<double, 5, 5>& covariance) {
    parts.push_back({{source, known, false, FactorOf(Eigen::MatrixXd(covariance))}, covariance});
  };
  own(by_pin ? kPinPoints : kBorePoints, fit.noise_covariance);
  parts.push_back({{"noise of the scans", known, true, per_pose * FactorOf(pose.noise.values)},
                   per_pose * pose.noise.values * per_pose.transpose()});
  if (by_pin) own(kPinStanding, PlayCovariance(play));
  for (const ErrorSource& source : pose.sources) {
    const Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma =
        per_pose * source.pose_per_sigma +
        sensitivity.rightCols<kCalibrationParameterCount>() * source.parameters_per_sigma;
    parts.push_back({{source.name, source.degrees_of_freedom, true, per_sigma}, per_sigma * per_sigma.transpose()});
  }
  if (form.per_sigma.cols() > 0)
    parts.push_back(
        {{by_pin ? kPinForm : kBoreForm, known, false, form.per_sigma}, form.per_sigma * form.per_sigma.transpose()});
  if (pose.angles.empty()) return parts;
  Eigen::Matrix<double, 5, Eigen::Dynamic> angles =
      Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, static_cast<Eigen::Index>(pose.angles.size()));
  for (std::size_t i = 0; i < fit.used.size(); ++i) {
    const PinPoint& point = points[fit.used[i]];
    angles += fit.gain[i] * mapping_.AngleSensitivity(point.in_part_mm, scans_[point.scan]);
  }
  const Eigen::MatrixXd errors = ErrorCovariance(pose.angles);
  parts.push_back(
      {{"angles of the scans", known, true, angles * FactorOf(errors)}, angles * errors * angles.transpose()});
  return parts;
}

void BladeInspection::Expand(const std::vector<Part>& parts, HoleFinding* finding) {
  constexpr double kUm2 = 1e6, kProbability = 0.95;
  const Eigen::Matrix<double, 1, 5>& along = finding->error.position_per_parameter;
  std::vector<UncertaintyComponent> components;
  for (const Part& part : parts)
    components.push_back({part.cause.source, kUm2 * (along * part.covariance * along.transpose()).value(),
                          part.cause.degrees_of_freedom});
  components.push_back({kOtherPositionings, kUm2 * (std::pow(finding->positioning_difference_mm, 2) / 3),
                        std::numeric_limits<double>::infinity()});
  UncertaintyBudget budget = BudgetOf(std::move(components));
  finding->components = std::move(budget.components);
  finding->degrees_of_freedom = budget.degrees_of_freedom;
  const double widening = WideningOf(kProbability, finding->degrees_of_freedom);
  const HoleError& error = finding->error;
  finding->position_expanded_uncertainty_mm =
      widening * error.position_coverage_factor * error.position_standard_uncertainty_mm;
  finding->inclination_expanded_uncertainty_rad =
      widening * error.inclination_coverage_factor * error.inclination_standard_uncertainty_rad;
}

// How wide a hole was drilled is not on the drawing: where nobody says how loosely its pin stands, none is passed, and none failed
// that the widest hole would excuse.
void BladeInspection::Judge(const InspectedHole& hole, const PinPlay& play, HoleFinding* finding) const {
  const auto judged = [&](double value, double u, double unstated, double tolerance) {
    const Verdict verdict = metrology::Judge(value, u, tolerance);
    if (metrology::Judge(value, u + unstated, tolerance) == verdict) return verdict;
    finding->reason = "how loosely the pin stands is not stated (gauge_pin of the part's hole group)";
    return Verdict::kUndecidable;
  };
  const double unstated_mm = play.unstated_half_mm / std::abs(hole.pin.normal.dot(hole.pin.axis));
  finding->position_verdict = judged(finding->error.position_mm, finding->position_expanded_uncertainty_mm, unstated_mm,
                                     hole.position_tolerance_mm);
  finding->inclination_verdict = judged(finding->error.inclination_rad, finding->inclination_expanded_uncertainty_rad,
                                        2 * play.unstated_half_mm / play.depth_mm, hole.inclination_tolerance_rad);
  finding->verdict = Worst(finding->position_verdict, finding->inclination_verdict);
}

}  // namespace sixpoint::metrology
