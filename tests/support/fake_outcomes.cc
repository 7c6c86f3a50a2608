#include "tests/support/fake_outcomes.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tests/support/rows_of_m1.h"
#include "tests/support/sample_calibrations.h"

namespace sixpoint::testing {
namespace {

constexpr std::size_t kCorrectionsOfABlade = 5;  // as many are looked at for each blade that is asked for

storage::OutcomeHoleRow OutcomeOf(const CutHole& hole) {
  storage::OutcomeHoleRow row;
  row.group_name = hole.group;
  row.hole_name = hole.hole;
  row.a_deg = hole.a_deg;
  row.b_deg = hole.b_deg;
  row.zero_from_part = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  row.predicted_start_mm = hole.predicted_start_mm;
  row.found_start_mm = hole.found_start_mm;
  row.predicted_axis = row.found_axis = hole.axis;
  row.position_expanded_uncertainty_um = kCutExpandedUncertainty_um;
  row.inclination_expanded_uncertainty_deg = kCutExpandedUncertainty_deg;
  row.budget_sources = CutBudgetSources();
  row.budget_um = CutBudget_um();
  return row;
}

template <typename Correction>
bool IsMeant(const Correction& made, const storage::OutcomeFilter& filter) {
  const std::string& calibration = filter.calibration_id;
  return filter.machine_id == "m1" && (filter.part_id.empty() || filter.part_id == "p1") &&
         (calibration.empty() || calibration == made.sensor_calibration_id ||
          calibration == made.rotation_calibration_id) &&
         storage::Contains(filter.corrected, made.at);
}

}  // namespace

FakeOutcomes::FakeOutcomes() {
  calibrations_.sensor = "calibrations/" + storage::NewUuid();
  CalibrateAxesAnew();
}

FakeOutcomes::Made FakeOutcomes::MakeNow(const CutBlade& blade) {
  Made made;
  made.sequence = record_.Next().sequence;
  made.at = storage::Instant(std::chrono::seconds(1'795'000'000)) + std::chrono::minutes(made.sequence);
  made.id = storage::NewUuid();
  made.sensor_calibration_id = IdOf(calibrations_.sensor);
  made.rotation_calibration_id = IdOf(calibrations_.rotation);
  made.blade = blade;
  record_.Append({}, {made.sequence, made.at});
  return made;
}

CutNames FakeOutcomes::Cut(const CutBlade& blade) {
  const auto lock = record_.Lock();
  CutNames names;
  corrections_.push_back(MakeNow(blade));
  names.correction = corrections_.back().id;
  if (blade.inspected) names.inspection = Inspect(blade);
  return names;
}

std::string FakeOutcomes::InspectAnew(const CutBlade& blade) {
  const auto lock = record_.Lock();
  return Inspect(blade);
}

std::string FakeOutcomes::Inspect(const CutBlade& blade) {
  inspections_.push_back(MakeNow(blade));
  return inspections_.back().id;
}

void FakeOutcomes::CalibrateAxesAnew() {
  const auto lock = record_.Lock();
  rotation_ids_.push_back(storage::NewUuid());
  calibrations_.rotation = "calibrations/" + rotation_ids_.back();
}

void FakeOutcomes::Withdraw(const std::string& calibration) {
  const auto lock = record_.Lock();
  withdrawn_ids_.insert(IdOf(calibration));
}

void FakeOutcomes::Fail(absl::Status failure) {
  const auto lock = record_.Lock();
  record_.Fail(std::move(failure));
}

void FakeOutcomes::LoseAxes() {
  const auto lock = record_.Lock();
  axes_are_lost_ = true;
}

bool FakeOutcomes::IsWithdrawn(const Made& made) const {
  return withdrawn_ids_.count(made.sensor_calibration_id) + withdrawn_ids_.count(made.rotation_calibration_id) > 0;
}

std::string FakeOutcomes::StateOf(const std::string& calibration_id) const {
  if (withdrawn_ids_.count(calibration_id) > 0) return "WITHDRAWN";
  if (calibration_id == IdOf(calibrations_.sensor)) return "IN_FORCE";
  const auto newest = std::find_if(rotation_ids_.rbegin(), rotation_ids_.rend(),
                                   [this](const std::string& id) { return withdrawn_ids_.count(id) == 0; });
  return newest != rotation_ids_.rend() && *newest == calibration_id ? "IN_FORCE" : "SUPERSEDED";
}

void FakeOutcomes::ReadBlades(const storage::OutcomeFilter& filter, int most_blades,
                              storage::Outcomes* outcomes) const {
  const auto most = static_cast<std::size_t>(most_blades), most_corrections = kCorrectionsOfABlade * most;
  std::vector<std::string> serials;  // the one that was corrected last first
  std::size_t correction_count = 0;
  for (auto made = corrections_.rbegin(); made != corrections_.rend() && correction_count < most_corrections; ++made) {
    if (!IsMeant(*made, filter)) continue;
    ++correction_count;
    if (std::find(serials.begin(), serials.end(), made->blade.serial) == serials.end())
      serials.push_back(made->blade.serial);
  }
  outcomes->is_cut_off = serials.size() > most || correction_count == most_corrections;
  serials.resize(std::min(serials.size(), most));
  for (const std::string& serial : serials) {
    storage::OutcomeBladeRow& blade = outcomes->blades.emplace_back();
    blade.blade_serial = serial;
    for (const Made& inspection : inspections_) {
      if (inspection.blade.serial != serial) continue;
      blade.inspection_id = inspection.id;
      ++blade.inspection_count;
      blade.is_withdrawn = IsWithdrawn(inspection);
      blade.is_open = inspection.blade.positioning_open;
    }
  }
}

// That the machine reported before any other, then the newest.
const FakeOutcomes::Made* FakeOutcomes::CutBefore(const Made& inspection) const {
  const Made* cut = nullptr;
  for (const Made& made : corrections_) {
    if (made.blade.serial != inspection.blade.serial || made.sequence > inspection.sequence) continue;
    if (!made.blade.reported && !made.blade.let_go) continue;
    if (cut == nullptr || made.blade.reported || !cut->blade.reported) cut = &made;
  }
  return cut;
}

void FakeOutcomes::ReadHoles(const storage::OutcomeFilter& filter, storage::Outcomes* outcomes) const {
  std::set<std::string> wanted;
  for (const storage::OutcomeBladeRow& blade : outcomes->blades) wanted.insert(blade.inspection_id);
  for (auto inspection = inspections_.rbegin(); inspection != inspections_.rend(); ++inspection) {
    if (wanted.count(inspection->id) == 0 || !inspection->blade.measured) continue;
    const Made* const cut = CutBefore(*inspection);
    if (cut == nullptr || !IsMeant(*cut, filter)) continue;
    for (const CutHole& hole : HolesOf(inspection->blade)) {
      storage::OutcomeHoleRow& row = outcomes->holes.emplace_back(OutcomeOf(hole));
      row.blade_serial = inspection->blade.serial;
      row.inspection_id = inspection->id;
      row.correction_id = cut->id;
      row.sensor_calibration_id = cut->sensor_calibration_id;
      row.rotation_calibration_id = cut->rotation_calibration_id;
      row.machine_revision = outcomes->newest_machine_revision = 1;
      row.corrected_at = cut->at;
      row.is_cut_reported = cut->blade.reported;
      row.is_withdrawn = IsWithdrawn(*cut);
    }
  }
}

void FakeOutcomes::ReadCalibrations(storage::Outcomes* outcomes) const {
  std::set<std::string> ids;
  for (const storage::OutcomeHoleRow& hole : outcomes->holes)
    ids.insert({hole.sensor_calibration_id, hole.rotation_calibration_id});
  const storage::CalibrationRow sample = SampleRotationCalibration();
  for (const std::string& id : ids) {
    storage::OutcomeCalibrationRow& row = outcomes->calibrations.emplace_back();
    row.calibration_id = id;
    row.state = StateOf(id);
    if (axes_are_lost_ || id == IdOf(calibrations_.sensor)) continue;
    row.a_direction = sample.rotation->a_direction;
    row.a_point_mm = sample.rotation->a_point_mm;
    row.b_direction = sample.rotation->b_direction;
    row.b_point_mm = sample.rotation->b_point_mm;
  }
}

absl::StatusOr<storage::Outcomes> FakeOutcomes::Read(const storage::OutcomeFilter& filter, int most_blades,
                                                     storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  storage::Outcomes outcomes;
  ReadBlades(filter, most_blades, &outcomes);
  ReadHoles(filter, &outcomes);
  ReadCalibrations(&outcomes);
  return outcomes;
}

}  // namespace sixpoint::testing
