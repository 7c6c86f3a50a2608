#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <set>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/table.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::CalibrationService;
using correction::v1::CorrectionService;
using inspection::v1::InspectionService;
using registration::v1::RegistrationService;

// What rests on a calibration: calibrations of the axes made with it, the registrations that used it, then the corrections and verdicts that rest on those.
struct Resting {
  nlohmann::json json = {{"calibrations", nlohmann::json::array()},
                         {"registrations", nlohmann::json::array()},
                         {"corrections", nlohmann::json::array()},
                         {"inspections", nlohmann::json::array()}};
  Table table{{"blade", "kind", "name", "rests on", "result", "recorded"}};
  std::set<std::string> registrations;
};

absl::Status Trace(Session* session, const calibration::v1::Calibration& calibration) {
  Resting resting;
  // A calibration of the axes may rest on how one axis positions.
  std::set<std::string> calibrations{calibration.name()};
  calibration::v1::ListCalibrationsRequest of_machine;
  of_machine.set_machine(calibration.machine());
  absl::Status status = ForEachPage<CalibrationService>(
      session, "calibration", &CalibrationService::Stub::ListCalibrations, of_machine,
      [&](const calibration::v1::ListCalibrationsResponse& page) {
        for (const auto& entry : page.calibrations()) {
          const auto& inputs = entry.inputs();
          if (std::find(inputs.begin(), inputs.end(), calibration.name()) == inputs.end()) continue;
          calibrations.insert(entry.name());
          resting.json["calibrations"].push_back(entry.name());
          resting.table.AddRow(
              {"-", "calibration", entry.name(), calibration.name(), entry.method(), TimeText(entry.recorded_at())});
        }
      });
  if (!status.ok()) return status;
  status = ForEachPage<RegistrationService>(
      session, "registration", &RegistrationService::Stub::ListRegistrations,
      registration::v1::ListRegistrationsRequest(), [&](const registration::v1::ListRegistrationsResponse& page) {
        for (const auto& entry : page.registrations()) {
          const bool by_sensor = calibrations.count(entry.sensor_calibration()) > 0;
          if (!by_sensor && calibrations.count(entry.rotation_calibration()) == 0) continue;
          resting.registrations.insert(entry.name());
          resting.json["registrations"].push_back(entry.name());
          resting.table.AddRow({IdText(entry.blade()), "registration", entry.name(),
                                by_sensor ? entry.sensor_calibration() : entry.rotation_calibration(),
                                OutcomeName(entry.evidence().outcome()), TimeText(entry.recorded_at())});
        }
      });
  if (!status.ok()) return status;
  status = ForEachPage<CorrectionService>(
      session, "correction", &CorrectionService::Stub::ListCorrections, correction::v1::ListCorrectionsRequest(),
      [&](const correction::v1::ListCorrectionsResponse& page) {
        for (const auto& entry : page.corrections()) {
          if (resting.registrations.count(entry.registration()) == 0) continue;
          resting.json["corrections"].push_back(entry.name());
          resting.table.AddRow({IdText(entry.blade()), "correction", entry.name(), entry.registration(),
                                Release_Name(entry.release()).substr(8), TimeText(entry.recorded_at())});
        }
      });
  if (!status.ok()) return status;
  status = ForEachPage<InspectionService>(
      session, "inspection", &InspectionService::Stub::ListInspections, inspection::v1::ListInspectionsRequest(),
      [&](const inspection::v1::ListInspectionsResponse& page) {
        for (const auto& entry : page.inspections()) {
          if (resting.registrations.count(entry.registration()) == 0) continue;
          resting.json["inspections"].push_back(entry.name());
          resting.table.AddRow({IdText(entry.blade()), "inspection", entry.name(), entry.registration(),
                                VerdictName(entry.verdict()), TimeText(entry.recorded_at())});
        }
      });
  if (!status.ok()) return status;
  if (!session->json && resting.table.empty()) {
    std::cout << "nothing rests on " << calibration.name() << "\n";
    return status;
  }
  PrintList(session->json, resting.json, resting.table);
  return status;
}

}  // namespace

void AddTraceCommand(CLI::App* app, Session* session) {
  const auto calibration = std::make_shared<std::string>();
  CLI::App* command = app->add_subcommand("trace", "Recall: everything that rests on a calibration");
  command->add_option("--calibration", *calibration, "The calibration")->required();
  session->OnCommand(command, [session, calibration]() -> absl::Status {
    // A calibration that does not exist must not read as one that nothing rests on.
    calibration::v1::GetCalibrationRequest request;
    request.set_name(CalibrationNameText(*calibration));
    calibration::v1::Calibration found;
    absl::Status status =
        session->Call<CalibrationService>("calibration", &CalibrationService::Stub::GetCalibration, request, &found);
    if (!status.ok()) return status;
    return Trace(session, found);
  });
}

}  // namespace sixpoint::cli
