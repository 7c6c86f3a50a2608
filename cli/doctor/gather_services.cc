#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpc/grpc_security_constants.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <future>
#include <map>

#include "cli/doctor/gather.h"
#include "cli/gateway_health.h"
#include "cli/identity_folder.h"
#include "cli/last_words.h"
#include "cli/service_health.h"
#include "refusal/message_text.h"
#include "services/runtime/call.h"
#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"
#include "services/runtime/server.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli::doctor {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds kPatience{3};

// A list of one entry: what every service answers and nothing is changed by.
std::string QuestionOf(const std::string& area) {
  static const auto* const questions = new std::map<std::string, std::string>{
      {"plant", "sixpoint.plant.v1.PlantService/ListParts"},
      {"ingest", "sixpoint.ingest.v1.ScanService/ListScans"},
      {"calibration", "sixpoint.calibration.v1.CalibrationService/ListCalibrations"},
      {"registration", "sixpoint.registration.v1.RegistrationService/ListRegistrations"},
      {"correction", "sixpoint.correction.v1.CorrectionService/ListCorrections"},
      {"inspection", "sixpoint.inspection.v1.InspectionService/ListInspections"}};
  const auto found = questions->find(area);
  return found == questions->end() ? "" : found->second;
}

grpc::ByteBuffer RequestOf(const std::string& method) {
  std::string name = method;
  std::replace(name.begin(), name.end(), '/', '.');
  std::string text;
  const auto* const known = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(name);
  if (known != nullptr) {
    const std::unique_ptr<google::protobuf::Message> request(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(known->input_type())->New());
    if (const auto* const size = known->input_type()->FindFieldByName("page_size"))
      request->GetReflection()->SetInt32(request.get(), size, 1);
    text = request->SerializeAsString();
  }
  const grpc::Slice slice(text);
  return grpc::ByteBuffer(&slice, 1);
}

std::string Trailing(const grpc::ClientContext& context, const char* name) {
  const auto found = context.GetServerTrailingMetadata().find(name);
  if (found == context.GetServerTrailingMetadata().end()) return "";
  return Tame(std::string(found->second.data(), found->second.size()), 100);
}

void ReadAnswer(const grpc::ClientContext& context, Time before, double took_s, Service* service) {
  if (const std::string version = Trailing(context, runtime::kServerVersion); !version.empty())
    service->version = version;
  const std::string time_us = Trailing(context, runtime::kServerTime_us);
  if (const long long us = std::strtoll(time_us.c_str(), nullptr, 10); us > 0) {
    service->clock_doubt_s = took_s / 2;
    service->clock_ahead_s =
        std::chrono::duration<double>(Time(std::chrono::microseconds(us)) - before).count() - took_s / 2;
  }
  const auto shown = context.auth_context();
  if (shown == nullptr) return;
  for (const grpc::string_ref& pem : shown->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME)) {
    const auto certificate = identity::CertificateOf(std::string(pem.data(), pem.size()));
    if (certificate.ok()) service->shown = *certificate;
  }
}

// All at once: six that are silent take no longer than one.
void AskAll(const std::shared_ptr<grpc::ChannelCredentials>& nobody,
            const std::shared_ptr<grpc::ChannelCredentials>& own, std::vector<Service>* services) {
  std::vector<std::future<void>> asked;
  for (Service& service : *services)
    asked.push_back(std::async(std::launch::async, [&] { AskService(nobody, own, &service); }));
  for (std::future<void>& each : asked) each.wait();
}

std::shared_ptr<grpc::ChannelCredentials> OwnCredentials(const Session& session) {
  const auto folder = IdentityFolder(session.identity, session.data);
  if (!folder.ok()) return nullptr;
  const auto own = runtime::ChannelCredentialsOf(*folder);
  return own.ok() ? *own : nullptr;
}

Facts NewFacts(const Session& session) {
  Facts facts;
  facts.now = std::chrono::system_clock::now();
  facts.own_version = runtime::SoftwareVersion();
  facts.newest_migration = runtime::NewestMigration();
  facts.data = session.data;
  facts.server = session.server;
  return facts;
}

}  // namespace

void AskService(const std::shared_ptr<grpc::ChannelCredentials>& nobody,
                const std::shared_ptr<grpc::ChannelCredentials>& own, Service* service) {
  if (service->area == kGateway) return;  // asked by HTTP
  service->health = nobody == nullptr ? "NOT_TRUSTED" : ServiceHealth(service->address, nobody, kPatience);
  const std::string method = QuestionOf(service->area);
  const bool answers = service->health == "SERVING" || service->health == "NOT_SERVING";
  if (!answers || own == nullptr || method.empty()) return;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::GenericStub stub(grpc::CreateCustomChannel(service->address, own, arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kPatience);
  grpc::CompletionQueue queue;
  grpc::ByteBuffer answer;
  grpc::Status status;
  const auto call = stub.PrepareUnaryCall(&context, "/" + method, RequestOf(method), &queue);
  const Time before = std::chrono::system_clock::now();
  const auto begin = steady_clock::now();
  call->StartCall();
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  const double took_s = std::chrono::duration<double>(steady_clock::now() - begin).count();
  const absl::Status said = runtime::FromGrpc(status);
  if (said.ok()) service->answer_s = took_s;
  if (runtime::HasReason(said, errors::v1::SERVICE_NOT_READY)) {
    const std::string begins = "the service is not ready: ", sentence(said.message());
    service->why = Tame(sentence.rfind(begins, 0) == 0 ? sentence.substr(begins.size()) : sentence, 300);
  } else if (!said.ok() && service->health == "SERVING") {
    service->refused = Tame(std::string(said.message()), 300);
  }
  ReadAnswer(context, before, took_s, service);
}

Facts GatherLocal(Session* session, const std::optional<LocalPlant>& plant) {
  Facts facts = NewFacts(*session);
  facts.is_local = true;
  if (!plant) {
    facts.host = GatherHost(plant);
    return facts;
  }
  facts.data = plant->data.string();
  facts.blobs_in_object_store = plant->settings.blob_store != PlantSettings().blob_store;
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    Service service;
    service.area = kAreas[i];
    service.address = plant->OwnAddress(i);
    service.port = plant->settings.base_port + static_cast<int>(i);
    facts.services.push_back(std::move(service));
  }
  if (plant->HasGateway()) {
    Service gateway;
    gateway.area = kGateway;
    gateway.address = plant->OwnGatewayUrl();
    gateway.port = plant->settings.HttpPort();
    gateway.health = GatewayHealth(gateway.address, plant->certificates(), kPatience);
    facts.services.push_back(std::move(gateway));
  }
  auto database = std::async(std::launch::async, [&] { return GatherDatabase(*plant); });
  auto restarts =
      std::async(std::launch::async, [&] { return GatherRestarts(*plant, facts.now - std::chrono::hours(24)); });
  const auto nobody = runtime::ChannelCredentialsOf(plant->certificates());
  AskAll(nobody.ok() ? *nobody : nullptr, OwnCredentials(*session), &facts.services);
  GatherProcesses(*plant, &facts);
  for (Service& service : facts.services)
    if (service.why.empty() && service.health != "SERVING")
      service.why = LastWords(plant->logs() / (service.area + ".log"));
  facts.certificates = GatherCertificates(*plant, &facts.revocation_why_not);
  facts.host = GatherHost(plant);
  facts.database = database.get();
  facts.restarts = restarts.get();
  return facts;
}

Facts GatherRemote(Session* session) {
  Facts facts = NewFacts(*session);
  facts.host = GatherHost(std::nullopt);
  const auto own = OwnCredentials(*session);
  session->deadline_s = std::min(session->deadline_s, 5.0);
  plant::v1::ListEndpointsResponse endpoints;
  const absl::Status listed = session->Call<plant::v1::PlantService>(
      "plant", &plant::v1::PlantService::Stub::ListEndpoints, plant::v1::ListEndpointsRequest(), &endpoints);
  Service plant;
  plant.area = "plant";
  plant.address = session->server;
  facts.services.push_back(plant);
  if (!listed.ok()) facts.services_why_not = Tame(std::string(listed.message()), 300);
  for (const auto& endpoint : endpoints.endpoints()) {
    if (endpoint.area() == "plant") continue;
    Service service;
    service.area = Tame(endpoint.area(), 40);
    service.address = endpoint.address();
    facts.services.push_back(std::move(service));
  }
  AskAll(own, own, &facts.services);
  if (listed.ok()) facts.store = AskStore(session);
  return facts;
}

}  // namespace sixpoint::cli::doctor
