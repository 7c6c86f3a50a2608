#include <CLI/CLI.hpp>
#include <cstdlib>
#include <map>

#include "cli/commands.h"
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

struct Decision {
  std::string calibration, reason;
};

template <typename Request>
Request RequestOf(const Session& session, const Decision& decision) {
  Request request;
  request.set_name(CalibrationNameText(decision.calibration));
  request.set_reason(decision.reason);
  request.set_requested_by(session.requested_by());
  request.set_request_id(NewRequestId());
  return request;
}

absl::Status Release(Session* session, const Decision& decision) {
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::ReleaseCalibration,
                                          RequestOf<calibration::v1::ReleaseCalibrationRequest>(*session, decision),
                                          CalibrationText)
      .status();
}

absl::Status Withdraw(Session* session, const Decision& decision) {
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::WithdrawCalibration,
                                          RequestOf<calibration::v1::WithdrawCalibrationRequest>(*session, decision),
                                          WithdrawalText)
      .status();
}

void AddStateCommands(CLI::App* calibration, Session* session) {
  const auto decision = std::make_shared<Decision>();
  CLI::App* release = calibration->add_subcommand("release", "Puts a draft in force");
  release->add_option("ID", decision->calibration, "The calibration")->required();
  release->add_option("--reason", decision->reason, "Kept in the record");
  session->OnCommand(release, [session, decision] { return Release(session, *decision); });

  CLI::App* withdraw =
      calibration->add_subcommand("withdraw", "Takes a calibration out of use for ever, and lists what rests on it");
  withdraw->add_option("ID", decision->calibration, "The calibration")->required();
  withdraw->add_option("--reason", decision->reason, "Kept in the record")->required();
  session->OnCommand(withdraw, [session, decision] { return Withdraw(session, *decision); });
}

// What `calibration list` and `calibration trend` call the kinds.
const std::map<std::string, calibration::v1::CalibrationKind> kKinds = {
    {"sensor", calibration::v1::CALIBRATION_KIND_SENSOR},
    {"rotation", calibration::v1::CALIBRATION_KIND_ROTATION},
    {"probe", calibration::v1::CALIBRATION_KIND_PROBE},
    {"axis", calibration::v1::CALIBRATION_KIND_AXIS}};

struct TrendArguments {
  std::string machine, kind = "sensor", axis;
  std::vector<std::string> parameters, limits;
  double coverage_factor = 0;
};

absl::Status Trend(Session* session, const TrendArguments& arguments) {
  calibration::v1::GetCalibrationTrendRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_kind(kKinds.at(arguments.kind));
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

void AddTrendCommand(CLI::App* calibration, Session* session) {
  const auto arguments = std::make_shared<TrendArguments>();
  CLI::App* trend = calibration->add_subcommand("trend", "Each parameter over time; exit code 4 where one has moved");
  trend->add_option("--machine", arguments->machine, "The machine")->required();
  trend->add_option("--kind", arguments->kind, "sensor (the default), rotation, probe or axis")
      ->check(CLI::IsMember(&kKinds));
  trend->add_option("--axis", arguments->axis, "Of kind axis: its letter");
  trend->add_option("--parameters", arguments->parameters, "alpha_deg,...; without it, all")
      ->delimiter(',')
      ->allow_extra_args(false);
  trend->add_option("--limit", arguments->limits, "PARAMETER=NUMBER: greatest distance from the first value");
  trend->add_option("--coverage-factor", arguments->coverage_factor, "Combined standard uncertainties; 3 without it");
  session->OnCommand(trend, [session, arguments] { return Trend(session, *arguments); });
}

struct ListArguments {
  std::string machine, kind, axis;
  int limit = 0;
};

std::string RmsText(const calibration::v1::Calibration& entry) {
  if (entry.has_axis()) return "-";
  return Fixed(entry.has_sensor()  ? entry.sensor().residual_rms_um()
               : entry.has_probe() ? entry.probe().residual_rms_um()
                                   : entry.rotation().residual_rms_um(),
               3);
}

absl::Status List(Session* session, const ListArguments& arguments) {
  calibration::v1::ListCalibrationsRequest request;
  if (!arguments.machine.empty()) request.set_machine(NameText("machines", arguments.machine));
  // An axis is enough to say which kind is meant.
  if (!arguments.kind.empty() || !arguments.axis.empty())
    request.set_kind(kKinds.at(arguments.kind.empty() ? "axis" : arguments.kind));
  request.set_axis(arguments.axis);
  return ListAndPrint<CalibrationService>(
      session, "calibration", &CalibrationService::Stub::ListCalibrations, request, arguments.limit,
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
}

absl::Status Show(Session* session, const std::string& id) {
  calibration::v1::GetCalibrationRequest request;
  request.set_name(CalibrationNameText(id));
  return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::GetCalibration, request,
                                          CalibrationText)
      .status();
}

}  // namespace

void AddCalibrationCommands(CLI::App* app, Session* session) {
  CLI::App* calibration = app->add_subcommand("calibration", "Calibrations that were made");
  calibration->require_subcommand(1);

  const auto arguments = std::make_shared<ListArguments>();
  CLI::App* list = calibration->add_subcommand("list", "Lists calibrations");
  list->add_option("--machine", arguments->machine, "Only of this machine");
  list->add_option("--kind", arguments->kind, "Only sensor, rotation, probe or axis")->check(CLI::IsMember(&kKinds));
  list->add_option("--axis", arguments->axis, "Only how this axis positions");
  AddLimitOption(list, &arguments->limit);
  session->OnCommand(list, [session, arguments] { return List(session, *arguments); });

  const auto id = std::make_shared<std::string>();
  CLI::App* show = calibration->add_subcommand("show", "Shows a calibration with its uncertainties");
  show->add_option("ID", *id, "The calibration")->required();
  session->OnCommand(show, [session, id] { return Show(session, *id); });

  AddStateCommands(calibration, session);
  AddTrendCommand(calibration, session);
}

}  // namespace sixpoint::cli
