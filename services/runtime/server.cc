#include "services/runtime/server.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <pthread.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <thread>

#include "services/runtime/call_log.h"
#include "services/runtime/log.h"

namespace sixpoint::runtime {
namespace {

using std::chrono::system_clock;

constexpr std::chrono::milliseconds kDrain{10'000};
constexpr std::chrono::milliseconds kDrainIdle{300};
constexpr std::chrono::seconds kDatabasePatience{2};
// How often the database is asked: at once until it is there, then at leisure.
constexpr long kPollStarting_ms = 200;
constexpr long kPollServing_ms = 1000;
constexpr int kMostThreads = 256;
constexpr size_t kQuotaPerMessage = 64;

enum class Readiness { kReady, kBusy, kNotReady };

// Without these limits one connection that resets its streams takes gigabytes (CVE-2023-44487; gRPC 1.51 measured).
void SetLimits(const ServerOptions& options, grpc::ServerBuilder* builder) {
  const int message_bytes = options.max_message_mb << 20;
  grpc::ResourceQuota quota("sixpoint-" + options.area);
  quota.Resize(kQuotaPerMessage * static_cast<size_t>(message_bytes));
  quota.SetMaxThreads(kMostThreads);
  builder->SetResourceQuota(quota);
  builder->SetMaxReceiveMessageSize(message_bytes);
  // gRPC inflates a message before it looks at its size: 260 KB of it took 300 MB. Refused with UNIMPLEMENTED.
  for (const grpc_compression_algorithm inflated : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP})
    builder->SetCompressionAlgorithmSupportStatus(inflated, false);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 100);
  builder->AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8192);
  // Our clients ping every 30 s; a stricter server would answer GOAWAY.
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 15'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // A machine that was switched off does not hold its call for ever.
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, 30 * 60'000);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, 10 * 60'000);
  // Two servers on one port would share its calls without a word.
  builder->AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
}

std::vector<std::string> ServiceNamesOf(const std::string& area) {
  std::vector<std::string> names;
  const auto* file =
      google::protobuf::DescriptorPool::generated_pool()->FindFileByName("sixpoint/" + area + "/v1/" + area + ".proto");
  for (int i = 0; file != nullptr && i < file->service_count(); ++i) names.push_back(file->service(i)->full_name());
  return names;
}

Readiness AskDatabase(const ServerOptions& options, storage::Database* database, std::string* why_not) {
  const absl::StatusOr<int> version = database->SchemaVersion(system_clock::now() + kDatabasePatience);
  if (!version.ok()) {
    *why_not = std::string(version.status().message());
    return version.status().code() == absl::StatusCode::kResourceExhausted ? Readiness::kBusy : Readiness::kNotReady;
  }
  if (*version < NewestMigration()) {
    *why_not = "schema version: " + std::to_string(*version) + ", want " + std::to_string(NewestMigration());
    return Readiness::kNotReady;
  }
  const absl::Status least = database->RequireLeastRights(system_clock::now() + kDatabasePatience);
  if (!least.ok()) {
    *why_not = std::string(least.message());
    return absl::IsResourceExhausted(least) ? Readiness::kBusy : Readiness::kNotReady;
  }
  const absl::Status durable = database->RequireDurable(system_clock::now() + kDatabasePatience);
  if (durable.ok()) return Readiness::kReady;
  *why_not = std::string(durable.message());
  if (options.volatile_database && absl::IsFailedPrecondition(durable)) return Readiness::kReady;
  return absl::IsResourceExhausted(durable) ? Readiness::kBusy : Readiness::kNotReady;
}

// How long running calls get. Without calls only idle connections are left, whose clients may take 5 s to say good-bye.
std::chrono::milliseconds DrainTime() {
  constexpr std::chrono::milliseconds kStep{10};
  for (int i = 0; i < 20 && CallsInFlight() > 0; ++i) std::this_thread::sleep_for(kStep);  // most calls are short
  return CallsInFlight() > 0 ? kDrain : kDrainIdle;
}

// True when a signal to stop came within that time.
bool WaitForStop(const sigset_t& signals, long milliseconds) {
  const timespec patience{milliseconds / 1000, milliseconds % 1000 * 1'000'000};
  return sigtimedwait(&signals, nullptr, &patience) > 0;
}

// Keeps health in step with the database until a signal comes.
void ServeUntilStopped(const ServerOptions& options, grpc::Server* server, storage::Database* database,
                       const std::vector<std::string>& names, const sigset_t& signals) {
  bool serving = false;
  std::string said;
  do {
    std::string why_not;
    const Readiness readiness = AskDatabase(options, database, &why_not);
    if (readiness == Readiness::kBusy) continue;  // full is not broken: as before
    if (!why_not.empty() && why_not != said)
      Log(LogLevel::kWarning, (readiness == Readiness::kReady ? "served all the same: " : "not ready: ") + why_not);
    said = why_not;
    if (serving == (readiness == Readiness::kReady)) continue;
    serving = !serving;
    for (const std::string& name : names) server->GetHealthCheckService()->SetServingStatus(name, serving);
    Log(LogLevel::kInfo, serving ? "serving" : "not serving");
  } while (!WaitForStop(signals, serving ? kPollServing_ms : kPollStarting_ms));
}

}  // namespace

int Serve(const ServerOptions& options, const ServiceFactory& factory) {
  // Blocked before any thread starts, so that only this one takes them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a worker or client that is gone is an error code, not our end
  StartLog(options.area);

  const std::unique_ptr<storage::Database> database =
      storage::Database::Open(options.database, options.database_connections);
  const std::vector<std::unique_ptr<grpc::Service>> services = factory(options, database.get());

  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  SetLimits(options, &builder);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CallLogFactory>());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  builder.AddListeningPort(options.listen_address, grpc::InsecureServerCredentials());
  for (const std::unique_ptr<grpc::Service>& service : services) builder.RegisterService(service.get());
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (server == nullptr) {
    Log(LogLevel::kError, "cannot listen", {{"address", options.listen_address}});
    return 1;
  }
  std::vector<std::string> names = ServiceNamesOf(options.area);
  names.emplace_back();  // the server as a whole
  for (const std::string& name : names) server->GetHealthCheckService()->SetServingStatus(name, false);
  Log(LogLevel::kInfo, "listening", {{"address", options.listen_address}});

  ServeUntilStopped(options, server.get(), database.get(), names, signals);

  server->GetHealthCheckService()->Shutdown();
  Log(LogLevel::kInfo, "stopping: running calls may end, new ones are refused");
  server->Shutdown(system_clock::now() + DrainTime());
  server->Wait();
  Log(LogLevel::kInfo, "stopped");
  return 0;
}

}  // namespace sixpoint::runtime
