// `sixpoint call SERVICE/METHOD JSON`: any method of the public contracts, by the descriptors that are built in.
#include "services/runtime/call.h"

#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <iostream>

#include "cli/commands.h"
#include "cli/output.h"
#include "services/runtime/errors.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/correction/v1/machining_pass.grpc.pb.h"
#include "sixpoint/correction/v1/reconstruction.grpc.pb.h"
#include "sixpoint/correction/v1/repair.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"
#include "sixpoint/inspection/v1/assessment.grpc.pb.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"
#include "sixpoint/inspection/v1/disposition.grpc.pb.h"
#include "sixpoint/inspection/v1/efficacy.grpc.pb.h"
#include "sixpoint/inspection/v1/export.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/inspection/v1/measurement.grpc.pb.h"
#include "sixpoint/inspection/v1/report.grpc.pb.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"
#include "sixpoint/inspection/v1/value.grpc.pb.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "sixpoint/plant/v1/event.grpc.pb.h"
#include "sixpoint/plant/v1/fleet.grpc.pb.h"
#include "sixpoint/plant/v1/ledger.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "sixpoint/plant/v1/webhook.grpc.pb.h"
#include "sixpoint/registration/v1/measuring_plan.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using google::protobuf::Message;

// "PlantService/GetMachine" or "sixpoint.plant.v1.PlantService/GetMachine"; `area` becomes "plant".
absl::StatusOr<const google::protobuf::MethodDescriptor*> FindMethod(const std::string& text, std::string* area) {
  const std::size_t slash = text.find('/');
  const std::string service_name = text.substr(0, slash);
  std::string known;
  for (const auto& [name, full_name] : std::vector<std::pair<std::string, std::string>>{
           {"plant", plant::v1::PlantService::service_full_name()},
           {"plant", plant::v1::DrawingService::service_full_name()},
           {"plant", plant::v1::RecordService::service_full_name()},
           {"plant", plant::v1::EventService::service_full_name()},
           {"plant", plant::v1::FleetService::service_full_name()},
           {"plant", plant::v1::LedgerService::service_full_name()},
           {"plant", plant::v1::WebhookService::service_full_name()},
           {"ingest", ingest::v1::ScanService::service_full_name()},
           {"ingest", ingest::v1::CloudStoreService::service_full_name()},
           {"calibration", calibration::v1::CalibrationService::service_full_name()},
           {"calibration", calibration::v1::StudyService::service_full_name()},
           {"registration", registration::v1::RegistrationService::service_full_name()},
           {"registration", registration::v1::MeasuringPlanService::service_full_name()},
           {"correction", correction::v1::CorrectionService::service_full_name()},
           {"correction", correction::v1::ReconstructionService::service_full_name()},
           {"correction", correction::v1::MachiningPassService::service_full_name()},
           {"correction", correction::v1::RepairService::service_full_name()},
           {"inspection", inspection::v1::InspectionService::service_full_name()},
           {"inspection", inspection::v1::DeviationService::service_full_name()},
           {"inspection", inspection::v1::AssessmentService::service_full_name()},
           {"inspection", inspection::v1::SectionService::service_full_name()},
           {"inspection", inspection::v1::MeasurementService::service_full_name()},
           {"inspection", inspection::v1::ExportService::service_full_name()},
           {"inspection", inspection::v1::ReportService::service_full_name()},
           {"inspection", inspection::v1::DispositionService::service_full_name()},
           {"inspection", inspection::v1::EfficacyService::service_full_name()},
           {"inspection", inspection::v1::ValueService::service_full_name()}}) {
    const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(full_name);
    if (service == nullptr) return absl::InternalError(full_name + ": not built in");
    if (service_name != service->name() && service_name != service->full_name()) {
      known += (known.empty() ? "" : ", ") + service->name();
      continue;
    }
    known.clear();
    for (int i = 0; i < service->method_count(); ++i) known += (i == 0 ? "" : ", ") + service->method(i)->name();
    *area = name;
    const auto* method = slash == std::string::npos ? nullptr : service->FindMethodByName(text.substr(slash + 1));
    if (method == nullptr) return runtime::Refuse("METHOD", text, service->name() + "/ one of " + known);
    if (method->client_streaming()) return runtime::Refuse("METHOD", text, "a method whose request is one message");
    return method;
  }
  return runtime::Refuse("METHOD", text, "SERVICE/METHOD, SERVICE one of " + known);
}

absl::StatusOr<std::unique_ptr<Message>> RequestFromJson(const google::protobuf::Descriptor* type,
                                                         const std::string& json) {
  std::unique_ptr<Message> request(google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
  const auto parsed = google::protobuf::util::JsonStringToMessage(json, request.get());
  if (!parsed.ok()) return runtime::Refuse("JSON", json, type->full_name() + ": " + std::string(parsed.message()));
  return request;
}

absl::Status Call(Session* session, const std::string& method_text, const std::string& json) {
  std::string area;
  auto method = FindMethod(method_text, &area);
  if (!method.ok()) return method.status();
  auto request = RequestFromJson((*method)->input_type(), json);
  if (!request.ok()) return request.status();
  auto channel = session->ChannelTo(area);
  if (!channel.ok()) return channel.status();

  grpc::ByteBuffer request_bytes;
  const std::string serialised = (*request)->SerializeAsString();
  const grpc::Slice slice(serialised);
  request_bytes = grpc::ByteBuffer(&slice, 1);
  const auto context = runtime::ContextFor(session->deadline_s);
  grpc::GenericStub stub(*channel);
  grpc::CompletionQueue queue;
  const auto stream =
      stub.PrepareCall(context.get(), "/" + (*method)->service()->full_name() + "/" + (*method)->name(), &queue);
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  stream->StartCall(nullptr);
  if (wait()) {
    stream->WriteLast(request_bytes, grpc::WriteOptions(), nullptr);
    wait();
    // One response, or as many as the server streams: one JSON value after the other.
    while (true) {
      grpc::ByteBuffer response_bytes;
      stream->Read(&response_bytes, nullptr);
      if (!wait()) break;
      std::unique_ptr<Message> response(
          google::protobuf::MessageFactory::generated_factory()->GetPrototype((*method)->output_type())->New());
      grpc::ProtoBufferReader reader(&response_bytes);
      if (!response->ParseFromZeroCopyStream(&reader)) return absl::DataLossError("an answer that cannot be read");
      PrintJson(*response);
    }
  }
  grpc::Status finished;
  stream->Finish(&finished, nullptr);
  wait();
  return runtime::FromGrpc(finished);
}

}  // namespace

void AddCallCommand(Command* app, Session* session) {
  const auto method = std::make_shared<std::string>();
  const auto json = std::make_shared<std::string>("{}");
  Command* command =
      app->AddCommand("call", "Calls any method: sixpoint call PlantService/GetMachine '{\"name\": \"machines/m\"}'");
  command->AddOption("METHOD", method.get(), "SERVICE/METHOD")->Required();
  command->AddOption("JSON", json.get(), "The request");
  session->OnCommand(command, [session, method, json] { return Call(session, *method, *json); });
}

}  // namespace sixpoint::cli
