#include "metrology/sections/span.h"

#include <cmath>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using P = SectionParameter;

absl::Status CheckNominal(const std::vector<MeasuredSection>& sections, const std::vector<SectionValues>& nominal) {
  if (!nominal.empty() && nominal.size() != sections.size())
    return Refuse("nominal", static_cast<double>(nominal.size()),
                  std::to_string(sections.size()) + " sections, or none");
  return absl::OkStatus();
}

// A weighted sum of one parameter over sections; each section's own errors are its own, the pose's are common.
SpanValue Combined(P parameter, const std::vector<MeasuredSection>& sections, const std::vector<SectionValues>& nominal,
                   const std::vector<std::pair<std::size_t, double>>& weights, bool angle) {
  SpanValue found;
  double value = 0, own = 0;
  Vector6d pose = Vector6d::Zero();
  for (const auto& [index, weight] : weights) {
    const SectionValues& values = sections[index].values;
    const SectionValues* ideal = nominal.empty() ? nullptr : &nominal[index];
    if (!values[parameter] || (ideal != nullptr && !(*ideal)[parameter])) {
      found.reason = values[parameter] ? ideal->reason(parameter) : values.reason(parameter);
      return found;
    }
    value += weight * (*values[parameter] - (ideal == nullptr ? 0 : *(*ideal)[parameter]));
    const ParameterUncertainty& u = sections[index].uncertainty(parameter);
    own += weight * weight * (u.by_noise * u.by_noise + u.by_form * u.by_form);
    pose += weight * u.pose_columns;
  }
  found.value = angle ? std::remainder(value, kTurn_rad) : value;
  found.standard = std::sqrt(own + pose.squaredNorm());
  found.expanded = 2 * found.standard;
  return found;
}

}  // namespace

absl::StatusOr<std::vector<SpanValue>> TwistOf(const std::vector<MeasuredSection>& sections,
                                               const std::vector<SectionValues>& nominal, std::size_t reference,
                                               P stagger) {
  if (const absl::Status status = CheckNominal(sections, nominal); !status.ok()) return status;
  if (reference >= sections.size())
    return Refuse("reference", static_cast<double>(reference),
                  "one of " + std::to_string(sections.size()) + " sections");
  std::vector<SpanValue> twists;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (i == reference)
      twists.push_back(Combined(stagger, sections, nominal, {{i, 0}}, true));
    else
      twists.push_back(Combined(stagger, sections, nominal, {{i, 1}, {reference, -1}}, true));
  }
  return twists;
}

absl::StatusOr<std::vector<Bow>> BowOf(const std::vector<MeasuredSection>& sections,
                                       const std::vector<SectionValues>& nominal) {
  if (const absl::Status status = CheckNominal(sections, nominal); !status.ok()) return status;
  if (sections.size() < 3) return Refuse("sections", static_cast<double>(sections.size()), "at least 3");
  const Eigen::Isometry3d first_from_part = sections.front().part_from_section.inverse();
  std::vector<double> heights_mm;
  std::vector<Eigen::Vector2d> origins_mm;
  for (const MeasuredSection& section : sections) {
    const Eigen::Isometry3d first_from_section = first_from_part * section.part_from_section;
    if ((first_from_section.linear() - Eigen::Matrix3d::Identity()).norm() > 1e-6)
      return Refuse("sections", "planes that are not parallel", "one normal and reference");
    heights_mm.push_back(first_from_section.translation().z());
    origins_mm.push_back(first_from_section.translation().head<2>());
  }
  const double span_mm = heights_mm.back();
  if (std::abs(span_mm) < 1e-6) return Refuse("sections", span_mm, "the first and last at different heights");
  std::vector<Bow> bows;
  const std::size_t last = sections.size() - 1;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const double part = heights_mm[i] / span_mm;
    std::vector<std::pair<std::size_t, double>> weights{{i, 1}, {0, part - 1}, {last, -part}};
    if (i == 0 || i == last) weights = {{i, 0}};
    Bow bow{Combined(P::kInscribedX, sections, nominal, weights, false),
            Combined(P::kInscribedY, sections, nominal, weights, false)};
    if (nominal.empty() && i != 0 && i != last) {
      // Planes' own origins may wander; nominal ones wander alike.
      const Eigen::Vector2d off = origins_mm[i] - part * origins_mm[last];
      if (bow.x.value) *bow.x.value += off.x();
      if (bow.y.value) *bow.y.value += off.y();
    }
    bows.push_back(bow);
  }
  return bows;
}

}  // namespace sixpoint::metrology
