#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/study_reports.h"
#include "cli/table.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {

using calibration::v1::CalibrationService;

namespace {

struct Decision {
  std::string calibration, reason;
};

absl::Status Release(Session* session, const Decision& decision) {
  calibration::v1::ReleaseCalibrationRequest request;
  request.set_name(NameText("calibrations", decision.calibration));
  request.set_reason(decision.reason);
  request.set_requested_by(session->requested_by());
  request.set_request_id(NewRequestId());
  calibration::v1::Calibration response;
  absl::Status status = session->Call<CalibrationService>("calibration", &CalibrationService::Stub::ReleaseCalibration,
                                                          request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(MessageToJson(response));
  } else {
    std::cout << CalibrationText(response);
  }
  return status;
}

absl::Status Withdraw(Session* session, const Decision& decision) {
  calibration::v1::WithdrawCalibrationRequest request;
  request.set_name(NameText("calibrations", decision.calibration));
  request.set_reason(decision.reason);
  request.set_requested_by(session->requested_by());
  request.set_request_id(NewRequestId());
  calibration::v1::WithdrawCalibrationResponse response;
  absl::Status status = session->Call<CalibrationService>("calibration", &CalibrationService::Stub::WithdrawCalibration,
                                                          request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(MessageToJson(response));
  } else {
    std::cout << WithdrawalText(response);
  }
  return status;
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

struct TrendArguments {
  std::string machine, kind = "sensor";
  std::vector<std::string> parameters, limits;
  double coverage_factor = 0;
};

absl::Status Trend(Session* session, const TrendArguments& arguments) {
  calibration::v1::GetCalibrationTrendRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  request.set_kind(arguments.kind == "rotation" ? calibration::v1::CALIBRATION_KIND_ROTATION
                                                : calibration::v1::CALIBRATION_KIND_SENSOR);
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
  calibration::v1::CalibrationTrend response;
  absl::Status status = session->Call<CalibrationService>("calibration", &CalibrationService::Stub::GetCalibrationTrend,
                                                          request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(MessageToJson(response));
  } else {
    std::cout << TrendText(response);
  }
  if (response.alarm()) session->MarkNotUsable();
  return status;
}

void AddTrendCommand(CLI::App* calibration, Session* session) {
  const auto arguments = std::make_shared<TrendArguments>();
  CLI::App* trend = calibration->add_subcommand("trend", "Each parameter over time; exit code 4 where one has moved");
  trend->add_option("--machine", arguments->machine, "The machine")->required();
  trend->add_option("--kind", arguments->kind, "sensor (the default) or rotation")
      ->check(CLI::IsMember({"sensor", "rotation"}));
  trend->add_option("--parameters", arguments->parameters, "alpha_deg,...; without it, all")
      ->delimiter(',')
      ->allow_extra_args(false);
  trend->add_option("--limit", arguments->limits, "PARAMETER=NUMBER: greatest distance from the first value");
  trend->add_option("--coverage-factor", arguments->coverage_factor, "Combined standard uncertainties; 3 without it");
  session->OnCommand(trend, [session, arguments] { return Trend(session, *arguments); });
}

}  // namespace

void AddCalibrationCommands(CLI::App* app, Session* session) {
  CLI::App* calibration = app->add_subcommand("calibration", "Calibrations that were made");
  calibration->require_subcommand(1);
  const auto argument = std::make_shared<std::string>();

  CLI::App* list = calibration->add_subcommand("list", "Lists calibrations");
  list->add_option("--machine", *argument, "Only of this machine");
  session->OnCommand(list, [session, argument]() -> absl::Status {
    calibration::v1::ListCalibrationsRequest request;
    if (!argument->empty()) request.set_machine(NameText("machines", *argument));
    nlohmann::json json = nlohmann::json::array();
    Table table({"calibration", "kind", "machine", "method", "state", ">rms um", "valid from", "valid until"});
    absl::Status status = ForEachPage<CalibrationService>(
        session, "calibration", &CalibrationService::Stub::ListCalibrations, request,
        [&](const calibration::v1::ListCalibrationsResponse& page) {
          for (const calibration::v1::Calibration& entry : page.calibrations()) {
            json.push_back(MessageToJson(entry));
            const double rms_um = entry.has_sensor()  ? entry.sensor().residual_rms_um()
                                  : entry.has_probe() ? entry.probe().residual_rms_um()
                                                      : entry.rotation().residual_rms_um();
            table.AddRow({IdText(entry.name()), EnumText(CalibrationKind_Name(entry.kind()), "CALIBRATION_KIND_"),
                          IdText(entry.machine()), entry.method(),
                          EnumText(CalibrationState_Name(entry.state()), "CALIBRATION_STATE_"), Fixed(rms_um, 3),
                          TimeText(entry.valid_from()), TimeText(entry.valid_until())});
          }
        });
    if (!status.ok()) return status;
    PrintList(session->json, json, table);
    return status;
  });

  CLI::App* show = calibration->add_subcommand("show", "Shows a calibration with its uncertainties");
  show->add_option("ID", *argument, "The calibration")->required();
  session->OnCommand(show, [session, argument]() -> absl::Status {
    calibration::v1::GetCalibrationRequest request;
    request.set_name(NameText("calibrations", *argument));
    calibration::v1::Calibration response;
    absl::Status status =
        session->Call<CalibrationService>("calibration", &CalibrationService::Stub::GetCalibration, request, &response);
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson(MessageToJson(response));
    } else {
      std::cout << CalibrationText(response);
    }
    return status;
  });

  AddStateCommands(calibration, session);
  AddTrendCommand(calibration, session);
}

}  // namespace sixpoint::cli
