// The commands, one file per noun. Each adds its subcommands and hands their actions to the session.
#pragma once

#include <iostream>

#include "cli/command_line.h"
#include "cli/list_filters.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/session.h"

namespace sixpoint::cli {

void AddMachineCommands(Command* app, Session* session);
void AddOpenCommand(Command* app, Session* session);
void AddFleetCommands(Command* app, Session* session);
void AddArtefactCommands(Command* app, Session* session);
void AddDrawingCommands(Command* app, Session* session);
void AddModelCommands(Command* app, Session* session);
void AddPersonCommands(Command* app, Session* session);
void AddPartCommands(Command* app, Session* session);
void AddBladeCommands(Command* app, Session* session);
void AddScanCommands(Command* app, Session* session);
void AddDeletePointsCommand(Command* scan, Session* session);  // one of scan's, written with the store's
void AddStoreCommands(Command* app, Session* session);
void AddStorageCommands(Command* app, Session* session);
void AddCalibrateCommands(Command* app, Session* session);
void AddCalibrateStatedCommand(Command* calibrate, Session* session);
void AddCalibrateAxisCommand(Command* calibrate, Session* session);  // one of calibrate's
void AddCalibrationCommands(Command* app, Session* session);
void AddPlanCommand(Command* app, Session* session);
void AddRegisterCommand(Command* app, Session* session);
void AddRegistrationCommands(Command* app, Session* session);
void AddCorrectCommand(Command* app, Session* session);
void AddCorrectionCommands(Command* app, Session* session);
void AddReconstructionCommands(Command* app, Session* session);
void AddMachiningPassCommands(Command* app, Session* session);
void AddRepairCommands(Command* app, Session* session);
void AddInspectCommand(Command* app, Session* session);
void AddInspectionCommands(Command* app, Session* session);
void AddDeviationCommands(Command* app, Session* session);
void AddMeasurementCommands(Command* app, Session* session);
void AddSectionCommands(Command* app, Session* session);
void AddAssessCommand(Command* app, Session* session);
void AddAssessmentCommands(Command* app, Session* session);
void AddExportCommand(Command* app, Session* session);
void AddReportCommands(Command* app, Session* session);
void AddRecallCommand(Command* app, Session* session);
void AddEventsCommand(Command* app, Session* session);
void AddWebhookCommands(Command* app, Session* session);
void AddTraceCommand(Command* app, Session* session);
void AddReplayCommand(Command* app, Session* session);
void AddRejudgeCommand(Command* app, Session* session);
void AddValuesCommand(Command* app, Session* session);
void AddEfficacyCommand(Command* app, Session* session);
void AddLedgerCommands(Command* app, Session* session);
void AddCallCommand(Command* app, Session* session);
void AddPlantCommands(Command* app, Session* session);
void AddLocalPlantCommands(Command* app, Session* session);
void AddSeedCommand(Command* app, Session* session);
void AddLogsCommand(Command* app, Session* session);
void AddDoctorCommand(Command* app, Session* session);
void AddCertsCommands(Command* app, Session* session);
void AddClearanceCommands(Command* app, Session* session);
void AddAccountsCommands(Command* app, Session* session);
void AddCompletionCommand(Command* app, Session* session);
void AddCalibrateStudyCommands(Command* calibrate, Session* session);  // two of calibrate's, written with study's
void AddStudyCommands(Command* app, Session* session);

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

// Every message of a download, with a line on stderr as CallAtLength has it. A call that broke off begins anew: `begin` forgets what
// came before. `take` says of each message whether it is right.
template <typename Service, typename Request, typename Message, typename Begin, typename Take>
absl::Status FetchEach(Session* session, const std::string& doing, const std::string& area,
                       std::unique_ptr<grpc::ClientReader<Message>> (Service::Stub::*method)(grpc::ClientContext*,
                                                                                             const Request&),
                       const Request& request, const Begin& begin, const Take& take) {
  const Elapsed elapsed(doing, session->json);
  return session->Retrying(area, [&](const auto& channel, auto context) {
    begin();
    const auto stub = Service::NewStub(channel);
    const auto reader = (stub.get()->*method)(context.get(), request);
    absl::Status good;
    for (Message one; good.ok() && reader->Read(&one);) good = take(one);
    if (!good.ok()) context->TryCancel();
    const absl::Status finished = runtime::FromGrpc(reader->Finish());
    return good.ok() ? finished : good;
  });
}

// What `text_of` makes of each of them, below `head`.
template <typename Service, typename Request, typename Message, typename Text>
absl::StatusOr<std::string> FetchContent(
    Session* session, const std::string& doing, const std::string& area,
    std::unique_ptr<grpc::ClientReader<Message>> (Service::Stub::*method)(grpc::ClientContext*, const Request&),
    const Request& request, const std::string& head, const Text& text_of) {
  std::string text;
  const auto begin = [&] { text = head; };
  const auto take = [&](const Message& one) {
    text += text_of(one);
    return absl::OkStatus();
  };
  absl::Status fetched = FetchEach<Service>(session, doing, area, method, request, begin, take);
  if (!fetched.ok()) return fetched;
  return text;
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

// A list, printed: `request` is a List...Request, `entries` the field of its response that is listed, `row` an entry's cells. Reads
// no more pages than the limit wants; 0: all. `none`: what people read instead of an empty table.
template <typename Service, typename Request, typename Response, typename Entry, typename Row>
absl::Status ListAndPrint(Session* session, const std::string& area,
                          grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                          Request request, int limit, Table table,
                          const google::protobuf::RepeatedPtrField<Entry>& (Response::*entries)() const, const Row& row,
                          const std::string& none = "") {
  ListOutput out(session->json, std::move(table));
  const auto wants_more = [&] { return WantsMore(limit, out.count()); };
  Response response;
  do {
    request.set_page_token(response.next_page_token());
    if (limit > 0) request.set_page_size(limit - out.count());
    if (absl::Status status = session->Call<Service>(area, method, request, &response); !status.ok()) return status;
    for (const Entry& entry : (response.*entries)()) {
      if (!wants_more()) break;
      out.Add(entry, [&] { return row(entry); });
    }
  } while (wants_more() && !response.next_page_token().empty());
  out.Print(none);
  return absl::OkStatus();
}

// `NOUN list` with the filters of its request as options (cli/list_filters.h); `request` says what is asked of every list.
template <typename Service, typename Request, typename Response, typename Entry, typename Row>
void AddListCommand(Command* noun, Session* session, const std::string& help, const std::string& area,
                    grpc::Status (Service::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, const Table& table,
                    const google::protobuf::RepeatedPtrField<Entry>& (Response::*entries)() const, const Row& row) {
  Command* const list = noun->AddCommand("list", help);
  const auto filters = ListFilters::AddTo(list, *Request::descriptor());
  session->OnCommand(list, [=] {
    Request asked = request;
    if (absl::Status set = filters->SetOn(&asked); !set.ok()) return set;
    return ListAndPrint<Service>(session, area, method, std::move(asked), filters->limit(), table, entries, row);
  });
}

}  // namespace sixpoint::cli
