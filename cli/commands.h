// The commands, one file per noun. Each adds its subcommands and hands their actions to the session.
#pragma once

#include "cli/output.h"
#include "cli/session.h"

namespace sixpoint::cli {

void AddMachineCommands(CLI::App* app, Session* session);
void AddArtefactCommands(CLI::App* app, Session* session);
void AddPartCommands(CLI::App* app, Session* session);
void AddBladeCommands(CLI::App* app, Session* session);
void AddScanCommands(CLI::App* app, Session* session);
void AddDeletePointsCommand(CLI::App* scan, Session* session);  // one of scan's, written with the store's
void AddStoreCommands(CLI::App* app, Session* session);
void AddCalibrateCommands(CLI::App* app, Session* session);
void AddCalibrateAxisCommand(CLI::App* calibrate, Session* session);  // one of calibrate's
void AddCalibrationCommands(CLI::App* app, Session* session);
void AddRegisterCommand(CLI::App* app, Session* session);
void AddCorrectCommand(CLI::App* app, Session* session);
void AddInspectCommand(CLI::App* app, Session* session);
void AddTraceCommand(CLI::App* app, Session* session);
void AddCallCommand(CLI::App* app, Session* session);
void AddPlantCommands(CLI::App* app, Session* session);
void AddCalibrateStudyCommands(CLI::App* calibrate, Session* session);  // two of calibrate's, written with study's
void AddStudyCommands(CLI::App* app, Session* session);

// One call, its answer printed: by `text` (of the response) where it is for people.
template <typename Service, typename Request, typename Response>
absl::StatusOr<Response> CallAndPrint(Session* session, const std::string& area,
                                      grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                            Response*),
                                      const Request& request, std::string (*text)(const Response&)) {
  Response response;
  absl::Status status = session->Call<Service>(area, method, request, &response);
  if (!status.ok()) return status;
  PrintMessage(session->json, response, [&] { return text(response); });
  return response;
}

// Every page of a list; `request` is a List...Request, `collect` takes one response.
template <typename Service, typename Request, typename Response, typename Collect>
absl::Status ForEachPage(Session* session, const std::string& area,
                         grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                         Request request, const Collect& collect) {
  Response response;
  do {
    request.set_page_token(response.next_page_token());
    absl::Status status = session->Call<Service>(area, method, request, &response);
    if (!status.ok()) return status;
    collect(response);
  } while (!response.next_page_token().empty());
  return absl::OkStatus();
}

}  // namespace sixpoint::cli
