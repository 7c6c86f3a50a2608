#include "services/inspection/efficacy.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include "services/clients/error_sources.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

// Lest a row that states nothing counts for all.
constexpr double kLeast = 1e-6;
// Of an expanded uncertainty, where no budget was kept.
constexpr double kCoverageFactor = 2;

// What is another draw on every blade. Whatever else a budget names (calibrations, the scanner's field, temperatures) may be the same on
// all of them.
bool IsOfTheBlade(const std::string& source) {
  static const auto* const known =
      new std::set<std::string>{"points of the pin", "noise of the scans", "how the pin stands", "other positionings"};
  return known->count(source) > 0 || clients::IsFormOfBlade(source);
}

Eigen::Vector3d VectorOf(const std::array<double, 3>& three) { return {three[0], three[1], three[2]}; }

Eigen::Isometry3d PoseOf(const std::vector<double>& rows_of_four) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 12; ++i) pose.matrix()(i / 4, i % 4) = rows_of_four.at(static_cast<std::size_t>(i));
  return pose;
}

metrology::HoleOutcome OutcomeOf(const storage::OutcomeHoleRow& row) {
  metrology::HoleOutcome hole;
  hole.hole = row.group_name + "/" + row.hole_name;
  hole.a_rad = row.a_deg * runtime::kRadPerDeg;
  hole.b_rad = row.b_deg * runtime::kRadPerDeg;
  hole.zero_from_part = PoseOf(row.zero_from_part);
  hole.predicted_start_mm = VectorOf(row.predicted_start_mm);
  hole.predicted_axis = VectorOf(row.predicted_axis);
  hole.found_start_mm = VectorOf(row.found_start_mm);
  hole.found_axis = VectorOf(row.found_axis);
  // A budget is of one component; two make a distance.
  double whole = 0, shared = 0;
  for (std::size_t i = 0; i < std::min(row.budget_sources.size(), row.budget_um.size()); ++i) {
    const double variance = std::pow(1e-3 * row.budget_um[i], 2);
    whole += variance;
    if (!IsOfTheBlade(row.budget_sources[i])) shared += variance;
  }
  hole.shared_part = whole > 0 ? shared / whole : 1;  // not kept: nothing is known to average out
  if (!(whole > 0)) whole = std::pow(1e-3 * row.position_expanded_uncertainty_um / kCoverageFactor, 2);
  hole.position_standard_uncertainty_mm = std::max(kLeast, std::sqrt(2 * whole));
  hole.inclination_standard_uncertainty_rad = std::max(
      kLeast, std::sqrt(2.0) * runtime::kRadPerDeg * row.inclination_expanded_uncertainty_deg / kCoverageFactor);
  return hole;
}

double DaysOf(storage::Instant at) { return std::chrono::duration<double>(at.time_since_epoch()).count() / 86400; }

using PeriodKey = std::tuple<int, std::string, std::string>;
using HolesOfBlades = std::map<std::string, std::vector<const storage::OutcomeHoleRow*>>;

absl::StatusOr<metrology::RotaryAxes> AxesOf(const std::map<std::string, const storage::OutcomeCalibrationRow*>& known,
                                             const std::string& id) {
  const auto found = known.find(id);
  if (found == known.end() || found->second->a_direction.size() != 3 || found->second->b_direction.size() != 3 ||
      found->second->a_point_mm.size() != 3 || found->second->b_point_mm.size() != 3)
    return absl::InternalError("calibrations/" + id + ": no axes, want those of a rotation calibration");
  const auto vector = [](const std::vector<double>& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
  metrology::RotaryAxes axes;
  axes.a = {vector(found->second->a_direction), vector(found->second->a_point_mm)};
  axes.b = {vector(found->second->b_direction), vector(found->second->b_point_mm)};
  return axes;
}

void AddBlades(const HolesOfBlades& holes, PeriodOutcomes* period) {
  struct Made {
    metrology::BladeOutcome blade;
    PeriodOutcomes::Origin origin;
  };
  std::vector<Made> made;
  for (const auto& [serial, rows] : holes) {
    Made& one = made.emplace_back();
    one.blade.blade = serial;
    one.origin.inspection_id = rows.front()->inspection_id;
    one.origin.corrected_at = rows.front()->corrected_at;
    for (const storage::OutcomeHoleRow* row : rows) {
      one.blade.holes.push_back(OutcomeOf(*row));
      one.origin.corrected_at = std::max(one.origin.corrected_at, row->corrected_at);
      one.origin.reported_count += row->is_cut_reported ? 1 : 0;
    }
    one.blade.time_days = DaysOf(one.origin.corrected_at);
  }
  std::stable_sort(made.begin(), made.end(),
                   [](const Made& a, const Made& b) { return a.blade.time_days < b.blade.time_days; });
  for (Made& one : made) {
    period->blades.push_back(std::move(one.blade));
    period->origins.push_back(std::move(one.origin));
  }
}

// Of the blades, those that can be looked at, by their inspection.
std::set<std::string> Usable(const storage::Outcomes& outcomes, LeftOutCounts* left_out) {
  std::set<std::string> withdrawn, measured, usable;
  for (const storage::OutcomeHoleRow& hole : outcomes.holes) {
    measured.insert(hole.inspection_id);
    if (hole.is_withdrawn) withdrawn.insert(hole.inspection_id);
  }
  for (const storage::OutcomeBladeRow& blade : outcomes.blades) {
    left_out->superseded_inspections += std::max(0, blade.inspection_count - 1);
    if (blade.inspection_id.empty())
      ++left_out->not_inspected;
    else if (blade.is_withdrawn || withdrawn.count(blade.inspection_id) > 0)
      ++left_out->withdrawn;
    else if (blade.is_open)
      ++left_out->positioning_open;
    else if (measured.count(blade.inspection_id) == 0)
      ++left_out->no_hole;
    else
      usable.insert(blade.inspection_id);
  }
  return usable;
}

}  // namespace

absl::StatusOr<SortedOutcomes> SortOutcomes(const storage::Outcomes& outcomes) {
  SortedOutcomes sorted;
  const std::set<std::string> usable = Usable(outcomes, &sorted.left_out);
  std::map<PeriodKey, HolesOfBlades> periods;
  for (const storage::OutcomeHoleRow& hole : outcomes.holes)
    if (usable.count(hole.inspection_id) > 0)
      periods[{hole.machine_revision, hole.sensor_calibration_id, hole.rotation_calibration_id}][hole.blade_serial]
          .push_back(&hole);
  std::map<std::string, const storage::OutcomeCalibrationRow*> calibrations;
  for (const storage::OutcomeCalibrationRow& row : outcomes.calibrations) calibrations[row.calibration_id] = &row;
  const auto is_in_force = [&](const std::string& id) {
    const auto found = calibrations.find(id);
    return found != calibrations.end() && found->second->state == "IN_FORCE";
  };
  for (const auto& [key, holes] : periods) {
    PeriodOutcomes& period = sorted.periods.emplace_back();
    std::tie(period.machine_revision, period.sensor_calibration_id, period.rotation_calibration_id) = key;
    period.in_force = period.machine_revision == outcomes.newest_machine_revision &&
                      is_in_force(period.sensor_calibration_id) && is_in_force(period.rotation_calibration_id);
    absl::StatusOr<metrology::RotaryAxes> axes = AxesOf(calibrations, period.rotation_calibration_id);
    if (!axes.ok()) return axes.status();
    period.axes = *std::move(axes);
    AddBlades(holes, &period);
  }
  std::stable_sort(sorted.periods.begin(), sorted.periods.end(), [](const auto& a, const auto& b) {
    return a.origins.back().corrected_at > b.origins.back().corrected_at;
  });
  return sorted;
}

}  // namespace sixpoint::inspection
