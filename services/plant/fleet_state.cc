#include "services/plant/fleet_state.h"

#include <cmath>
#include <utility>

#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using storage::ActivityRow;

// What was counted of one machine in one period.
class Counted {
 public:
  void Add(const ActivityRow& row) {
    if (row.bucket == 0) {
      counts_[row.measure] += row.count;
      return;
    }
    Step& step = steps_[row.measure];
    step.counts[row.bucket] += row.count;
    step.count += row.count;
    step.seconds += row.seconds;
  }
  v1::Throughput MakeThroughput() const {
    v1::Throughput all;
    all.set_blades_begun_count(Count("blade_begun"));
    const auto whole = steps_.find("FIRST_SCAN_TO_VERDICT");
    all.set_blades_judged_count(whole == steps_.end() ? 0 : whole->second.count);
    all.set_scan_count(Count("scan"));
    all.set_registration_count(Count("registration"));
    all.set_correction_count(Count("correction"));
    all.set_fetch_count(Count("fetch"));
    all.set_cut_count(Count("cut"));
    all.set_inspection_count(Judged());
    all.set_rejudgement_count(Count("rejudgement"));
    return all;
  }
  v1::Yield MakeYield() const {
    v1::Yield yield;
    yield.set_conform_count(Count("CONFORM"));
    yield.set_not_conform_count(Count("NOT_CONFORM"));
    yield.set_undecidable_count(Count("UNDECIDABLE"));
    yield.set_not_measured_count(Count("NOT_MEASURED"));
    if (Judged() > 0)
      yield.set_conform_share(static_cast<double>(yield.conform_count()) / static_cast<double>(Judged()));
    return yield;
  }
  template <typename Message>
  void AddSteps(Message* message) const {
    for (int value = v1::BladeStep_MIN + 1; value <= v1::BladeStep_MAX; ++value) {
      const auto step = static_cast<v1::BladeStep>(value);
      const auto found = steps_.find(v1::BladeStep_Name(step).substr(sizeof "BLADE_STEP_" - 1));
      if (found == steps_.end()) continue;
      v1::StepTime* time = message->add_steps();
      time->set_step(step);
      time->set_count(found->second.count);
      time->set_mean_s(found->second.seconds / static_cast<double>(found->second.count));
      time->set_p50_s(QuantileOf(found->second.counts, 0.5));
      time->set_p95_s(QuantileOf(found->second.counts, 0.95));
    }
  }

 private:
  struct Step {
    std::map<int, std::int64_t> counts;  // by bucket
    std::int64_t count = 0;
    double seconds = 0;
  };
  std::int64_t Count(const std::string& measure) const {
    const auto found = counts_.find(measure);
    return found == counts_.end() ? 0 : found->second;
  }
  std::int64_t Judged() const {
    return Count("CONFORM") + Count("NOT_CONFORM") + Count("UNDECIDABLE") + Count("NOT_MEASURED");
  }
  std::map<std::string, std::int64_t> counts_;
  std::map<std::string, Step> steps_;
};

v1::MachineCalibration CalibrationOf(const storage::MachineCalibrationRow& row, storage::Instant now) {
  v1::MachineCalibration calibration;
  calibration.set_name("calibrations/" + row.calibration_id);
  calibration.set_kind(row.kind);
  calibration.set_axis(row.axis);
  runtime::ToProto(row.recorded_at, calibration.mutable_recorded_at());
  runtime::ToProto(row.valid_until, calibration.mutable_valid_until());
  calibration.set_in_force(row.in_force);
  calibration.set_age_days(std::chrono::duration<double, std::ratio<86400>>(now - row.valid_from).count());
  if (!row.drift) return calibration;
  v1::CalibrationDrift* drift = calibration.mutable_drift();
  drift->set_against("calibrations/" + row.drift->earlier_id);
  drift->set_parameter(row.drift->parameter);
  drift->set_change(row.drift->change);
  drift->set_change_ratio(row.drift->ratio);
  for (const std::string& flagged : row.drift->flagged_parameters) drift->add_flagged_parameters(flagged);
  return calibration;
}

v1::UploadInProgress UploadOf(const storage::UploadInProgressRow& row, const UploadNames& names) {
  v1::UploadInProgress upload;
  upload.set_scan(names.scan);
  upload.set_subject(names.subject);
  upload.set_block_count(row.block_count);
  upload.set_point_count(row.point_count);
  upload.set_stored_bytes(row.stored_bytes);
  runtime::ToProto(row.started_at, upload.mutable_started_at());
  runtime::ToProto(row.touched_at, upload.mutable_touched_at());
  return upload;
}

v1::MachineState StateOf(const std::string& machine_id, const Counted& counted, const MachineRows& rows,
                         storage::Instant now) {
  v1::MachineState state;
  state.set_machine("machines/" + machine_id);
  const HeardOf heard = LastHeardOf(rows);
  if (heard.upload != nullptr) {
    runtime::ToProto(heard.upload->touched_at, state.mutable_last_contact());
    state.set_last_contact_by("upload");
  } else if (heard.contact != nullptr) {
    runtime::ToProto(heard.contact->recorded_at, state.mutable_last_contact());
    state.set_last_contact_by(heard.contact->name);
  }
  for (const storage::ContactRow* row : rows.contacts) {
    v1::MachineContact* contact = state.add_contacts();
    contact->set_kind(row->kind);
    contact->set_name(row->name);
    runtime::ToProto(row->recorded_at, contact->mutable_recorded_at());
  }
  *state.mutable_throughput() = counted.MakeThroughput();
  counted.AddSteps(&state);
  *state.mutable_yield() = counted.MakeYield();
  for (const storage::MachineCalibrationRow* row : rows.calibrations)
    *state.add_calibrations() = CalibrationOf(*row, now);
  if (rows.work != nullptr) state.set_blades_in_work_count(rows.work->blade_count);
  for (v1::MachineAlarm& alarm : AlarmsOf(rows, state, now)) *state.add_alarms() = std::move(alarm);
  return state;
}

}  // namespace

double QuantileOf(const std::map<int, std::int64_t>& counts, double share) {
  std::int64_t all = 0, so_far = 0;
  for (const auto& [bucket, count] : counts) all += count;
  for (const auto& [bucket, count] : counts) {
    so_far += count;
    if (static_cast<double>(so_far) >= share * static_cast<double>(all)) return std::exp2((bucket - 0.5) / 4);
  }
  return 0;
}

std::vector<v1::MachineState> StatesOf(const storage::FleetRows& fleet, const std::vector<UploadNames>& names) {
  std::map<std::string, MachineRows> rows;
  std::map<std::string, Counted> counted;
  std::map<std::string, std::vector<v1::UploadInProgress>> uploads;
  for (const ActivityRow& row : fleet.activity) counted[row.machine_id].Add(row);
  for (const storage::ContactRow& row : fleet.contacts) rows[row.machine_id].contacts.push_back(&row);
  for (const storage::MachineCalibrationRow& row : fleet.calibrations)
    rows[row.machine_id].calibrations.push_back(&row);
  for (const storage::MachineWorkRow& row : fleet.work) rows[row.machine_id].work = &row;
  for (const storage::MachineDamageRow& row : fleet.damages) rows[row.machine_id].damages = &row;
  for (std::size_t i = 0; i < fleet.uploads.size(); ++i) {
    rows[names[i].machine_id].uploads.push_back(&fleet.uploads[i]);
    uploads[names[i].machine_id].push_back(UploadOf(fleet.uploads[i], names[i]));
  }
  std::vector<v1::MachineState> states;
  for (const std::string& id : fleet.machine_ids) {
    v1::MachineState& state = states.emplace_back(StateOf(id, counted[id], rows[id], fleet.now));
    for (v1::UploadInProgress& upload : uploads[id]) *state.add_uploads() = std::move(upload);
  }
  return states;
}

std::vector<v1::ActivityHour> HoursOf(const std::vector<ActivityRow>& rows) {
  std::vector<v1::ActivityHour> hours;
  for (std::size_t first = 0; first < rows.size();) {
    Counted counted;
    std::size_t next = first;
    for (; next < rows.size() && rows[next].begins_at == rows[first].begins_at; ++next) counted.Add(rows[next]);
    v1::ActivityHour& hour = hours.emplace_back();
    runtime::ToProto(rows[first].begins_at, hour.mutable_begins_at());
    *hour.mutable_throughput() = counted.MakeThroughput();
    counted.AddSteps(&hour);
    *hour.mutable_yield() = counted.MakeYield();
    first = next;
  }
  return hours;
}

}  // namespace sixpoint::plant
