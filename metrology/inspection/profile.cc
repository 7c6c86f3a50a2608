#include "metrology/inspection/profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "metrology/linear_algebra/symmetric.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Of a direction's information, in which a form zone still moves: less is a noise's choice (a plane does not hold its own turns).
constexpr double kHeld = 1e-4;

absl::Status Check(const DeviationField& field, const std::vector<std::uint32_t>& patches,
                   const ProfileTolerance& tolerance) {
  Refusals refusals;
  if (patches.empty()) refusals.Add(Refuse("patches", "none", "one at least"));
  for (const std::uint32_t p : patches)
    if (p >= field.patches.size()) refusals.Add(Refuse("patches", std::to_string(p), "one of the surface's"));
  if (!std::isfinite(tolerance.lower_mm) || !std::isfinite(tolerance.upper_mm) ||
      !(tolerance.lower_mm < tolerance.upper_mm))
    refusals.Add(Refuse("tolerance.lower_mm", tolerance.lower_mm,
                        "less than upper_mm, which is " + NumberText(tolerance.upper_mm)));
  if (!(tolerance.least_coverage >= 0 && tolerance.least_coverage <= 1))
    refusals.Add(Refuse("tolerance.least_coverage", tolerance.least_coverage, "0 to 1"));
  return refusals.status();
}

// The patches that were seen, as the zone has them.
struct SeenPatches {
  std::vector<std::size_t> at;  // in the list asked for
  Eigen::VectorXd deviations_mm;
  Eigen::MatrixXd per_sigma_mm;
};

SeenPatches SeenOf(const DeviationField& field, const std::vector<std::uint32_t>& patches) {
  SeenPatches seen;
  for (std::size_t i = 0; i < patches.size(); ++i)
    if (field.patches[patches[i]].mean_mm) seen.at.push_back(i);
  const auto count = static_cast<Eigen::Index>(seen.at.size());
  seen.deviations_mm.resize(count);
  seen.per_sigma_mm.resize(count, field.causes.per_sigma_mm.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    const std::uint32_t p = patches[seen.at[static_cast<std::size_t>(k)]];
    seen.deviations_mm[k] = *field.patches[p].mean_mm;
    seen.per_sigma_mm.row(k) = field.causes.per_sigma_mm.row(p);
  }
  return seen;
}

// Takes the best fit off the deviations, and off what each cause does to them: what only moves the part is no form.
Vector6d TakeMotionOff(const DeviationField& field, const std::vector<std::uint32_t>& patches, SeenPatches* seen) {
  const auto count = static_cast<Eigen::Index>(seen->at.size());
  const auto patch_of = [&](Eigen::Index k) -> const SurfacePatch& {
    return field.surface->patches()[patches[seen->at[static_cast<std::size_t>(k)]]];
  };
  Vector3d middle = Vector3d::Zero();
  double area_mm2 = 0, squares = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    middle += patch_of(k).area_mm2 * patch_of(k).centre_mm;
    area_mm2 += patch_of(k).area_mm2;
  }
  middle /= area_mm2;
  for (Eigen::Index k = 0; k < count; ++k)
    squares += patch_of(k).area_mm2 * (patch_of(k).centre_mm - middle).squaredNorm();
  // One patch holds no turn: about it any radius would do.
  const double radius_mm = std::max(1e-3, std::sqrt(squares / area_mm2));
  // A row: how the deviation follows the part's turns, times the radius, and shifts.
  Eigen::MatrixXd rows(count, 6);
  Eigen::VectorXd weights(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    rows.row(k) << (patch_of(k).centre_mm - middle).cross(patch_of(k).normal).transpose() / radius_mm,
        patch_of(k).normal.transpose();
    weights[k] = patch_of(k).area_mm2;
  }
  const Eigen::MatrixXd weighted = weights.asDiagonal() * rows;
  const Eigen::MatrixXd normal = rows.transpose() * weighted;
  const Eigen::VectorXd motion = SolveHeld(normal, weighted.transpose() * seen->deviations_mm, kHeld);
  seen->deviations_mm -= rows * motion;
  for (Eigen::Index column = 0; column < seen->per_sigma_mm.cols(); ++column)
    seen->per_sigma_mm.col(column) -=
        rows * SolveHeld(normal, weighted.transpose() * seen->per_sigma_mm.col(column), kHeld);
  Vector6d scaled = motion;
  scaled.head<3>() /= radius_mm;
  return scaled;
}

// Of each patch asked for: 1 above, -1 below, 0 within or not seen.
using Sides = std::vector<int>;

// Patches that share a cell, or whose cells touch: flooded from the first on.
std::vector<ProfileArea> AreasOf(const DeviationField& field, const std::vector<std::uint32_t>& patches,
                                 const ProfileFinding& finding, const ProfileTolerance& tolerance, const Sides& sides) {
  std::unordered_map<std::uint32_t, std::size_t> asked;
  for (std::size_t i = 0; i < patches.size(); ++i) asked.emplace(patches[i], i);
  std::vector<bool> taken(patches.size());
  std::vector<ProfileArea> areas;
  const auto beyond = [&](std::size_t i) {
    return sides[i] > 0 ? finding.deviations_mm[i] - tolerance.upper_mm : tolerance.lower_mm - finding.deviations_mm[i];
  };
  for (std::size_t first = 0; first < patches.size(); ++first) {
    if (sides[first] == 0 || taken[first]) continue;
    ProfileArea area;
    area.above = sides[first] > 0;
    Eigen::AlignedBox3d box_mm;
    std::vector<std::size_t> open = {first};
    taken[first] = true;
    std::size_t worst = first;
    while (!open.empty()) {
      const std::size_t i = open.back();
      open.pop_back();
      const SurfacePatch& patch = field.surface->patches()[patches[i]];
      area.area_mm2 += patch.area_mm2;
      ++area.patch_count;
      box_mm.extend(patch.centre_mm);
      if (beyond(i) > beyond(worst)) worst = i;
      const auto cell = CellOf(patch.key);
      for (int neighbour = 0; neighbour < 27 * 6; ++neighbour) {
        const int n = neighbour / 6;
        const std::uint32_t p = field.surface->Of(
            PatchKeyOf({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1}, neighbour % 6));
        const auto found = p == SurfacePatches::kNone ? asked.end() : asked.find(p);
        if (found == asked.end() || taken[found->second] || sides[found->second] != sides[first]) continue;
        // The other wall of a thin edge is no neighbour.
        if (field.surface->patches()[p].normal.dot(patch.normal) <= 0) continue;
        taken[found->second] = true;
        open.push_back(found->second);
      }
    }
    area.worst = patches[worst];
    area.worst_mm = finding.deviations_mm[worst];
    area.worst_expanded_uncertainty_mm = finding.expanded_uncertainties_mm[worst];
    area.minimum_mm = box_mm.min();
    area.maximum_mm = box_mm.max();
    areas.push_back(area);
  }
  const auto farthest = [&](const ProfileArea& area) {
    return area.above ? area.worst_mm - tolerance.upper_mm : tolerance.lower_mm - area.worst_mm;
  };
  std::stable_sort(areas.begin(), areas.end(),
                   [&](const ProfileArea& one, const ProfileArea& other) { return farthest(one) > farthest(other); });
  return areas;
}

// One patch out decides; what was not seen passes nothing.
void Decide(const ProfileTolerance& tolerance, ProfileFinding* finding) {
  if (finding->out_mm2 > 0) {
    finding->verdict = Verdict::kNotConform;
  } else if (!finding->lowest) {
    finding->verdict = Verdict::kNotMeasured;
    finding->reason =
        "of the area 0 % were seen, want " + NumberText(100 * tolerance.least_coverage) + " % or more, and some";
  } else if (finding->coverage < tolerance.least_coverage) {
    finding->verdict = Verdict::kNotMeasured;
    finding->reason = "of the area " + NumberText(std::round(1e3 * finding->coverage) / 10) + " % were seen, want " +
                      NumberText(100 * tolerance.least_coverage) + " % or more";
  } else if (finding->undecided_mm2 > 0) {
    finding->verdict = Verdict::kUndecidable;
    finding->reason = NumberText(std::round(1e3 * finding->undecided_mm2) / 1e3) +
                      " mm2 are so near to a limit that the decision rule leaves them open";
  } else {
    finding->verdict = Verdict::kConform;
  }
}

}  // namespace

absl::StatusOr<ProfileFinding> JudgeProfile(const DeviationField& field, const std::vector<std::uint32_t>& patches,
                                            const ProfileTolerance& tolerance) {
  if (absl::Status good = Check(field, patches, tolerance); !good.ok()) return good;
  ProfileFinding finding;
  finding.deviations_mm.assign(patches.size(), kNaN);
  finding.expanded_uncertainties_mm.assign(patches.size(), kNaN);
  SeenPatches seen = SeenOf(field, patches);
  if (tolerance.zone == ProfileZone::kForm && !seen.at.empty()) finding.motion = TakeMotionOff(field, patches, &seen);
  double area_mm2 = 0, seen_mm2 = 0;
  for (const std::uint32_t p : patches) area_mm2 += field.surface->patches()[p].area_mm2;
  Sides sides(patches.size());
  for (std::size_t k = 0; k < seen.at.size(); ++k) {
    const std::size_t i = seen.at[k];
    PatchDeviation patch = field.patches[patches[i]];
    const double d = seen.deviations_mm[static_cast<Eigen::Index>(k)];
    ExpandDeviation(field.causes, seen.per_sigma_mm.row(static_cast<Eigen::Index>(k)), &patch);
    const double u = patch.expanded_uncertainty_mm, here_mm2 = field.surface->patches()[patches[i]].area_mm2;
    finding.deviations_mm[i] = d;
    finding.expanded_uncertainties_mm[i] = u;
    if (!finding.lowest || d < finding.deviations_mm[*finding.lowest]) finding.lowest = i;
    if (!finding.highest || d > finding.deviations_mm[*finding.highest]) finding.highest = i;
    seen_mm2 += here_mm2;
    const Verdict here = Judge(d, u, {tolerance.lower_mm, tolerance.upper_mm}, tolerance.rule);
    if (here == Verdict::kNotConform) {
      sides[i] = 2 * d > tolerance.lower_mm + tolerance.upper_mm ? 1 : -1;
      finding.out_mm2 += here_mm2;
    } else if (here != Verdict::kConform) {
      finding.undecided_mm2 += here_mm2;
    }
  }
  finding.coverage = seen_mm2 / area_mm2;
  finding.areas = AreasOf(field, patches, finding, tolerance, sides);
  Decide(tolerance, &finding);
  return finding;
}

}  // namespace sixpoint::metrology
