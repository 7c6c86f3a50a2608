#include <cstdlib>
#include <map>

#include "cli/commands.h"
#include "cli/list_filters.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/study_reports.h"
#include "cli/table.h"
#include "services/runtime/errors.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {

using calibration::v1::CalibrationService;

namespace {

struct DecidedCalibration {
  std::string calibration, reason;
};

template <typename Request>
Request RequestOf(const DecidedCalibration& decision) {
  Request request;
  request.set_name(CalibrationNameText(decision.calibration));
  request.set_reason(decision.reason);
  request.set_request_id(NewRequestId());
  return request;
}

absl::Status Release(Session* session, const DecidedCalibration& decision) {
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::ReleaseCalibration,
                                          RequestOf<calibration::v1::ReleaseCalibrationRequest>(decision),
                                          CalibrationText)
      .status();
}

absl::Status Withdraw(Session* session, const DecidedCalibration& decision) {
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::WithdrawCalibration,
                                          RequestOf<calibration::v1::WithdrawCalibrationRequest>(decision),
                                          WithdrawalText)
      .status();
}

void AddStateCommands(Command* calibration, Session* session) {
  const auto decision = std::make_shared<DecidedCalibration>();
  Command* release = calibration->AddCommand("release", "Puts a draft in force");
  release->AddOption("ID", &decision->calibration, "The calibration")->Required();
  release->AddOption("--reason", &decision->reason, "Kept in the record");
  session->OnCommand(release, [session, decision] { return Release(session, *decision); });

  Command* withdraw =
      calibration->AddCommand("withdraw", "Takes a calibration out of use for ever, and lists what rests on it");
  withdraw->AddOption("ID", &decision->calibration, "The calibration")->Required();
  withdraw->AddOption("--reason", &decision->reason, "Kept in the record")->Required();
  session->OnCommand(withdraw, [session, decision] { return Withdraw(session, *decision); });
}

struct TrendArguments {
  std::string machine, kind = "sensor", axis;
  std::vector<std::string> parameters, limits;
  double coverage_factor = 0;
};

absl::Status Trend(Session* session, const TrendArguments& arguments) {
  calibration::v1::GetCalibrationTrendRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_kind(static_cast<calibration::v1::CalibrationKind>(
      ValueOf(*calibration::v1::CalibrationKind_descriptor(), arguments.kind)));
  request.set_axis(arguments.axis);
  for (const std::string& parameter : arguments.parameters) request.add_parameters(parameter);
  for (const std::string& text : arguments.limits) {
    const std::size_t equals = text.find('=');
    char* end = nullptr;
    const double limit = equals == std::string::npos ? 0 : std::strtod(text.c_str() + equals + 1, &end);
    if (end == nullptr || *end != '\0') return runtime::Refuse("--limit", text, "PARAMETER=NUMBER");
    calibration::v1::ParameterLimit* out = request.add_limits();
    out->set_parameter(text.substr(0, equals));
    out->set_limit(limit);
  }
  request.set_coverage_factor(arguments.coverage_factor);
  const absl::StatusOr<calibration::v1::CalibrationTrend> trend = CallAndPrint<CalibrationService>(
      session, "calibration", &CalibrationService::Stub::GetCalibrationTrend, request, TrendText);
  if (!trend.ok()) return trend.status();
  if (trend->alarm()) session->MarkNotUsable();
  return absl::OkStatus();
}

void AddTrendCommand(Command* calibration, Session* session) {
  const auto arguments = std::make_shared<TrendArguments>();
  Command* trend = calibration->AddCommand("trend", "Each parameter over time; exit code 4 where one has moved");
  trend->AddOption("--machine", &arguments->machine, "The machine")->Required();
  trend->AddOption("--kind", &arguments->kind, "sensor (the default), rotation, probe or axis")
      ->OneOf(WordsOf(*calibration::v1::CalibrationKind_descriptor()));
  trend->AddOption("--axis", &arguments->axis, "Of kind axis: its letter");
  trend->AddOption("--parameters", &arguments->parameters, "alpha_deg,...; without it, all")->List();
  trend->AddOption("--limit", &arguments->limits, "PARAMETER=NUMBER: greatest distance from the first value");
  trend->AddOption("--coverage-factor", &arguments->coverage_factor, "Combined standard uncertainties; 3 without it");
  session->OnCommand(trend, [session, arguments] { return Trend(session, *arguments); });
}

std::string RmsText(const calibration::v1::Calibration& entry) {
  if (entry.has_axis() || !entry.sensor().certificate().empty()) return "-";  // there was no fit
  return Fixed(entry.has_sensor()  ? entry.sensor().residual_rms_um()
               : entry.has_probe() ? entry.probe().residual_rms_um()
                                   : entry.rotation().residual_rms_um(),
               3);
}

absl::Status ShowCalibration(Session* session, const std::string& id) {
  calibration::v1::GetCalibrationRequest request;
  request.set_name(CalibrationNameText(id));
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::GetCalibration, request,
                                          CalibrationText)
      .status();
}

}  // namespace

void AddCalibrationCommands(Command* app, Session* session) {
  Command* calibration = app->AddCommand("calibration", "Calibrations that were made");
  calibration->RequireCommand();

  AddListCommand<CalibrationService>(
      calibration, session, "Lists calibrations", "calibration", &CalibrationService::Stub::ListCalibrations,
      calibration::v1::ListCalibrationsRequest(),
      Table({"calibration", "kind", "machine", "method", "state", ">rms um", "valid from", "valid until", "by"}),
      &calibration::v1::ListCalibrationsResponse::calibrations, [](const calibration::v1::Calibration& entry) {
        return Cells{IdText(entry.name()),
                     CalibrationKindText(entry),
                     IdText(entry.machine()),
                     entry.method(),
                     EnumText(CalibrationState_Name(entry.state()), "CALIBRATION_STATE_"),
                     RmsText(entry),
                     TimeText(entry.valid_from()),
                     TimeText(entry.valid_until()),
                     entry.requested_by()};
      });

  const auto id = std::make_shared<std::string>();
  Command* show = calibration->AddCommand("show", "Shows a calibration with its uncertainties");
  show->AddOption("ID", id.get(), "The calibration")->Required();
  session->OnCommand(show, [session, id] { return ShowCalibration(session, *id); });

  AddStateCommands(calibration, session);
  AddTrendCommand(calibration, session);
}

}  // namespace sixpoint::cli
