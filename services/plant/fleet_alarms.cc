#include "services/plant/fleet_alarms.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using storage::Instant;

constexpr hours kExpiresSoon(7 * 24);
constexpr minutes kStalled(10);
constexpr hours kSilent(24);
constexpr int kNotConformInARow = 3;
constexpr double kLeastYield = 0.8;
constexpr int kLeastJudged = 20;

v1::MachineAlarm Alarm(v1::AlarmKind kind, Instant since, const std::string& subject, const std::string& message,
                       const std::string& action) {
  v1::MachineAlarm alarm;
  alarm.set_kind(kind);
  runtime::ToProto(since, alarm.mutable_since());
  alarm.set_subject(subject);
  alarm.set_message(message);
  alarm.set_action(action);
  return alarm;
}

std::string Number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string Named(const storage::MachineCalibrationRow& calibration) {
  return calibration.kind == "axis" ? "axis " + calibration.axis : calibration.kind;
}

// since: from when the machine is known.
void AddUncalibrated(const MachineRows& machine, Instant since, std::vector<v1::MachineAlarm>* alarms) {
  for (const char* kind : {"sensor", "rotation"}) {
    const auto is_of_kind = [&](const storage::MachineCalibrationRow* c) { return c->kind == kind; };
    if (std::any_of(machine.calibrations.begin(), machine.calibrations.end(), is_of_kind)) continue;
    alarms->push_back(
        Alarm(v1::ALARM_KIND_NOT_CALIBRATED, since, "",
              std::string("of kind ") + kind + " none is in force: never made, still a draft, or withdrawn",
              std::string("calibrate: sixpoint calibrate ") + kind));
  }
}

void AddOfCalibrations(const MachineRows& machine, Instant now, std::vector<v1::MachineAlarm>* urgent,
                       std::vector<v1::MachineAlarm>* later) {
  for (const storage::MachineCalibrationRow* c : machine.calibrations) {
    const std::string name = "calibrations/" + c->calibration_id;
    if (!c->standing_check_id.empty())
      urgent->push_back(Alarm(v1::ALARM_KIND_SENSOR_MOVED, c->standing_check_at, "studies/" + c->standing_check_id,
                              "the scanner was not found where it was calibrated",
                              "look at its mount, then calibrate the sensor anew: sixpoint calibrate sensor"));
    if (!c->in_force) {
      urgent->push_back(Alarm(v1::ALARM_KIND_CALIBRATION_EXPIRED, c->valid_until, name,
                              "the calibration of kind " + Named(*c) + " is over", "calibrate anew"));
      continue;
    }
    if (c->drift && !c->drift->flagged_parameters.empty())
      urgent->push_back(Alarm(v1::ALARM_KIND_DRIFT, c->recorded_at, name,
                              c->drift->parameter + " moved by " + Number("%.3g", c->drift->change) + ", " +
                                  Number("%.1f", c->drift->ratio) +
                                  " combined standard uncertainties, since the calibration before",
                              "look at the trend for a cause: sixpoint calibration trend"));
    if (c->valid_until < now + kExpiresSoon)
      later->push_back(
          Alarm(v1::ALARM_KIND_CALIBRATION_EXPIRES, c->valid_until - kExpiresSoon, name,
                "the calibration of kind " + Named(*c) + " is over in " +
                    Number("%.1f days", std::chrono::duration<double, std::ratio<86400>>(c->valid_until - now).count()),
                "calibrate before"));
  }
}

void AddOfBlades(const MachineRows& machine, const v1::MachineState& state, Instant now,
                 std::vector<v1::MachineAlarm>* alarms) {
  const std::string id = runtime::LastSegment(state.machine());
  for (const storage::ContactRow* contact : machine.contacts)
    if (contact->kind == "inspection" && contact->detail == "NOT_CONFORM" && contact->run_count >= kNotConformInARow)
      alarms->push_back(Alarm(v1::ALARM_KIND_NOT_CONFORM_IN_A_ROW, contact->run_since, contact->name,
                              "the last " + std::to_string(contact->run_count) + " verdicts were NOT_CONFORM",
                              "stop, and look at the values: sixpoint values --machine " + id));
  if (machine.damages != nullptr)
    alarms->push_back(Alarm(v1::ALARM_KIND_DAMAGED_BLOBS, machine.damages->found_at, "",
                            std::to_string(machine.damages->blob_count) + " blobs of its scans are damaged",
                            "see which, and put them back from a backup: sixpoint store check"));
  if (machine.work != nullptr && machine.work->awaiting_count > 0) {
    const std::string& correction = machine.work->first_awaiting_id;
    alarms->push_back(Alarm(v1::ALARM_KIND_CORRECTION_AWAITS, machine.work->awaiting_since,
                            correction.empty() ? "" : "corrections/" + correction,
                            std::to_string(machine.work->awaiting_count) + " corrections wait for a person",
                            "decide: sixpoint correction show, release or refuse"));
  }
  const v1::Yield& yield = state.yield();
  const auto judged =
      yield.conform_count() + yield.not_conform_count() + yield.undecidable_count() + yield.not_measured_count();
  if (judged >= kLeastJudged && yield.conform_share() < kLeastYield)
    alarms->push_back(Alarm(v1::ALARM_KIND_YIELD_LOW, now, "",
                            "of " + std::to_string(judged) + " blades judged in the span " +
                                Number("%.0f %%", 100 * yield.conform_share()) + " are CONFORM",
                            "look at what they have in common: sixpoint values --machine " + id));
}

}  // namespace

HeardOf LastHeardOf(const MachineRows& machine) {
  HeardOf heard;
  for (const storage::ContactRow* contact : machine.contacts)
    if (heard.contact == nullptr && (contact->kind == "scan" || contact->kind == "fetch" || contact->kind == "cut"))
      heard.contact = contact;
  for (const storage::UploadInProgressRow* upload : machine.uploads)
    if ((heard.contact == nullptr || upload->touched_at > heard.contact->recorded_at) &&
        (heard.upload == nullptr || upload->touched_at > heard.upload->touched_at))
      heard.upload = upload;
  return heard;
}

std::vector<v1::MachineAlarm> AlarmsOf(const MachineRows& machine, const v1::MachineState& state, Instant now) {
  const HeardOf heard = LastHeardOf(machine);
  Instant known_since = now;
  for (const storage::ContactRow* contact : machine.contacts)
    if (contact->kind == "machine") known_since = contact->recorded_at;
  std::vector<v1::MachineAlarm> alarms, later;
  AddUncalibrated(machine, known_since, &alarms);
  AddOfCalibrations(machine, now, &alarms, &later);
  AddOfBlades(machine, state, now, &alarms);
  for (const storage::UploadInProgressRow* upload : machine.uploads)
    if (now - upload->touched_at > kStalled)
      alarms.push_back(Alarm(v1::ALARM_KIND_UPLOAD_STALLED, upload->touched_at, "",
                             "a scan stopped after " + std::to_string(upload->block_count) + " blocks",
                             "look at the machine's sender and its network; it may go on with the same scan_id"));
  const Instant last = heard.upload != nullptr    ? heard.upload->touched_at
                       : heard.contact != nullptr ? heard.contact->recorded_at
                                                  : known_since;
  if (now - last > kSilent)
    alarms.push_back(Alarm(v1::ALARM_KIND_SILENT, last, "", "the machine was not heard of for more than a day",
                           "see that it runs and reaches the plant: sixpoint doctor"));
  alarms.insert(alarms.end(), later.begin(), later.end());
  return alarms;
}

}  // namespace sixpoint::plant
