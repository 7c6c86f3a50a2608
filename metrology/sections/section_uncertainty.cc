#include "metrology/sections/section_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "metrology/frames/angles.h"
#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/distributions.h"
#include "metrology/statistics/ranks.h"
#include "metrology/statistics/standard_deviation.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kNoiseDraws = 64, kFormDraws = 160;

// Of each node.
struct Field {
  std::vector<double> offsets_mm, slopes;
};

double NodeVariance(const FittedOutline& fitted, std::size_t node) {
  const NodeNoise& noise = fitted.noise[node];
  double variance = 0;
  for (std::size_t k = 0; k < noise.by_offset.size(); ++k)
    variance += std::pow(
        static_cast<double>(noise.by_offset[k]) * fitted.mean_sigma_mm[(noise.first + k) % fitted.mean_sigma_mm.size()],
        2);
  return variance;
}

std::vector<Field> NoiseFields(const FittedOutline& fitted) {
  std::mt19937_64 random(20261);
  std::normal_distribution<double> normal;
  std::vector<Field> fields(kNoiseDraws);
  for (std::size_t draw = 0; draw < kNoiseDraws; draw += 2) {
    std::vector<double> errors;
    for (const double sigma : fitted.mean_sigma_mm) errors.push_back(sigma * normal(random));
    for (const NodeNoise& noise : fitted.noise) {
      double offset = 0, slope = 0;
      std::size_t at = noise.first;
      for (std::size_t k = 0; k < noise.by_offset.size(); ++k) {
        offset += static_cast<double>(noise.by_offset[k]) * errors[at];
        slope += static_cast<double>(noise.by_slope[k]) * errors[at];
        if (++at == errors.size()) at = 0;
      }
      fields[draw].offsets_mm.push_back(offset);
      fields[draw].slopes.push_back(slope);
      fields[draw + 1].offsets_mm.push_back(-offset);
      fields[draw + 1].slopes.push_back(-slope);
    }
  }
  return fields;
}

// Around the outline in Fourier terms that have the covariance of the choice; choices by their shares.
std::vector<Field> FormFields(const Outline& outline, const FormError& form) {
  std::mt19937_64 random(20262);
  std::normal_distribution<double> normal;
  std::vector<Field> fields(kFormDraws);
  std::size_t choice = 0;
  double passed = form.choices.empty() ? 1 : form.choices[0].share;
  for (std::size_t draw = 0; draw < kFormDraws; draw += 2) {
    const double wanted = (static_cast<double>(draw) + 1) / kFormDraws;
    while (passed < wanted && choice + 1 < form.choices.size()) passed += form.choices[++choice].share;
    const double sigma = form.choices[choice].sigma_mm, length = form.choices[choice].length_mm;
    const double unit = kTurn_rad / outline.length_mm();
    std::vector<double> cosines, sines;
    double variance = 0;
    for (int k = 0; unit * k * length < 3.5; ++k) {
      const double weight = std::exp(-0.25 * std::pow(unit * k * length, 2)) * (k == 0 ? std::sqrt(0.5) : 1);
      variance += weight * weight;
      cosines.push_back(weight * normal(random));
      sines.push_back(k == 0 ? 0 : weight * normal(random));
    }
    const double scale = sigma / std::sqrt(variance);
    for (const OutlineNode& node : outline.nodes()) {
      double offset = 0, slope = 0;
      for (std::size_t k = 0; k < cosines.size(); ++k) {
        const double angle = unit * static_cast<double>(k) * node.at_mm, c = std::cos(angle), s = std::sin(angle);
        offset += cosines[k] * c + sines[k] * s;
        slope += unit * static_cast<double>(k) * (sines[k] * c - cosines[k] * s);
      }
      fields[draw].offsets_mm.push_back(scale * offset);
      fields[draw].slopes.push_back(scale * slope);
      fields[draw + 1].offsets_mm.push_back(-scale * offset);
      fields[draw + 1].slopes.push_back(-scale * slope);
    }
  }
  return fields;
}

// Rows: each node's offset by the pose's perturbation. A shift along the plane's normal shows by the lean.
Eigen::MatrixXd PoseRows(const SectionOutline& outline, const PoseCovariance& pose) {
  const Outline& curve = outline.fitted.outline;
  Eigen::MatrixXd rows(curve.size(), 6);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const OutlineNode& node = curve.nodes()[i];
    const Vector3d point = outline.part_from_section * Vector3d(node.point_mm.x(), node.point_mm.y(), 0);
    const Vector3d along = outline.part_from_section.linear() * Vector3d(node.normal.x(), node.normal.y(), -node.lean);
    rows.row(static_cast<Eigen::Index>(i)) = along.transpose() * PointJacobian(point, pose.reference_mm);
  }
  return rows;
}

// What the pose's perturbation does: in its plane the outline moves as it is; along the plane's normal it shows by the lean.
Outline Displaced(const SectionOutline& outline, const PoseCovariance& pose, const Vector6d& by) {
  const Eigen::Matrix3d section_from_part = outline.part_from_section.linear().transpose();
  const double turn = (section_from_part * by.head<3>()).z();
  std::vector<OutlineNode> nodes = outline.fitted.outline.nodes();
  std::vector<double> offsets_mm;
  for (OutlineNode& node : nodes) {
    const Vector3d point = outline.part_from_section * Vector3d(node.point_mm.x(), node.point_mm.y(), 0);
    const Vector3d shift = section_from_part * (PointJacobian(point, pose.reference_mm) * by);
    offsets_mm.push_back(-node.lean * shift.z());
    node.point_mm += shift.head<2>();
    node.normal = Eigen::Rotation2Dd(turn) * node.normal;
  }
  const Outline moved(std::move(nodes));
  std::vector<double> slopes;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const std::size_t before = moved.nodes()[i].before == Join::kSmooth ? moved.Previous(i) : i;
    const std::size_t after = moved.JoinAfter(i) == Join::kSmooth ? moved.Next(i) : i;
    double along = moved.nodes()[after].at_mm - moved.nodes()[before].at_mm;
    if (along < 0) along += moved.length_mm();
    slopes.push_back(along > 0 ? (offsets_mm[after] - offsets_mm[before]) / along : 0);
  }
  return moved.Offset(offsets_mm, slopes);
}

std::vector<SectionValues> Evaluated(std::size_t count, const std::function<Outline(std::size_t)>& outline,
                                     const LeadingHint& hint, int thread_count) {
  std::vector<SectionValues> values(count);
  ForEach(count, thread_count, [&](std::size_t i) {
    const Outline moved = outline(i);
    values[i] = ValuesOf(moved, CamberOf(moved, hint));
  });
  return values;
}

// One standard deviation along each principal direction, to both sides.
std::vector<SectionValues> EvaluatedByPose(const SectionOutline& outline, const PoseCovariance& pose,
                                           const LeadingHint& hint, int thread_count) {
  const EigenSystem6 system = EigenSystemOf(pose.values);
  return Evaluated(
      12,
      [&](std::size_t i) {
        const auto k = static_cast<Eigen::Index>(i / 2);
        const double sigma = StandardDeviation(system.values[k]);
        return Displaced(outline, pose, (i % 2 == 0 ? sigma : -sigma) * system.vectors.col(k));
      },
      hint, thread_count);
}

bool IsAngle(SectionParameter p) {
  return p == SectionParameter::kStaggerNoseTail || p == SectionParameter::kStaggerCaliper ||
         p == SectionParameter::kStaggerTangent;
}

double Difference(SectionParameter p, double a, double b) {
  return IsAngle(p) ? std::remainder(a - b, kTurn_rad) : a - b;
}

// Root mean square change. A draw in which the parameter is not measured counts for nothing, nor do a few in which it is another end's.
double Spread(SectionParameter p, double value, const std::vector<SectionValues>& draws) {
  constexpr double kElsewhere = 10, kFew = 0.05;  // robust standard deviations; of the draws
  std::vector<double> changes;
  for (const SectionValues& draw : draws)
    if (draw[p] && std::isfinite(*draw[p])) changes.push_back(std::abs(Difference(p, *draw[p], value)));
  if (changes.empty()) return 0;
  std::sort(changes.begin(), changes.end());
  const double limit = kElsewhere * RobustSigmaOfMagnitudes(changes);
  const auto elsewhere = changes.end() - std::upper_bound(changes.begin(), changes.end(), limit);
  if (static_cast<double>(elsewhere) <= kFew * static_cast<double>(changes.size()))
    changes.resize(changes.size() - static_cast<std::size_t>(elsewhere));
  double sum = 0;
  for (const double change : changes) sum += change * change;
  return changes.empty() ? 0 : std::sqrt(sum / static_cast<double>(changes.size()));
}

MeasuredSection::Profile ProfileOf(const SectionOutline& outline, const UncertaintyOptions& options) {
  MeasuredSection::Profile profile;
  profile.deviation = DeviationFrom(*options.nominal, outline.fitted.outline);
  const double k = StudentQuantile(0.5 + options.confidence / 2, 1e6);
  const auto noise = [&](std::size_t node) { return NodeVariance(outline.fitted, node); };
  Eigen::VectorXd pose = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(outline.fitted.outline.size()));
  if (options.pose) {
    const Eigen::MatrixXd rows = PoseRows(outline, *options.pose);
    pose = (rows * options.pose->values).cwiseProduct(rows).rowwise().sum();
  }
  const auto located = [&](std::size_t node) {
    return k * std::sqrt(noise(node) + pose[static_cast<Eigen::Index>(node)]);
  };
  profile.location_least_expanded_mm = located(profile.deviation.location.least_node);
  profile.location_greatest_expanded_mm = located(profile.deviation.location.greatest_node);
  profile.form_least_expanded_mm = k * std::sqrt(noise(profile.deviation.form.least_node));
  profile.form_greatest_expanded_mm = k * std::sqrt(noise(profile.deviation.form.greatest_node));
  return profile;
}

}  // namespace

absl::StatusOr<MeasuredSection> MeasureSection(const SectionOutline& outline, const UncertaintyOptions& options) {
  if (options.pose && !options.pose->values.allFinite()) return Refuse("pose", "not finite", "a covariance");
  if (options.pose && !(options.pose->values.diagonal().minCoeff() >= 0))
    return Refuse("pose", options.pose->values.diagonal().minCoeff(), "variances of at least 0");
  if (!(options.confidence > 0 && options.confidence < 1))
    return Refuse("confidence", options.confidence, "between 0 and 1");
  const Outline& curve = outline.fitted.outline;
  MeasuredSection section;
  section.part_from_section = outline.part_from_section;
  const std::optional<Camber> camber = CamberOf(curve, options.leading);
  section.values = ValuesOf(curve, camber);
  if (options.nominal != nullptr) section.profile = ProfileOf(outline, options);
  const bool exact = outline.fitted.sample_sigma_mm == 0;
  // The end that leads is now known: draws must not change it.
  LeadingHint hint = options.leading;
  if (camber) hint.near_mm = camber->leading.place ? camber->leading.tip_mm : camber->leading.last_mm;
  std::vector<SectionValues> by_noise, by_form, by_pose;
  if (!exact) {
    if (camber) section.form = FormErrorOf(outline.fitted, *camber, options.nominal);
    const auto by = [&](const std::vector<Field>& fields) {
      return Evaluated(
          fields.size(), [&](std::size_t i) { return curve.Offset(fields[i].offsets_mm, fields[i].slopes); }, hint,
          options.thread_count);
    };
    by_noise = by(NoiseFields(outline.fitted));
    if (!section.form.choices.empty()) by_form = by(FormFields(curve, section.form));
  }
  if (options.pose) by_pose = EvaluatedByPose(outline, *options.pose, hint, options.thread_count);
  for (std::size_t i = 0; i < kSectionParameterCount; ++i) {
    const auto p = static_cast<SectionParameter>(i);
    if (!section.values[p]) continue;
    ParameterUncertainty& u = section.uncertainties[i];
    u.by_noise = Spread(p, *section.values[p], by_noise);
    // What an end is out of round by is its waver: that is the measured thing.
    const bool of_form = p != SectionParameter::kLeadingForm && p != SectionParameter::kTrailingForm;
    if (of_form) u.by_form = Spread(p, *section.values[p], by_form);
    for (std::size_t k = 0; k < by_pose.size() / 2; ++k)
      if (by_pose[2 * k][p] && by_pose[2 * k + 1][p])
        u.pose_columns[static_cast<Eigen::Index>(k)] = Difference(p, *by_pose[2 * k][p], *by_pose[2 * k + 1][p]) / 2;
    u.by_pose = u.pose_columns.norm();
    u.standard = std::sqrt(u.by_noise * u.by_noise + u.by_form * u.by_form + u.by_pose * u.by_pose);
    const double freedom =
        u.by_form > 0 ? std::min(1e6, section.form.freedom * std::pow(u.standard / u.by_form, 4)) : 1e6;
    u.expanded = StudentQuantile(0.5 + options.confidence / 2, freedom) * u.standard;
  }
  return section;
}

}  // namespace sixpoint::metrology
