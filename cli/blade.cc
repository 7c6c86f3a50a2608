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

std::string OrderText(const std::string& work_order, const std::string& operation) {
  return operation.empty() ? work_order : work_order + " " + operation;
}

std::string BladeText(const plant::v1::Blade& blade) {
  const std::string order = OrderText(blade.work_order(), blade.operation());
  return blade.name() + " of " + blade.part() + ", since " + TimeText(blade.created_at()) +
         (order.empty() ? "" : ", for work order " + order) + "\n";
}

std::string RecordText(const plant::v1::BladeRecord& record) {
  Table table({">sequence", "recorded", "kind", "name", "method", "work order", ">inputs", "summary"});
  for (const plant::v1::RecordEntry& entry : record.entries()) {
    table.AddRow({std::to_string(entry.record_sequence()), TimeText(entry.recorded_at()), entry.kind(), entry.name(),
                  entry.method(), OrderText(entry.work_order(), entry.operation()), std::to_string(entry.inputs_size()),
                  SummaryText(MessageToJson(entry.summary()))});
  }
  return BladeText(record.blade()) + (table.empty() ? "nothing recorded of that\n" : table.ToText());
}

}  // namespace

void AddBladeCommands(Command* app, Session* session) {
  Command* blade = app->AddCommand("blade", "Blades and their whole record");
  blade->RequireCommand();
  const auto serial = std::make_shared<std::string>();
  const auto part = std::make_shared<std::string>();
  const auto work_order = std::make_shared<std::string>();
  const auto operation = std::make_shared<std::string>();
  const auto kinds = std::make_shared<std::vector<std::string>>();
  const auto since = std::make_shared<std::string>();
  const auto until = std::make_shared<std::string>();

  Command* add = blade->AddCommand("add", "Adds a blade of a part");
  add->AddOption("SERIAL", serial.get(), "Serial number")->Required();
  add->AddOption("--part", part.get(), "The part that it is one of")->Required();
  add->AddOption("--work-order", work_order.get(), "The MES's work order that it is worked on for");
  add->AddOption("--operation", operation.get(), "Of the work order");
  session->OnCommand(add, [session, serial, part, work_order, operation]() -> absl::Status {
    plant::v1::CreateBladeRequest request;
    request.set_serial(*serial);
    request.set_part(NameText("parts", *part));
    request.set_work_order(*work_order);
    request.set_operation(*operation);
    request.set_request_id(NewRequestId());
    return CallAndPrint<PlantService>(session, "plant", &PlantService::Stub::CreateBlade, request, BladeText).status();
  });

  Command* assign = blade->AddCommand("assign", "Says for which work order a blade is worked on from now on");
  assign->AddOption("SERIAL", serial.get(), "Serial number")->Required();
  assign->AddOption("--work-order", work_order.get(), "As the MES calls it")->Required();
  assign->AddOption("--operation", operation.get(), "Of the work order");
  session->OnCommand(assign, [session, serial, work_order, operation]() -> absl::Status {
    plant::v1::AssignWorkOrderRequest request;
    request.set_blade(NameText("blades", *serial));
    request.set_work_order(*work_order);
    request.set_operation(*operation);
    request.set_request_id(NewRequestId());
    return CallAndPrint<PlantService>(session, "plant", &PlantService::Stub::AssignWorkOrder, request, BladeText)
        .status();
  });

  AddListCommand<PlantService>(blade, session, "Lists the blades", "plant", &PlantService::Stub::ListBlades,
                               plant::v1::ListBladesRequest(), Table({"blade", "part", "work order", "since"}),
                               &plant::v1::ListBladesResponse::blades, [](const plant::v1::Blade& entry) {
                                 return Cells{IdText(entry.name()), IdText(entry.part()),
                                              OrderText(entry.work_order(), entry.operation()),
                                              TimeText(entry.created_at())};
                               });

  Command* show = blade->AddCommand("show", "Shows everything that happened to a blade");
  show->AddOption("SERIAL", serial.get(), "Serial number")->Required();
  AddKindsOption(show, kinds.get());
  AddSpanOptions(show, since.get(), until.get());
  session->OnCommand(show, [session, serial, kinds, since, until]() -> absl::Status {
    const absl::StatusOr<list::v1::TimeRange> recorded = TimeRangeOf(*since, *until);
    if (!recorded.ok()) return recorded.status();
    plant::v1::GetBladeRecordRequest request;
    request.set_name(NameText("blades", *serial));
    request.mutable_kinds()->Add(kinds->begin(), kinds->end());
    if (recorded->has_from() || recorded->has_until()) *request.mutable_recorded() = *recorded;
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
