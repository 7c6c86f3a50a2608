// The runtime as a real process: health tied to the database, signals, limits, logs.
#include "services/runtime/server.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"
#include "services/runtime/listening_sockets.h"
#include "services/runtime/trace.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/migrate.h"
#include "tests/services/runtime/raw_connection.h"
#include "tests/support/becomes.h"
#include "tests/support/plant_certificates.h"
#include "tests/support/sanitizer.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::runtime {
namespace {

using ingest::v1::GetScanRequest;
using ingest::v1::Scan;
using ingest::v1::ScanService;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::milliseconds;
using testing::CallHeaders;
using testing::Frame;
using testing::FrameOf;
using testing::RawConnection;

constexpr char kService[] = "sixpoint.ingest.v1.ScanService";
enum Health { kUnknown = 0, kServing = 1, kNotServing = 2 };  // grpc.health.v1.HealthCheckResponse.ServingStatus

// Of a sanitized server memory says nothing.
constexpr bool kMemoryCounts = !sixpoint::testing::kSanitized;

// For gRPC's own calls, which want the clock of the day.
std::chrono::system_clock::time_point Soon(double in_s) {
  return std::chrono::system_clock::now() + milliseconds(static_cast<std::int64_t>(in_s * 1e3));
}

class ServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = (std::filesystem::temp_directory_path() / "sixpoint-server-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder_.data()), nullptr);
  }
  void TearDown() override {
    if (pid_ > 0) Stop(SIGKILL);
    std::filesystem::remove_all(folder_);
  }

  pid_t Spawn(const std::string& listen, const std::string& conninfo) {
    const char* bin = std::getenv("SIXPOINT_BIN_DIR");
    if (bin == nullptr) ADD_FAILURE() << "SIXPOINT_BIN_DIR is not set, want the folder of the programs (ctest sets it)";
    const std::string program = std::string(bin == nullptr ? "." : bin) + "/runtime_test_server";
    const std::string log = folder_ + "/log";
    const std::string own = certificates_.Service("ingest").string(), revoked = certificates_.revoked_file().string();
    const pid_t child = fork();
    if (child == 0) {
      if (std::freopen(log.c_str(), "a", stderr) == nullptr) _exit(126);
      const rlimit descriptors{descriptor_limit_, descriptor_limit_};
      if (descriptor_limit_ > 0 && setrlimit(RLIMIT_NOFILE, &descriptors) != 0) _exit(125);
      execl(program.c_str(), program.c_str(), "--listen", listen.c_str(), "--database", conninfo.c_str(),
            "--certificates", own.c_str(), "--revoked", revoked.c_str(), nullptr);
      _exit(127);
    }
    return child;
  }
  void Start(const std::string& conninfo) { StartAt(Address(), conninfo); }
  void StartAt(const std::string& address, const std::string& conninfo) {
    pid_ = Spawn(address, conninfo);
    channel_ = NewChannel(address);
    ASSERT_TRUE(channel_->WaitForConnected(Soon(15)));
  }
  // With a database that it may use.
  void StartReady(const std::string& address) {
    database_ = std::make_unique<ThrowawayDatabase>();
    StartAt(address, sixpoint::testing::AsRole(database_->conninfo(), "ingest"));
    ASSERT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
  }
  // With a connection of its own.
  std::shared_ptr<grpc::Channel> NewChannel(const std::string& address) const {
    return NewChannel(address, credentials_);
  }
  static std::shared_ptr<grpc::Channel> NewChannel(const std::string& address,
                                                   const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
    grpc::ChannelArguments of_its_own;
    of_its_own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    of_its_own.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
    of_its_own.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    of_its_own.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
    return grpc::CreateCustomChannel(address, credentials, of_its_own);
  }
  // One that the kernel found free, the same throughout a test.
  const std::string& TcpAddress() {
    if (tcp_address_.empty()) {
      const auto sockets = ListenAt("127.0.0.1:0");
      EXPECT_TRUE(sockets.ok()) << sockets.status();
      tcp_address_ = "127.0.0.1:" + std::to_string(sockets.ok() ? PortOf(sockets->front()) : 0);
    }
    return tcp_address_;
  }
  std::string Address() const { return "unix:" + folder_ + "/socket"; }
  int Stop(int signal) {
    kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return status;
  }
  std::vector<nlohmann::json> LogLines(const std::string& message) {
    std::ifstream file(folder_ + "/log");
    std::vector<nlohmann::json> found;
    // A line without its end is still being written.
    for (std::string line; std::getline(file, line) && !file.eof();) {
      const nlohmann::json parsed = nlohmann::json::parse(line, nullptr, false);
      EXPECT_TRUE(parsed.is_object()) << line;
      if (parsed.is_object() && parsed["msg"] == message) found.push_back(parsed);
    }
    return found;
  }

  // The most memory that the server ever held.
  std::int64_t PeakKb() const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.rfind("VmHWM:", 0) == 0) return std::stoll(line.substr(6));
    ADD_FAILURE() << "no VmHWM of " << pid_;
    return 0;
  }

  Health HealthOf(const std::string& service, grpc::StatusCode* code = nullptr) {
    const std::string request =
        service.empty() ? "" : "\x0a" + std::string(1, static_cast<char>(service.size())) + service;
    grpc::Slice slice(request);
    grpc::ByteBuffer sent(&slice, 1), received;
    grpc::GenericStub stub(channel_);
    grpc::ClientContext context;
    context.set_deadline(Soon(5));
    grpc::CompletionQueue queue;
    grpc::Status status;
    const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", sent, &queue);
    call->StartCall();
    call->Finish(&received, &status, this);
    void* tag = nullptr;
    bool done = false;
    queue.Next(&tag, &done);
    if (code != nullptr) *code = status.error_code();
    grpc::Slice answer;
    if (!status.ok() || !received.DumpToSingleSlice(&answer).ok() || answer.size() != 2) return kUnknown;
    return static_cast<Health>(answer.begin()[1]);
  }
  bool BecomesHealth(Health wanted, std::chrono::seconds within) {
    return sixpoint::testing::Becomes(within, [&] { return HealthOf("") == wanted && HealthOf(kService) == wanted; });
  }
  grpc::Status Get(const std::string& name, Scan* scan, const std::string& traceparent = "") {
    GetScanRequest request;
    request.set_name(name);
    grpc::ClientContext context;
    context.set_deadline(Soon(10));
    if (!traceparent.empty()) context.AddMetadata("traceparent", traceparent);
    return ScanService::NewStub(channel_)->GetScan(&context, request, scan);
  }

  std::string folder_, tcp_address_;
  sixpoint::testing::PlantCertificates certificates_;
  std::shared_ptr<grpc::ChannelCredentials> credentials_ =
      ChannelCredentialsOf(certificates_.User("jane", {identity::Role::kEngineer})).value();
  std::unique_ptr<ThrowawayDatabase> database_;
  rlim_t descriptor_limit_ = 0;  // 0: as ours
  pid_t pid_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(ServerTest, HealthFollowsSchemaAndDatabase) {
  ThrowawayDatabase database(ThrowawayDatabase::Schema::kEmpty);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  std::this_thread::sleep_for(milliseconds(600));
  EXPECT_EQ(HealthOf(""), kNotServing);  // reachable, but without a schema
  EXPECT_EQ(HealthOf(kService), kNotServing);
  ASSERT_TRUE(storage::Migrate(database.conninfo(), ThrowawayDatabase::MigrationsFolder()).ok());
  EXPECT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
  ThrowawayDatabase::KillServer();
  EXPECT_TRUE(BecomesHealth(kNotServing, std::chrono::seconds(15)));
  ThrowawayDatabase::StartServer();
  EXPECT_TRUE(BecomesHealth(kServing, std::chrono::seconds(30)));
  grpc::StatusCode code = grpc::StatusCode::OK;
  EXPECT_EQ(HealthOf("nobody", &code), kUnknown);
  EXPECT_EQ(code, grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(LogLines("serving").size(), 2);
}

// Handlers of a service that has no database fail in ways of their own: none is run.
TEST_F(ServerTest, EveryMethodIsUnavailableUntilTheServiceIsReady) {
  ThrowawayDatabase database(ThrowawayDatabase::Schema::kEmpty);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  const std::string why = "the service is not ready: schema version: 0, want " + std::to_string(NewestMigration());
  Scan scan;
  grpc::Status unready;
  EXPECT_TRUE(sixpoint::testing::Becomes(std::chrono::seconds(15), [&] {
    unready = Get("x", &scan);
    return unready.error_message() == why;
  })) << unready.error_message();
  EXPECT_EQ(unready.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(HasReason(FromGrpc(unready), errors::v1::SERVICE_NOT_READY));
  // Of every kind: those that stream answers, and requests too.
  const auto stub = ScanService::NewStub(channel_);
  grpc::ClientContext download, upload;
  ingest::v1::DownloadScanResponse downloaded;
  const auto reader = stub->DownloadScan(&download, {});
  EXPECT_FALSE(reader->Read(&downloaded));
  EXPECT_EQ(reader->Finish().error_message(), why);
  ingest::v1::UploadScanResponse uploaded;
  const auto stream = stub->UploadScan(&upload);
  EXPECT_FALSE(stream->Read(&uploaded));
  EXPECT_EQ(stream->Finish().error_message(), why);
  // Migrated, it serves; one that loses its database no longer does.
  ASSERT_TRUE(storage::Migrate(database.conninfo(), ThrowawayDatabase::MigrationsFolder()).ok());
  ASSERT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
  EXPECT_TRUE(Get("x", &scan).ok());
  ThrowawayDatabase::KillServer();
  EXPECT_TRUE(BecomesHealth(kNotServing, std::chrono::seconds(15)));
  EXPECT_TRUE(HasReason(FromGrpc(Get("x", &scan)), errors::v1::SERVICE_NOT_READY));
  ThrowawayDatabase::StartServer();
  EXPECT_TRUE(BecomesHealth(kServing, std::chrono::seconds(30)));
}

TEST_F(ServerTest, ADatabaseThatMayLoseWhatItKeptIsNotServed) {
  ThrowawayDatabase database;
  ASSERT_EQ(unsetenv("SIXPOINT_VOLATILE_DATABASE"), 0);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  const std::string why = "not ready: fsync: off, want on: a database that loses nothing it has kept";
  EXPECT_TRUE(sixpoint::testing::Becomes(std::chrono::seconds(20), [&] { return !LogLines(why).empty(); }));
  EXPECT_EQ(LogLines(why).size(), 1u);
  EXPECT_EQ(HealthOf(""), kNotServing);
  Stop(SIGTERM);
  ASSERT_EQ(setenv("SIXPOINT_VOLATILE_DATABASE", "true", 1), 0);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  EXPECT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
}

TEST_F(ServerTest, AServiceThatCouldChangeTheRecordDoesNotServe) {
  ThrowawayDatabase database;
  Start(database.conninfo());  // as the owner
  const std::string why =
      "not ready: database role: sixpoint, a superuser, want the service's own, sixpoint_plant for instance, which can "
      "change nothing";
  EXPECT_TRUE(sixpoint::testing::Becomes(std::chrono::seconds(20), [&] { return !LogLines(why).empty(); }));
  EXPECT_EQ(LogLines(why).size(), 1u);
  EXPECT_EQ(HealthOf(""), kNotServing);
}

TEST_F(ServerTest, WhoDoesNotTakeWhatHeIsSentIsLetGo) {
  ThrowawayDatabase database;
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  ASSERT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
  const auto stub = ScanService::NewStub(channel_);
  grpc::ClientContext of_reader, of_idler;
  const auto reader = stub->DownloadScan(&of_reader, {});
  const auto idler = stub->DownloadScan(&of_idler, {});
  ingest::v1::DownloadScanResponse piece;
  EXPECT_TRUE(sixpoint::testing::Becomes(std::chrono::seconds(30), [&] {
    EXPECT_TRUE(reader->Read(&piece));
    return !LogLines("download ended").empty();
  }));
  EXPECT_TRUE(reader->Read(&piece));  // who reads is served on
  while (idler->Read(&piece)) continue;
  EXPECT_EQ(idler->Finish().error_code(), grpc::StatusCode::CANCELLED);
  of_reader.TryCancel();
  while (reader->Read(&piece)) continue;
}

TEST_F(ServerTest, SigtermLetsRunningCallsEndAndExitsWithZero) {
  ThrowawayDatabase database;
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  ASSERT_TRUE(BecomesHealth(kServing, std::chrono::seconds(15)));
  grpc::Status slow;
  std::thread call([&] {
    Scan scan;
    slow = Get("slow", &scan);
  });
  EXPECT_TRUE(
      sixpoint::testing::Becomes(std::chrono::seconds(10), [&] { return !LogLines("slow call begun").empty(); }));
  const int status = Stop(SIGTERM);
  call.join();
  EXPECT_TRUE(slow.ok()) << slow.error_message();
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(LogLines("stopped").size(), 1u);
}

TEST_F(ServerTest, StopsAtOnceAlsoWithoutADatabase) {
  Start("host=/nowhere-at-all dbname=x");
  EXPECT_EQ(HealthOf(""), kNotServing);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(WEXITSTATUS(Stop(SIGINT)), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(3000));
}

TEST_F(ServerTest, EachCallIsOneLogLineWithItsTrace) {
  StartReady(Address());
  const std::string given = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  Scan scan;
  ASSERT_TRUE(Get("a", &scan, given).ok());
  // The handler works in a span of its own.
  EXPECT_EQ(TraceIdOf(scan.name()), TraceIdOf(given));
  EXPECT_NE(SpanIdOf(scan.name()), SpanIdOf(given));
  const std::string own_span = SpanIdOf(scan.name());
  ASSERT_TRUE(Get("b", &scan).ok());
  const std::string minted = scan.name();
  EXPECT_EQ(TraceIdOf(minted).size(), 32u);
  const grpc::Status internal = Get("internal", &scan);
  EXPECT_EQ(internal.error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_THAT(internal.error_message(), ::testing::Not(::testing::HasSubstr("secret")));
  Stop(SIGTERM);

  std::vector<nlohmann::json> calls = LogLines("call");
  ASSERT_EQ(calls.size(), 3u);
  // A line is written when the call has ended, and the next one may be under way by then.
  const auto place = [&](const nlohmann::json& line) {
    return line["trace_id"] == TraceIdOf(given) ? 0 : line["trace_id"] == TraceIdOf(minted) ? 1 : 2;
  };
  std::sort(calls.begin(), calls.end(),
            [&](const nlohmann::json& a, const nlohmann::json& b) { return place(a) < place(b); });
  EXPECT_EQ(calls[0]["trace_id"], "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(calls[0]["span_id"], own_span);
  EXPECT_EQ(calls[0]["parent_span_id"], SpanIdOf(given));
  EXPECT_FALSE(calls[1].contains("parent_span_id"));
  EXPECT_EQ(calls[1]["trace_id"], TraceIdOf(minted));
  EXPECT_EQ(calls[0]["code"], "OK");
  EXPECT_EQ(calls[2]["code"], "INTERNAL");
  EXPECT_EQ(calls[2]["level"], "error");
  for (const nlohmann::json& line : calls) {
    EXPECT_EQ(line["rpc"], "/sixpoint.ingest.v1.ScanService/GetScan");
    EXPECT_EQ(line["service"], "ingest");
    EXPECT_EQ(line["version"], SoftwareVersion());
    EXPECT_GE(line["dur_ms"].get<double>(), 0);
    EXPECT_THAT(line["ts"].get<std::string>(), ::testing::MatchesRegex("20..-..-..T..:..:...*Z"));
  }
  EXPECT_EQ(LogLines("a secret").size(), 1u);
}

TEST_F(ServerTest, TooLargeAMessageOrHeaderIsRefused) {
  StartReady(Address());
  Scan scan;
  EXPECT_TRUE(Get(std::string(128, 'x'), &scan).ok());
  const grpc::Status long_name = Get(std::string(129, 'x'), &scan);
  EXPECT_EQ(long_name.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(long_name.error_message(), "name: 129 bytes, want at most 128 bytes");
  // What is too large for its method, and for every method of the server (UploadScan's 8 MiB).
  const grpc::Status large = Get(std::string(300'000, 'x'), &scan);
  EXPECT_EQ(large.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(large.error_message(), "request: 300004 bytes, want at most 262144");
  EXPECT_EQ(Get(std::string(9 << 20, 'x'), &scan).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_FALSE(Get("x", &scan, std::string(40'000, 'h')).ok());
  // The server ends the connection that sent such a header, and lives on for others.
  channel_ = NewChannel(Address());
  const grpc::Status after = Get("x", &scan);
  EXPECT_TRUE(after.ok()) << after.error_message();
}

// 100 MB that are 100 KB on the wire.
TEST_F(ServerTest, ACompressedMessageIsRefusedBeforeItIsInflated) {
  StartReady(Address());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  const std::int64_t before_kb = PeakKb();
  GetScanRequest bomb;
  bomb.set_name(std::string(100'000'000, 'x'));
  for (const grpc_compression_algorithm algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    grpc::ClientContext context;
    context.set_deadline(Soon(60));
    context.set_compression_algorithm(algorithm);
    const grpc::Status status = ScanService::NewStub(channel_)->GetScan(&context, bomb, &scan);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << status.error_message();
  }
  const std::int64_t growth_kb = PeakKb() - before_kb;
  RecordProperty("bomb_rss_mb", std::to_string(1e-3 * static_cast<double>(growth_kb)));
  EXPECT_TRUE(!kMemoryCounts || growth_kb < 20'000) << growth_kb;
  EXPECT_TRUE(Get("x", &scan).ok());
}

// Who has no certificate is refused by what his call says of itself; what he sends besides is not even taken.
TEST_F(ServerTest, OfAStrangersRequestsNextToNothingIsHeld) {
  StartReady(Address());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  const std::int64_t before_kb = PeakKb();
  GetScanRequest large;
  large.set_name(std::string(8'000'000, 'x'));
  std::atomic<int> refused = 0;
  std::vector<std::thread> strangers;
  for (int i = 0; i < 30; ++i) {
    strangers.emplace_back([&] {
      const auto channel = NewChannel(Address(), CredentialsForAStranger());
      for (int k = 0; k < 3; ++k) {
        Scan nothing;
        grpc::ClientContext context;
        context.set_deadline(Soon(60));
        refused += ScanService::NewStub(channel)->GetScan(&context, large, &nothing).error_code() ==
                   grpc::StatusCode::UNAUTHENTICATED;
      }
    });
  }
  for (std::thread& stranger : strangers) stranger.join();
  EXPECT_EQ(refused, 90);
  const std::int64_t growth_kb = PeakKb() - before_kb;
  RecordProperty("strangers_rss_mb", std::to_string(1e-3 * static_cast<double>(growth_kb)));
  EXPECT_TRUE(!kMemoryCounts || growth_kb < 60'000) << growth_kb;
  EXPECT_TRUE(Get("x", &scan).ok());
}

// Each holds a place (call_gate.h), of which one caller has so many and each for so long.
TEST_F(ServerTest, CallsWhoseRequestDoesNotComeAreEnded) {
  StartReady(Address());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  std::vector<grpc::GenericStub> stubs;  // of a connection each, for one has not as many calls
  for (int i = 0; i < 4; ++i) stubs.emplace_back(NewChannel(Address()));
  grpc::CompletionQueue queue;
  constexpr int kCalls = 48;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::GenericClientAsyncReaderWriter>> calls;
  void* tag = nullptr;
  bool done = false;
  for (int i = 0; i < kCalls; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    contexts.back()->set_deadline(Soon(120));
    calls.push_back(stubs[static_cast<std::size_t>(i) % stubs.size()].PrepareCall(
        contexts.back().get(), "/" + std::string(kService) + "/GetScan", &queue));
    calls.back()->StartCall(nullptr);
    queue.Next(&tag, &done);
  }
  grpc::Status one_more;
  for (const auto end = Soon(8); one_more.ok() && std::chrono::system_clock::now() < end;) one_more = Get("x", &scan);
  EXPECT_EQ(one_more.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << one_more.error_message();
  EXPECT_TRUE(HasReason(FromGrpc(one_more), errors::v1::CALLS_FULL));
  int ended_count = 0;
  for (const auto& call : calls) {
    grpc::Status ended;
    call->Finish(&ended, nullptr);
    queue.Next(&tag, &done);
    if (ended.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED) continue;  // it came while we asked
    ++ended_count;
    EXPECT_EQ(ended.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_EQ(ended.error_message(), "request: not there after 10000 ms, want it sooner");
  }
  EXPECT_GE(ended_count, kCalls - 2);
  EXPECT_TRUE(Get("x", &scan).ok());
}

TEST_F(ServerTest, ATakenPortIsAnErrorNotASharedPort) {
  StartAt(TcpAddress(), "host=/nowhere-at-all dbname=x");
  const pid_t second = Spawn(TcpAddress(), "host=/nowhere-at-all dbname=x");
  int status = 0;
  ASSERT_EQ(waitpid(second, &status, 0), second);
  EXPECT_EQ(WEXITSTATUS(status), 1);
  const auto lines = LogLines("cannot listen");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0]["why"],
            "--listen: " + TcpAddress() + " (Address already in use), want an address of this machine that is free");
}

// One peer with 3000 connections, each of which has said that it speaks HTTP/2 and says nothing more.
TEST_F(ServerTest, OnePeersConnectionsNeitherStopOthersNorGrowMemory) {
  rlimit ours{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  if (ours.rlim_max < 4000) GTEST_SKIP() << "SKIPPED: at most " << ours.rlim_max << " descriptors, want 4000";
  ours.rlim_cur = ours.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &ours), 0);
  StartReady(TcpAddress());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  const std::int64_t before_kb = PeakKb();
  std::vector<RawConnection> idle;
  for (int i = 0; i < 3000; ++i) {
    idle.emplace_back(TcpAddress(), "127.0.0.2");
    ASSERT_TRUE(idle.back().connected());
    idle.back().Send(testing::Preface());
  }
  // Another peer is served all the while, on a connection of its own.
  channel_ = NewChannel(TcpAddress());
  const grpc::Status another = Get("x", &scan);
  EXPECT_TRUE(another.ok()) << another.error_message();
  const std::int64_t growth_kb = PeakKb() - before_kb;
  const auto open_count = [&idle] {
    return std::count_if(idle.begin(), idle.end(), [](RawConnection& one) { return !one.IsClosedWithin(0); });
  };
  sixpoint::testing::Becomes(std::chrono::seconds(20), [&] { return open_count() <= 256; });
  EXPECT_EQ(open_count(), 256);  // as ConnectionLimits says
  RecordProperty("idle_connections_rss_mb", std::to_string(1e-3 * static_cast<double>(growth_kb)));
  EXPECT_TRUE(!kMemoryCounts || growth_kb < 32'000) << growth_kb;  // 256 connections of about 64 KB, twice
  EXPECT_EQ(LogLines("connection refused").size(), 1u);
  // Its places are free again once it has gone.
  idle.clear();
  EXPECT_TRUE(sixpoint::testing::Becomes(std::chrono::seconds(20), [&] {
    RawConnection one(TcpAddress(), "127.0.0.2");
    return one.Send(testing::Preface()) && !one.IsClosedWithin(0.2);
  }));
}

TEST_F(ServerTest, ExhaustedDescriptorsRecover) {
  descriptor_limit_ = 128;
  StartReady(TcpAddress());
  Scan scan;
  ASSERT_TRUE(Get("hold every descriptor", &scan).ok());
  // Refused, not left to wait; the connections that are there go on.
  for (int i = 0; i < 200; ++i)
    EXPECT_TRUE(RawConnection(TcpAddress(), "", testing::Speaks::kNothing).IsClosedWithin(10)) << i;
  ASSERT_TRUE(Get("give them back", &scan).ok());
  channel_ = NewChannel(TcpAddress());
  const grpc::Status after = Get("x", &scan);
  EXPECT_TRUE(after.ok()) << after.error_message();
}

TEST_F(ServerTest, ConnectionsLeaveDescriptorsForTheServersOwnWork) {
  descriptor_limit_ = 128;
  StartReady(TcpAddress());
  Scan scan;
  std::vector<RawConnection> idle;
  for (int i = 0; i < 100; ++i)
    idle.emplace_back(TcpAddress(), "127.0.0." + std::to_string(2 + i % 4), testing::Speaks::kNothing);
  EXPECT_TRUE(
      sixpoint::testing::Becomes(std::chrono::seconds(20), [&] { return !LogLines("connection refused").empty(); }));
  EXPECT_EQ(LogLines("connection refused").size(), 1u);
  ASSERT_TRUE(Get("hold every descriptor", &scan).ok());
  EXPECT_GT(std::stoi(scan.name()), 32);  // of 128, 64 are for connections; gRPC and logs have some
}

// More calls than are answered at once, of one certificate: each end is told at once, with when to come again; somebody else is served
// meanwhile, and the connections that were paused for it are read again.
TEST_F(ServerTest, MoreCallsThanAreAnsweredAtOnceAreRefusedAndStopNobodyElse) {
  StartReady(TcpAddress());
  std::vector<std::shared_ptr<grpc::Channel>> channels;
  for (int i = 0; i < 8; ++i) channels.push_back(NewChannel(TcpAddress()));
  std::atomic<int> served = 0, refused = 0, with_delay = 0;
  std::vector<std::thread> callers;
  for (int i = 0; i < 160; ++i) {
    callers.emplace_back([&, stub = ScanService::NewStub(channels[static_cast<std::size_t>(i) % 8])] {
      GetScanRequest request;
      request.set_name("slow");
      grpc::ClientContext context;
      context.set_deadline(Soon(60));
      Scan scan;
      const grpc::Status status = stub->GetScan(&context, request, &scan);
      served += status.ok() ? 1 : 0;
      if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) return;
      ++refused;
      with_delay += RetryDelayOf(FromGrpc(status)) > milliseconds(0) ? 1 : 0;
    });
  }
  const auto others = ChannelCredentialsOf(certificates_.Machine("m1"));
  ASSERT_TRUE(others.ok()) << others.status();
  channel_ = NewChannel(TcpAddress(), *others);
  for (int i = 0; i < 20; ++i) {
    Scan scan;
    const grpc::Status other = Get("machines/m1", &scan);
    EXPECT_NE(other.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << other.error_message();
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(served + refused, 160);
  EXPECT_GE(served, 48);
  EXPECT_GT(refused, 0);
  EXPECT_EQ(with_delay, refused);
  for (const auto& channel : channels) {
    channel_ = channel;
    Scan scan;
    const grpc::Status after = Get("x", &scan);
    EXPECT_TRUE(after.ok()) << after.error_message();
  }
}

// CVE-2023-44487: calls that are begun and given up at once, as fast as the server takes them, on four connections that are opened anew
// whenever it ends them. Requests that are still to come, and such as have come whole.
TEST_F(ServerTest, StreamsThatAreResetAtOnceTakeLittleMemory) {
  StartReady(TcpAddress());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  const std::int64_t before_kb = PeakKb();
  const std::string headers = CallHeaders("/" + std::string(kService) + "/GetScan");
  const std::string cancel("\0\0\0\x08", 4);
  std::atomic<int> sent = 0, connections = 0;
  const auto attack = [&](int flags) {
    for (const auto end = Soon(4); std::chrono::system_clock::now() < end;) {
      RawConnection stranger(TcpAddress(), "127.0.0.2");
      if (!stranger.Send(testing::Preface())) continue;
      ++connections;
      bool open = true;
      for (unsigned stream = 1; open && std::chrono::system_clock::now() < end;) {
        std::string burst;
        for (int i = 0; i < 100; ++i, stream += 2)
          burst += FrameOf(Frame::kHeaders, flags, stream, headers) + FrameOf(Frame::kResetStream, 0, stream, cancel);
        open = stranger.Send(burst);
        if (open) sent += 100;
      }
    }
  };
  for (const int end_headers_and_stream : {0x04, 0x05}) {
    std::vector<std::thread> strangers;
    for (int i = 0; i < 4; ++i) strangers.emplace_back(attack, end_headers_and_stream);
    const grpc::Status meanwhile = Get("x", &scan);
    EXPECT_TRUE(meanwhile.ok()) << meanwhile.error_message();
    for (std::thread& stranger : strangers) stranger.join();
    std::this_thread::sleep_for(std::chrono::seconds(5));  // so long a stranger whom it has cut off is refused
  }
  const std::int64_t growth_kb = PeakKb() - before_kb;
  std::printf("%d streams reset on %d connections\n", sent.load(), connections.load());
  RecordProperty("rapid_reset_rss_mb", std::to_string(1e-3 * static_cast<double>(growth_kb)));
  EXPECT_GT(sent, 2000);
  EXPECT_TRUE(!kMemoryCounts || growth_kb < 100'000) << growth_kb;
  EXPECT_GE(LogLines("connection ended: its calls were given up unanswered").size(), 2u);
  EXPECT_TRUE(Get("x", &scan).ok());
}

// CVE-2023-33953: gRPC 1.51 keeps all of a header block, however long it gets; and it reads what carries nothing as fast as it comes.
TEST_F(ServerTest, AHeaderBlockWithoutEndEndsTheConnection) {
  StartReady(TcpAddress());
  Scan scan;
  ASSERT_TRUE(Get("x", &scan).ok());
  const auto sends_of = [&](const std::string& first, const std::string& again, int most) {
    RawConnection stranger(TcpAddress(), "127.0.0.2");
    EXPECT_TRUE(stranger.Send(testing::Preface() + first));
    for (int sent = 0; sent < most; ++sent)
      if (!stranger.Send(again)) return sent;
    return stranger.IsClosedWithin(10) ? most : most + 1;
  };
  const std::string headers = CallHeaders("/" + std::string(kService) + "/GetScan");
  EXPECT_LE(sends_of(FrameOf(Frame::kHeaders, 0, 1, headers),
                     FrameOf(Frame::kContinuation, 0, 1, std::string(16'000, '\0')), 8),
            8);
  std::string nothing;
  for (int i = 0; i < 15'000; ++i) nothing += FrameOf(Frame::kUnknown, 0, 0, "");
  EXPECT_LE(sends_of("", nothing, 2), 2);
  EXPECT_GE(LogLines("connection ended: a header block of more than 64 KB or 64 frames").size(), 1u);
  EXPECT_GE(LogLines("connection ended: more than 10,000 frames a second that carry nothing").size(), 1u);
  EXPECT_TRUE(Get("x", &scan).ok());
}

}  // namespace
}  // namespace sixpoint::runtime
