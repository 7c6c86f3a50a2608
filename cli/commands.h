// The commands, one file per noun. Each adds its subcommands and hands their actions to the session.
#pragma once

#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/output.h"
#include "cli/progress.h"
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
void AddRegistrationCommands(CLI::App* app, Session* session);
void AddCorrectCommand(CLI::App* app, Session* session);
void AddCorrectionCommands(CLI::App* app, Session* session);
void AddInspectCommand(CLI::App* app, Session* session);
void AddInspectionCommands(CLI::App* app, Session* session);
void AddRecallCommand(CLI::App* app, Session* session);
void AddCallCommand(CLI::App* app, Session* session);
void AddPlantCommands(CLI::App* app, Session* session);
void AddLocalPlantCommands(CLI::App* app, Session* session);
void AddCompletionCommand(CLI::App* app, Session* session);
void AddCalibrateStudyCommands(CLI::App* calibrate, Session* session);  // two of calibrate's, written with study's
void AddStudyCommands(CLI::App* app, Session* session);

// One call that takes its time: a line on stderr says what is being done and for how long.
template <typename Service, typename Request, typename Response>
absl::StatusOr<Response> CallAtLength(Session* session, const std::string& doing, const std::string& area,
                                      grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                            Response*),
                                      const Request& request) {
  const Elapsed elapsed(doing, session->json || doing.empty());
  Response response;
  absl::Status status = session->Call<Service>(area, method, request, &response);
  if (!status.ok()) return status;
  return response;
}

// One call, its answer printed: by `text` (of the response) where it is for people. `doing`: of a call that takes its time.
template <typename Service, typename Request, typename Response>
absl::StatusOr<Response> CallAndPrint(Session* session, const std::string& area,
                                      grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                            Response*),
                                      const Request& request, std::string (*text)(const Response&),
                                      const std::string& doing = "") {
  absl::StatusOr<Response> response = CallAtLength<Service>(session, doing, area, method, request);
  if (response.ok()) PrintMessage(session->json, *response, [&] { return text(*response); });
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

// `--limit N`, which every list has.
inline void AddLimitOption(CLI::App* list, int* limit) {
  list->add_option("--limit", *limit, "At most so many; without it, all")->check(CLI::PositiveNumber);
}

// A list, printed: `request` is a List...Request, `entries` the field of its response that is listed, `row` an entry's cells. Reads
// no more pages than the limit wants; 0: all. `none`: what people read instead of an empty table.
template <typename Service, typename Request, typename Response, typename Entry, typename Row>
absl::Status ListAndPrint(Session* session, const std::string& area,
                          grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                          Request request, int limit, Table table,
                          const google::protobuf::RepeatedPtrField<Entry>& (Response::*entries)() const, const Row& row,
                          const std::string& none = "") {
  nlohmann::json json = nlohmann::json::array();
  int count = 0;
  const auto wants_more = [&] { return limit == 0 || count < limit; };
  Response response;
  do {
    request.set_page_token(response.next_page_token());
    if (limit > 0) request.set_page_size(limit - count);
    if (absl::Status status = session->Call<Service>(area, method, request, &response); !status.ok()) return status;
    for (const Entry& entry : (response.*entries)()) {
      if (!wants_more()) break;
      ++count;
      if (session->json) {
        json.push_back(MessageToJson(entry));
      } else {
        table.AddRow(row(entry));
      }
    }
  } while (wants_more() && !response.next_page_token().empty());
  if (!session->json && count == 0 && !none.empty()) {
    std::cout << none;
  } else {
    PrintList(session->json, json, table);
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::cli
