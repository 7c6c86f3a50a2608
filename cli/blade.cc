#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/message_json.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/table.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::PlantService;
using plant::v1::RecordService;

// {"residual_rms_um": 2.0123456, "outcome": "CONVERGED"} -> "outcome CONVERGED, residual_rms_um 2.012".
std::string SummaryText(const nlohmann::json& summary) {
  std::string text;
  for (const auto& [key, value] : summary.items()) {
    std::string shown = value.is_string() ? value.get<std::string>() : value.dump();
    if (value.is_number_float()) {
      const double number = value.get<double>();
      shown = std::abs(number) < 1e15 && number == std::floor(number) ? Grouped(static_cast<std::int64_t>(number))
                                                                      : Fixed(number, 3);
    }
    if (value.is_object()) shown = "(" + SummaryText(value) + ")";
    text += (text.empty() ? "" : ", ") + key + " " + shown;
  }
  return text;
}

std::string BladeText(const plant::v1::Blade& blade) {
  return blade.name() + " of " + blade.part() + ", since " + TimeText(blade.created_at()) + "\n";
}

std::string RecordText(const plant::v1::BladeRecord& record) {
  Table table({">sequence", "recorded", "kind", "name", "method", ">inputs", "summary"});
  for (const plant::v1::RecordEntry& entry : record.entries()) {
    table.AddRow({std::to_string(entry.record_sequence()), TimeText(entry.recorded_at()), entry.kind(), entry.name(),
                  entry.method(), std::to_string(entry.inputs_size()), SummaryText(MessageToJson(entry.summary()))});
  }
  return BladeText(record.blade()) + (table.empty() ? "nothing recorded yet\n" : table.ToText());
}

}  // namespace

void AddBladeCommands(Command* app, Session* session) {
  Command* blade = app->AddCommand("blade", "Blades and their whole record");
  blade->RequireCommand();
  const auto serial = std::make_shared<std::string>();
  const auto part = std::make_shared<std::string>();

  Command* add = blade->AddCommand("add", "Adds a blade of a part");
  add->AddOption("SERIAL", serial.get(), "Serial number")->Required();
  add->AddOption("--part", part.get(), "The part that it is one of")->Required();
  session->OnCommand(add, [session, serial, part]() -> absl::Status {
    plant::v1::CreateBladeRequest request;
    request.set_serial(*serial);
    request.set_part(NameText("parts", *part));
    request.set_request_id(NewRequestId());
    return CallAndPrint<PlantService>(session, "plant", &PlantService::Stub::CreateBlade, request, BladeText).status();
  });

  AddListCommand<PlantService>(blade, session, "Lists the blades", "plant", &PlantService::Stub::ListBlades,
                               plant::v1::ListBladesRequest(), Table({"blade", "part", "since"}),
                               &plant::v1::ListBladesResponse::blades, [](const plant::v1::Blade& entry) {
                                 return Cells{IdText(entry.name()), IdText(entry.part()), TimeText(entry.created_at())};
                               });

  Command* show = blade->AddCommand("show", "Shows everything that happened to a blade");
  show->AddOption("SERIAL", serial.get(), "Serial number")->Required();
  session->OnCommand(show, [session, serial]() -> absl::Status {
    plant::v1::GetBladeRecordRequest request;
    request.set_name(NameText("blades", *serial));
    plant::v1::BladeRecord record;
    absl::Status status =
        ForEachPage<RecordService>(session, "plant", &RecordService::Stub::GetBladeRecord, request,
                                   [&](const plant::v1::BladeRecord& page) { record.MergeFrom(page); });
    if (!status.ok()) return status;
    record.clear_next_page_token();
    PrintMessage(session->json, record, [&] { return RecordText(record); });
    return status;
  });
}

}  // namespace sixpoint::cli
