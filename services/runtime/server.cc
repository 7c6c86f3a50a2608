#include "services/runtime/server.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/health_check_service_interface.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>
#include <thread>

#include "identity/credentials.h"
#include "services/runtime/admission.h"
#include "services/runtime/call_gate.h"
#include "services/runtime/call_log.h"
#include "services/runtime/connection_acceptor.h"
#include "services/runtime/credentials.h"
#include "services/runtime/denials.h"
#include "services/runtime/flood_watch.h"
#include "services/runtime/frame_watch.h"
#include "services/runtime/listening_sockets.h"
#include "services/runtime/log.h"
#include "services/runtime/message_limits.h"
#include "services/runtime/observation.h"
#include "services/runtime/session_ends.h"
#include "services/runtime/write_watch.h"
#include "storage/clearances.h"
#include "storage/denials.h"
#include "storage/record.h"

namespace sixpoint::runtime {
namespace {

using std::chrono::system_clock;

constexpr std::chrono::milliseconds kDrain{10'000};
constexpr std::chrono::milliseconds kDrainIdle{300};
constexpr std::chrono::seconds kDatabasePatience{2};
// How often the database is asked: at once until it is there, then at leisure.
constexpr long kPollStarting_ms = 200;
constexpr long kPollServing_ms = 1000;
// Ingest's 64 uploads and 128 that wait for their place, the calls of CallLimits, and some.
constexpr int kMostThreads = 320;
constexpr size_t kQuotaPerMessage = 64;
constexpr int kMostReadAtOnce_bytes = 256 * 1024;
// How soon a call ends whose certificate does not count any more.
constexpr std::chrono::milliseconds kBetweenJudgements{500};

enum class Readiness { kReady, kBusy, kNotReady };

int GreatestMessage_bytes(const std::vector<ServedService>& services) {
  std::size_t greatest_bytes = 0;
  for (const ServedService& each : services) {
    const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(each.full_name);
    for (int i = 0; i < service->method_count(); ++i)
      greatest_bytes = std::max(greatest_bytes, GreatestRequest_bytes(*service->method(i)));
  }
  return static_cast<int>(greatest_bytes);
}

// gRPC reads a connection in pieces of 64 KB and asks for twice as many each time as long as there is more to read, without end:
// four connections that were never read empty took 700 MB. Its older way of reading, in one piece, knows a greatest one. To be said
// before gRPC begins anything, and only so.
void BoundReads() { setenv("GRPC_EXPERIMENTS", "-tcp_read_chunks", /*overwrite=*/1); }

void SetLimits(const ServerOptions& options, int message_bytes, grpc::ServerBuilder* builder) {
  grpc::ResourceQuota quota("sixpoint-" + options.area);
  quota.Resize(kQuotaPerMessage * static_cast<size_t>(message_bytes));
  quota.SetMaxThreads(kMostThreads);
  builder->SetResourceQuota(quota);
  // gRPC begins and ends a thread with nearly every call unless some wait: at least, and at most, of each queue.
  builder->SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MIN_POLLERS, 2);
  builder->SetSyncServerOption(grpc::ServerBuilder::SyncServerOption::MAX_POLLERS, 8);
  builder->SetMaxReceiveMessageSize(message_bytes);
  // gRPC inflates a message before it looks at its size: 260 KB of it took 300 MB. Refused with UNIMPLEMENTED.
  for (const grpc_compression_algorithm inflated : {GRPC_COMPRESS_DEFLATE, GRPC_COMPRESS_GZIP})
    builder->SetCompressionAlgorithmSupportStatus(inflated, false);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, CallLimits{}.per_connection);
  builder->AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 8192);
  // Pings are answered, however many: who counts them (GOAWAY, too_many_pings) takes 7 KB for each one that has come by then, 270 MB
  // in a flood of four connections. Of answers that nobody reads gRPC keeps 10,000, and then reads no more.
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 0);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // A machine that was switched off does not hold its call for ever.
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder->AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, 30 * 60'000);
  builder->AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, 10 * 60'000);
  builder->AddChannelArgument(GRPC_ARG_ENABLE_CHANNELZ, 1);                              // what FloodWatch looks at
  builder->AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kMostReadAtOnce_bytes);  // see BoundReads
  // Who connects and says nothing holds its place no longer than this.
  builder->AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 20'000);
}

// Asks little where nothing has changed: the schema's version each time; what we may and what the database keeps, which is asked
// of its catalogues, after a failure, another version or a minute.
class ReadinessQuestion {
 public:
  ReadinessQuestion(storage::Database* database, bool volatile_database)
      : database_(database), volatile_database_(volatile_database) {}

  Readiness Ask(std::string* why_not) {
    const absl::StatusOr<int> version = database_->SchemaVersion(std::chrono::steady_clock::now() + kDatabasePatience);
    if (!version.ok()) return NotReady(version.status(), why_not);
    if (*version < NewestMigration()) {
      return NotReady(absl::FailedPreconditionError("schema version: " + std::to_string(*version) + ", want " +
                                                    std::to_string(NewestMigration())),
                      why_not);
    }
    const auto now = std::chrono::steady_clock::now();
    if (version_ == *version && now < asked_all_ + kBetweenAll) {
      *why_not = said_;
      return Readiness::kReady;
    }
    const absl::Status least = database_->RequireLeastRights(std::chrono::steady_clock::now() + kDatabasePatience);
    if (!least.ok()) return NotReady(least, why_not);
    const absl::Status durable = database_->RequireDurable(std::chrono::steady_clock::now() + kDatabasePatience);
    if (!durable.ok() && !(volatile_database_ && absl::IsFailedPrecondition(durable)))
      return NotReady(durable, why_not);
    *why_not = said_ = std::string(durable.message());
    version_ = *version;
    asked_all_ = now;
    return Readiness::kReady;
  }

 private:
  Readiness NotReady(const absl::Status& status, std::string* why_not) {
    version_.reset();
    *why_not = std::string(status.message());
    return absl::IsResourceExhausted(status) ? Readiness::kBusy : Readiness::kNotReady;
  }

  static constexpr std::chrono::minutes kBetweenAll{1};
  storage::Database* const database_;
  const bool volatile_database_;
  std::optional<int> version_;
  std::string said_;  // of a database that is served all the same
  std::chrono::steady_clock::time_point asked_all_;
};

// The journal knows of which machine a thing is.
Access::MachineOf MachineBy(storage::Database* database) {
  return [database](const std::string& name,
                    std::chrono::steady_clock::time_point deadline) -> absl::StatusOr<std::optional<std::string>> {
    absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    const auto entry = storage::FindEntry(*transaction, name);
    if (!entry.ok()) return entry.status();
    if (!entry->has_value()) return std::nullopt;
    return (*entry)->entry.machine.value_or("");
  };
}

absl::Status WriteDenials(storage::Database* database, const std::vector<storage::Denial>& denials) {
  absl::StatusOr<storage::Transaction> transaction =
      database->Begin(std::chrono::steady_clock::now() + kDatabasePatience);
  if (!transaction.ok()) return transaction.status();
  if (absl::Status status = storage::AppendDenials(*transaction, denials); !status.ok()) return status;
  return transaction->Commit();
}

void KeepDenials(storage::Database* database, Denials* denials) {
  const std::vector<storage::Denial> taken = denials->Take();
  if (taken.empty()) return;
  const absl::Status written = WriteDenials(database, taken);
  if (written.ok()) return;
  // What the database would never take is not tried for ever.
  const bool may_be_taken = !absl::IsInvalidArgument(written) && !absl::IsFailedPrecondition(written);
  if (may_be_taken) denials->PutBack(taken);
  Log(LogLevel::kWarning, std::string(may_be_taken ? "denials are not written yet: " : "denials are lost: ") +
                              std::string(written.message()));
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

// To stop: before any thread starts, so that only this one takes them.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a worker or client that is gone is an error code, not our end
  return signals;
}

// gRPC's server, not serving yet, with each service behind admission. Connections come by `taker`.
struct Built {
  std::vector<std::unique_ptr<grpc::Service>> admitted;
  std::vector<std::string> names = {""};  // of health: the server as a whole, and each service
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> taker;
  std::unique_ptr<grpc::Server> server;  // none: it does not start
};

Built Build(const ServerOptions& options, const std::vector<ServedService>& services,
            const std::shared_ptr<grpc::ServerCredentials>& credentials, Admission* admission, Denials* denials) {
  Built built;
  grpc::EnableDefaultHealthCheckService(true);
  grpc::ServerBuilder builder;
  SetLimits(options, GreatestMessage_bytes(services), &builder);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CallLogFactory>(denials));
  interceptors.push_back(std::make_unique<WriteWatchFactory>(options.write_patience));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  built.taker = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
  for (const ServedService& each : services) {
    built.admitted.push_back(admission->Admit(each.full_name, each.service.get()));
    builder.RegisterService(built.admitted.back().get());
    built.names.push_back(each.full_name);
  }
  built.server = builder.BuildAndStart();
  if (built.server == nullptr) return built;
  for (const std::string& name : built.names) built.server->GetHealthCheckService()->SetServingStatus(name, false);
  return built;
}

// What is kept in step while a server serves.
struct Served {
  grpc::Server* server;
  Admission* admission;
  Denials* denials;
  SessionEnds* session_ends;
  Observation* observation;
  storage::Database* database;
  std::vector<std::string> names;  // of health
};

// Keeps health and admission in step with the database until a signal comes.
void ServeUntilStopped(const ServerOptions& options, const Served& served, const sigset_t& signals) {
  ReadinessQuestion question(served.database, options.volatile_database);
  bool serving = false;
  std::string said;
  do {
    if (serving) KeepDenials(served.database, served.denials);
    std::string why_not;
    const Readiness readiness = question.Ask(&why_not);
    if (readiness == Readiness::kReady)
      served.session_ends->Read(served.database, std::chrono::steady_clock::now() + kDatabasePatience);
    if (readiness == Readiness::kBusy) continue;  // full is not broken: as before
    if (!why_not.empty() && why_not != said)
      Log(LogLevel::kWarning, (readiness == Readiness::kReady ? "served all the same: " : "not ready: ") + why_not);
    said = why_not;
    served.observation->SetReady(readiness == Readiness::kReady);
    if (readiness == Readiness::kReady)
      served.admission->SetReady();
    else
      served.admission->SetNotReady(why_not);
    if (serving == (readiness == Readiness::kReady)) continue;
    serving = !serving;
    for (const std::string& name : served.names)
      served.server->GetHealthCheckService()->SetServingStatus(name, serving);
    Log(LogLevel::kInfo, serving ? "serving" : "not serving");
  } while (!WaitForStop(signals, serving ? kPollServing_ms : kPollStarting_ms));
}

}  // namespace

int Serve(const ServerOptions& given, const ServiceFactory& factory) {
  BoundReads();
  WatchFrames();
  const sigset_t signals = BlockSignals();
  StartLog(given.area);
  ServerOptions options = given;
  const auto server_credentials = ServerCredentialsOf(options.certificates);
  const auto own_credentials = ChannelCredentialsOf(options.certificates);
  identity::Trust trust(std::filesystem::path(options.certificates) / identity::kAuthorityFile, options.revoked_file);
  for (const absl::Status& status : {server_credentials.status(), own_credentials.status(),
                                     CheckServiceCredentials(options.certificates, options.area), trust.CheckFiles()}) {
    if (status.ok()) continue;
    Log(LogLevel::kError, "cannot know its callers", {{"why", std::string(status.message())}});
    return 1;
  }
  options.credentials = *own_credentials;
  const ConnectionLimits connection_limits = RaiseDescriptorLimit({});

  const std::unique_ptr<storage::Database> database =
      storage::Database::Open(options.database, options.database_connections);
  // Readiness, denials and the ends of sessions do not wait behind calls.
  const std::unique_ptr<storage::Database> own_database = storage::Database::Open(options.database, 1);
  Denials denials(options.area);
  options.count_refused_sign_in = [&denials](const RefusedSignIn& one) {
    denials.Add(one.method, one.account, one.peer_address, one.reason, one.sentence);
  };
  SessionEnds session_ends;
  const Access access(&trust, &session_ends, MachineBy(database.get()));
  Observation observation(options, database.get(), own_database.get(), &access, &denials);
  std::vector<ServedService> services = factory(options, database.get());
  OpenConnections connections(connection_limits);
  const Clearance clearance(storage::ClearancesIn(database.get()));
  CallGate gate({}, &connections);
  Admission admission(&access, &clearance, &gate);

  absl::StatusOr<std::vector<Descriptor>> sockets = ListenAt(options.listen_address);
  if (!sockets.ok()) {
    Log(LogLevel::kError, "cannot listen", {{"why", std::string(sockets.status().message())}});
    return 1;
  }
  Built built = Build(options, services, *server_credentials, &admission, &denials);
  grpc::Server* const server = built.server.get();
  if (server == nullptr) {
    Log(LogLevel::kError, "gRPC does not start");
    return 1;
  }
  if (absl::Status begun = observation.Begin(&services); !begun.ok()) {
    Log(LogLevel::kError, "cannot be seen", {{"why", std::string(begun.message())}});
    return 1;
  }
  auto acceptor = std::make_unique<ConnectionAcceptor>(*std::move(sockets), &connections, std::move(built.taker));
  auto flood_watch = std::make_unique<FloodWatch>(&connections);
  std::atomic<bool> stopping{false};
  std::thread certificate_watch([&] {
    for (; !stopping; std::this_thread::sleep_for(kBetweenJudgements)) admission.EndUnbelieved();
  });
  Log(LogLevel::kInfo, "listening", {{"address", options.listen_address}});

  ServeUntilStopped(
      options, {server, &admission, &denials, &session_ends, &observation, own_database.get(), built.names}, signals);

  observation.SetReady(false);
  server->GetHealthCheckService()->Shutdown();
  Log(LogLevel::kInfo, "stopping: running calls may end, new ones are refused");
  acceptor.reset();
  flood_watch.reset();
  RemoveUnixSocket(options.listen_address);
  for (const ServedService& each : services)
    if (each.on_stop) each.on_stop();
  server->Shutdown(system_clock::now() + DrainTime());
  server->Wait();
  stopping = true;
  certificate_watch.join();
  observation.End();
  KeepDenials(own_database.get(), &denials);
  Log(LogLevel::kInfo, "stopped");
  return 0;
}

}  // namespace sixpoint::runtime
