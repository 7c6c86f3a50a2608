// `sixpoint values`: just the values of inspections, as a table, CSV or JSON.
#include <iostream>
#include <utility>

#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/reports.h"
#include "refusal/message_text.h"
#include "services/runtime/errors.h"
#include "sixpoint/inspection/v1/value.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::ListValuesRequest;
using inspection::v1::ListValuesResponse;
using inspection::v1::Value;
using inspection::v1::ValueService;

struct ValuesArguments {
  std::string blade, prefix, characteristic, part, machine, calibration, since, until, verdict;
  bool newest = false, csv = false;
  int limit = 0;
};

const std::vector<std::string>& Verdicts() {
  static const auto* const verdicts =
      new std::vector<std::string>{"conform", "not-conform", "undecidable", "not-measured"};
  return *verdicts;
}

absl::StatusOr<ListValuesRequest> RequestOf(const ValuesArguments& arguments) {
  ListValuesRequest request;
  const auto name = [](const char* collection, const std::string& id) {
    return id.empty() ? id : NameText(collection, id);
  };
  request.set_blade(name("blades", arguments.blade));
  request.set_serial_prefix(arguments.prefix);
  request.set_characteristic(arguments.characteristic);
  request.set_part(name("parts", arguments.part));
  request.set_machine(name("machines", arguments.machine));
  if (!arguments.calibration.empty()) request.set_calibration(CalibrationNameText(arguments.calibration));
  const auto recorded = TimeRangeOf(arguments.since, arguments.until);
  if (!recorded.ok()) return recorded.status();
  if (recorded->has_from() || recorded->has_until()) *request.mutable_recorded() = *recorded;
  for (std::size_t i = 0; i < Verdicts().size(); ++i)
    if (Verdicts()[i] == arguments.verdict) request.set_verdict(static_cast<inspection::v1::Verdict>(i + 1));
  request.set_only_newest(arguments.newest);
  request.set_page_size(1000);
  return request;
}

// number: how one is written, in a CSV with every digit that it has; nothing is where it was not measured.
std::vector<std::string> CellsOf(const Value& value, std::string (*number)(double)) {
  return {IdText(value.blade()),
          value.characteristic(),
          value.unit(),
          value.has_value() ? number(value.value()) : "",
          number(value.nominal()),
          value.has_lower_limit() ? number(value.lower_limit()) : "",
          number(value.upper_limit()),
          value.has_expanded_uncertainty() ? number(value.expanded_uncertainty()) : "",
          VerdictName(value.verdict()),
          MethodText(value.method()),
          TimeText(value.recorded_at()),
          IdText(value.machine()),
          IdText(value.part()),
          IdText(value.inspection())};
}

const std::vector<std::string>& Headers() {
  static const auto* const headers = new std::vector<std::string>{
      "blade", "characteristic", "unit",          "value",    "nominal", "lower_limit", "upper_limit",
      "u95",   "verdict",        "positioned_by", "recorded", "machine", "part",        "inspection"};
  return *headers;
}

void PrintCsv(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) std::cout << (i > 0 ? "," : "") << CsvCell(cells[i]);
  std::cout << "\r\n";
}

// Every page as it comes; a call that breaks off goes on behind the last page that came.
absl::Status Stream(Session* session, const ListValuesRequest& wanted, const std::function<void(const Value&)>& take) {
  inspection::v1::DownloadValuesRequest request;
  *request.mutable_values() = wanted;
  bool has_last = false;
  return session->Retrying(
      "inspection", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
        const auto stub = ValueService::NewStub(channel);
        const auto reader = stub->DownloadValues(context.get(), request);
        ListValuesResponse page;
        while (reader->Read(&page)) {
          for (const Value& value : page.values()) take(value);
          has_last = page.next_page_token().empty();
          if (!has_last) request.mutable_values()->set_page_token(page.next_page_token());
        }
        const absl::Status ended = runtime::FromGrpc(reader->Finish());
        // Behind the last page nothing is missing; asked again, it would be printed twice.
        return has_last ? absl::OkStatus() : ended;
      });
}

}  // namespace

void AddValuesCommand(Command* app, Session* session) {
  const auto arguments = std::make_shared<ValuesArguments>();
  Command* command = app->AddCommand("values", "Just the values of inspections, the newest first");
  command->AddOption("--blade", &arguments->blade, "Only of this blade: its serial number");
  command->AddOption("--prefix", &arguments->prefix, "Only of serial numbers that begin so");
  command->AddOption("--characteristic", &arguments->characteristic,
                     "Only GROUP/HOLE/position, GROUP/HOLE/inclination, or GROUP/HOLE");
  command->AddOption("--part", &arguments->part, "Only of blades of this part");
  command->AddOption("--machine", &arguments->machine, "Only of those scanned on it");
  command->AddOption("--calibration", &arguments->calibration, "Only of inspections that rest on it, of whatever kind");
  AddSpanOptions(command, &arguments->since, &arguments->until);
  command->AddOption("--verdict", &arguments->verdict, "Only of inspections with this verdict")->OneOf(Verdicts());
  command->AddFlag("--newest", &arguments->newest, "Of each blade the newest inspection alone");
  command->AddFlag("--csv", &arguments->csv, "As CSV, every value as it comes");
  AddLimitOption(command, &arguments->limit);
  session->OnCommand(command, [session, arguments]() -> absl::Status {
    const absl::StatusOr<ListValuesRequest> request = RequestOf(*arguments);
    if (!request.ok()) return request.status();
    if (arguments->csv && arguments->limit == 0) {
      PrintCsv(Headers());
      return Stream(session, *request, [](const Value& value) { PrintCsv(CellsOf(value, NumberText)); });
    }
    if (arguments->csv) return runtime::Refuse("--limit", std::to_string(arguments->limit), "none with --csv");
    Table table({"blade", "characteristic", "unit", ">value", ">nominal", ">lower_limit", ">upper_limit", ">u95",
                 "verdict", "positioned_by", "recorded", "machine", "part", "inspection"});
    return ListAndPrint<ValueService>(
        session, "inspection", &ValueService::Stub::ListValues, *request, arguments->limit, std::move(table),
        &ListValuesResponse::values, [](const Value& value) { return CellsOf(value, Significant); }, "no values\n");
  });
}

}  // namespace sixpoint::cli
