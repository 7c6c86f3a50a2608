// `sixpoint fleet`: the machines of a plant as they stand.

#include <algorithm>
#include <sstream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "sixpoint/plant/v1/fleet.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::FleetService;
using plant::v1::MachineState;

std::string StepName(plant::v1::BladeStep step) { return EnumText(plant::v1::BladeStep_Name(step), "BLADE_STEP_"); }
std::string AlarmName(plant::v1::AlarmKind kind) { return EnumText(plant::v1::AlarmKind_Name(kind), "ALARM_KIND_"); }

// "42 s", "12.5 min", "3.1 h".
std::string DurationText(double seconds) {
  if (seconds < 120) return Fixed(seconds, seconds < 10 ? 1 : 0) + " s";
  if (seconds < 7200) return Fixed(seconds / 60, 1) + " min";
  if (seconds < 172800) return Fixed(seconds / 3600, 1) + " h";
  return Fixed(seconds / 86400, 1) + " d";
}

std::string ShareText(const plant::v1::Yield& yield) {
  return yield.has_conform_share() ? Fixed(100 * yield.conform_share(), 1) + " %" : "-";
}

std::string WholeWayText(const MachineState& state) {
  for (const plant::v1::StepTime& step : state.steps())
    if (step.step() == plant::v1::BLADE_STEP_FIRST_SCAN_TO_VERDICT)
      return DurationText(step.p50_s()) + " / " + DurationText(step.p95_s());
  return "-";
}

// Of those in force the one that is over first; of several kinds all must be.
std::string CalibratedUntil(const MachineState& state) {
  const google::protobuf::Timestamp* first = nullptr;
  for (const plant::v1::MachineCalibration& calibration : state.calibrations())
    if (first == nullptr || calibration.valid_until().seconds() < first->seconds()) first = &calibration.valid_until();
  return first == nullptr ? "-" : TimeText(*first);
}

std::string AlarmsText(const MachineState& state) {
  std::string text;
  for (const plant::v1::MachineAlarm& alarm : state.alarms()) {
    const std::string name = AlarmName(alarm.kind());
    if (text.find(name) == std::string::npos) text += (text.empty() ? "" : ", ") + name;
  }
  return text.empty() ? "-" : text;
}

Cells FleetCells(const MachineState& state) {
  const plant::v1::Throughput& done = state.throughput();
  return {IdText(state.machine()),
          state.has_last_contact() ? TimeText(state.last_contact()) : "-",
          std::to_string(done.scan_count()),
          std::to_string(done.blades_begun_count()),
          std::to_string(done.blades_judged_count()),
          std::to_string(state.blades_in_work_count()),
          WholeWayText(state),
          ShareText(state.yield()),
          std::to_string(state.yield().undecidable_count()),
          CalibratedUntil(state),
          std::to_string(state.uploads_size()),
          AlarmsText(state)};
}

void AddSteps(const MachineState& state, std::ostringstream* out) {
  Table steps({"step", ">count", ">mean", ">p50", ">p95"});
  for (const plant::v1::StepTime& step : state.steps())
    steps.AddRow({StepName(step.step()), std::to_string(step.count()), DurationText(step.mean_s()),
                  DurationText(step.p50_s()), DurationText(step.p95_s())});
  if (!steps.empty()) *out << "\n" << steps.ToText();
}

void AddCalibrations(const MachineState& state, std::ostringstream* out) {
  Table calibrations({"kind", "calibration", "state", ">age_d", "valid_until", "moved most", ">by", ">u"});
  for (const plant::v1::MachineCalibration& c : state.calibrations())
    calibrations.AddRow({c.kind() + (c.axis().empty() ? "" : " " + c.axis()), IdText(c.name()),
                         c.in_force() ? "in force" : "over", Fixed(c.age_days(), 1), TimeText(c.valid_until()),
                         c.has_drift() ? c.drift().parameter() : "-",
                         c.has_drift() ? Significant(c.drift().change()) : "-",
                         c.has_drift() ? Fixed(c.drift().change_ratio(), 1) : "-"});
  if (!calibrations.empty()) *out << "\n" << calibrations.ToText();
}

std::string MachineText(const MachineState& state) {
  std::ostringstream out;
  const plant::v1::Throughput& done = state.throughput();
  const plant::v1::Yield& yield = state.yield();
  out << IdText(state.machine()) << ": last heard of "
      << (state.has_last_contact() ? TimeText(state.last_contact()) : "never")
      << (state.last_contact_by().empty() ? "" : " by " + state.last_contact_by()) << "\n"
      << "blades: " << done.blades_begun_count() << " begun, " << done.blades_judged_count() << " judged, "
      << state.blades_in_work_count() << " in work\n"
      << "entries: " << done.scan_count() << " scans, " << done.registration_count() << " registrations, "
      << done.correction_count() << " corrections, " << done.fetch_count() << " fetches, " << done.cut_count()
      << " reports of holes cut, " << done.inspection_count() << " inspections, " << done.rejudgement_count()
      << " judged anew\n"
      << "yield: " << ShareText(yield) << " (" << yield.conform_count() << " conform, " << yield.not_conform_count()
      << " not conform, " << yield.undecidable_count() << " undecidable, " << yield.not_measured_count()
      << " not measured)\n";
  AddSteps(state, &out);
  AddCalibrations(state, &out);
  Table uploads({"scan", "subject", ">blocks", ">points", ">bytes", "begun", "last block"});
  for (const plant::v1::UploadInProgress& upload : state.uploads())
    uploads.AddRow({upload.scan().empty() ? "-" : IdText(upload.scan()),
                    upload.subject().empty() ? "-" : upload.subject(), std::to_string(upload.block_count()),
                    Grouped(upload.point_count()), Grouped(upload.stored_bytes()), TimeText(upload.started_at()),
                    TimeText(upload.touched_at())});
  if (!uploads.empty()) out << "\n" << uploads.ToText();
  Table alarms({"alarm", "since", "what", "to do", "of"});
  for (const plant::v1::MachineAlarm& alarm : state.alarms())
    alarms.AddRow({AlarmName(alarm.kind()), TimeText(alarm.since()), alarm.message(), alarm.action(), alarm.subject()});
  out << "\n" << (alarms.empty() ? "no alarms\n" : alarms.ToText());
  return out.str();
}

std::string ActivityText(const plant::v1::MachineActivity& activity) {
  Table hours({"hour", ">scans", ">begun", ">judged", ">fetched", ">conform", ">not conform", ">undecidable"});
  for (const plant::v1::ActivityHour& hour : activity.hours())
    hours.AddRow({TimeText(hour.begins_at()), std::to_string(hour.throughput().scan_count()),
                  std::to_string(hour.throughput().blades_begun_count()),
                  std::to_string(hour.throughput().blades_judged_count()),
                  std::to_string(hour.throughput().fetch_count()), std::to_string(hour.yield().conform_count()),
                  std::to_string(hour.yield().not_conform_count()), std::to_string(hour.yield().undecidable_count())});
  return hours.empty() ? "nothing in that span\n" : hours.ToText();
}

struct FleetArguments {
  std::string machine, since, until;
  int limit = 0;
};

void AddSpanOptions(Command* command, FleetArguments* arguments) {
  command->AddOption("--since", &arguments->since, "Count from then on; without it the last 24 hours");
  command->AddOption("--until", &arguments->until, "Count to then");
}

template <typename Request>
absl::Status SetSpan(const FleetArguments& arguments, Request* request) {
  const auto span = TimeRangeOf(arguments.since, arguments.until);
  if (!span.ok()) return span.status();
  if (span->has_from() || span->has_until()) *request->mutable_span() = *span;
  return absl::OkStatus();
}

absl::Status ShowMachine(Session* session, const FleetArguments& arguments) {
  plant::v1::ListMachineStatesRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  if (absl::Status set = SetSpan(arguments, &request); !set.ok()) return set;
  plant::v1::ListMachineStatesResponse response;
  absl::Status status =
      session->Call<FleetService>("plant", &FleetService::Stub::ListMachineStates, request, &response);
  if (!status.ok()) return status;
  if (response.machines().empty()) return absl::NotFoundError(request.machine() + ": want one that is registered");
  PrintMessage(session->json, response.machines(0), [&] { return MachineText(response.machines(0)); });
  return absl::OkStatus();
}

}  // namespace

void AddFleetCommands(Command* app, Session* session) {
  Command* fleet = app->AddCommand("fleet", "Machines as they stand: contact, throughput, yield, calibration, alarms");
  fleet->RequireCommand();
  const auto of_list = std::make_shared<FleetArguments>();
  Command* list = fleet->AddCommand("list", "All machines, a line each");
  AddSpanOptions(list, of_list.get());
  AddLimitOption(list, &of_list->limit);
  session->OnCommand(list, [session, of_list]() -> absl::Status {
    plant::v1::ListMachineStatesRequest request;
    if (absl::Status set = SetSpan(*of_list, &request); !set.ok()) return set;
    return ListAndPrint<FleetService>(
        session, "plant", &FleetService::Stub::ListMachineStates, request, of_list->limit,
        Table({"machine", "last contact", ">scans", ">begun", ">judged", ">in work", ">way p50 / p95", ">yield",
               ">undecidable", "calibrated until", ">uploads", "alarms"}),
        &plant::v1::ListMachineStatesResponse::machines, FleetCells, "no machine is registered\n");
  });

  const auto of_show = std::make_shared<FleetArguments>();
  Command* show = fleet->AddCommand("show", "One machine: steps, calibrations, uploads, alarms and what to do");
  show->AddOption("MACHINE", &of_show->machine, "Its id")->Required();
  AddSpanOptions(show, of_show.get());
  session->OnCommand(show, [session, of_show] { return ShowMachine(session, *of_show); });

  const auto of_hours = std::make_shared<FleetArguments>();
  Command* hours = fleet->AddCommand("hours", "What one machine did, hour by hour (UTC)");
  hours->AddOption("MACHINE", &of_hours->machine, "Its id")->Required();
  AddSpanOptions(hours, of_hours.get());
  session->OnCommand(hours, [session, of_hours]() -> absl::Status {
    plant::v1::GetMachineActivityRequest request;
    request.set_machine(NameText("machines", of_hours->machine));
    if (absl::Status set = SetSpan(*of_hours, &request); !set.ok()) return set;
    return CallAndPrint<FleetService>(session, "plant", &FleetService::Stub::GetMachineActivity, request, ActivityText)
        .status();
  });
}

}  // namespace sixpoint::cli
