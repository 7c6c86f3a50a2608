// The runtime as a real process: health tied to the database, signals, limits, logs.
#include "services/runtime/server.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "services/runtime/trace.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/migrate.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::runtime {
namespace {

using ingest::v1::GetScanRequest;
using ingest::v1::Scan;
using ingest::v1::ScanService;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::milliseconds;

constexpr char kService[] = "sixpoint.ingest.v1.ScanService";
enum Health { kUnknown = 0, kServing = 1, kNotServing = 2 };  // grpc.health.v1.HealthCheckResponse.ServingStatus

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
    const pid_t child = fork();
    if (child == 0) {
      if (std::freopen(log.c_str(), "a", stderr) == nullptr) _exit(126);
      execl(program.c_str(), program.c_str(), "--listen", listen.c_str(), "--database", conninfo.c_str(),
            "--max-message-mb", "1", nullptr);
      _exit(127);
    }
    return child;
  }
  void Start(const std::string& conninfo) {
    pid_ = Spawn(Address(), conninfo);
    channel_ = grpc::CreateChannel(Address(), grpc::InsecureChannelCredentials());
    ASSERT_TRUE(channel_->WaitForConnected(Soon(15)));
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
  bool BecomesHealth(Health wanted, double seconds) {
    for (const auto end = Soon(seconds); std::chrono::system_clock::now() < end;) {
      if (HealthOf("") == wanted && HealthOf(kService) == wanted) return true;
      std::this_thread::sleep_for(milliseconds(50));
    }
    return false;
  }
  grpc::Status Get(const std::string& name, Scan* scan, const std::string& traceparent = "") {
    GetScanRequest request;
    request.set_name(name);
    grpc::ClientContext context;
    context.set_deadline(Soon(10));
    if (!traceparent.empty()) context.AddMetadata("traceparent", traceparent);
    return ScanService::NewStub(channel_)->GetScan(&context, request, scan);
  }

  std::string folder_;
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
  EXPECT_TRUE(BecomesHealth(kServing, 15));
  ThrowawayDatabase::KillServer();
  EXPECT_TRUE(BecomesHealth(kNotServing, 15));
  ThrowawayDatabase::StartServer();
  EXPECT_TRUE(BecomesHealth(kServing, 30));
  grpc::StatusCode code = grpc::StatusCode::OK;
  EXPECT_EQ(HealthOf("nobody", &code), kUnknown);
  EXPECT_EQ(code, grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(LogLines("serving").size(), 2);
}

TEST_F(ServerTest, ADatabaseThatMayLoseWhatItKeptIsNotServed) {
  ThrowawayDatabase database;
  ASSERT_EQ(unsetenv("SIXPOINT_VOLATILE_DATABASE"), 0);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  const std::string why = "not ready: fsync: off, want on: a database that loses nothing it has kept";
  for (const auto end = Soon(20); LogLines(why).empty() && std::chrono::system_clock::now() < end;)
    std::this_thread::sleep_for(milliseconds(50));
  EXPECT_EQ(LogLines(why).size(), 1u);
  EXPECT_EQ(HealthOf(""), kNotServing);
  Stop(SIGTERM);
  ASSERT_EQ(setenv("SIXPOINT_VOLATILE_DATABASE", "true", 1), 0);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  EXPECT_TRUE(BecomesHealth(kServing, 15));
}

TEST_F(ServerTest, AServiceThatCouldChangeTheRecordDoesNotServe) {
  ThrowawayDatabase database;
  Start(database.conninfo());  // as the owner
  const std::string why =
      "not ready: database role: sixpoint, a superuser, want the service's own, sixpoint_plant for instance, which can "
      "change nothing";
  for (const auto end = Soon(20); LogLines(why).empty() && std::chrono::system_clock::now() < end;)
    std::this_thread::sleep_for(milliseconds(50));
  EXPECT_EQ(LogLines(why).size(), 1u);
  EXPECT_EQ(HealthOf(""), kNotServing);
}

TEST_F(ServerTest, SigtermLetsRunningCallsEndAndExitsWithZero) {
  ThrowawayDatabase database;
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  ASSERT_TRUE(BecomesHealth(kServing, 15));
  grpc::Status slow;
  std::thread call([&] {
    Scan scan;
    slow = Get("slow", &scan);
  });
  std::this_thread::sleep_for(milliseconds(200));
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
  Start("host=/nowhere-at-all dbname=x");
  const std::string given = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  Scan scan;
  ASSERT_TRUE(Get("a", &scan, given).ok());
  EXPECT_EQ(scan.name(), given);
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
  Start("host=/nowhere-at-all dbname=x");
  Scan scan;
  EXPECT_TRUE(Get(std::string(1 << 19, 'x'), &scan).ok());
  EXPECT_EQ(Get(std::string((1 << 20) + 1, 'x'), &scan).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_FALSE(Get("x", &scan, std::string(40'000, 'h')).ok());
  // The server ends the connection that sent such a header, and lives on for others.
  grpc::ChannelArguments of_its_own;
  of_its_own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  channel_ = grpc::CreateCustomChannel(Address(), grpc::InsecureChannelCredentials(), of_its_own);
  const grpc::Status after = Get("x", &scan);
  EXPECT_TRUE(after.ok()) << after.error_message();
}

// 100 MB that are 100 KB on the wire.
TEST_F(ServerTest, ACompressedMessageIsRefusedBeforeItIsInflated) {
  Start("host=/nowhere-at-all dbname=x");
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
  EXPECT_LT(PeakKb() - before_kb, 20'000);
  EXPECT_TRUE(Get("x", &scan).ok());
}

TEST_F(ServerTest, ReflectionNamesTheService) {
  Start("host=/nowhere-at-all dbname=x");
  grpc::GenericStub stub(channel_);
  grpc::ClientContext context;
  context.set_deadline(Soon(5));
  grpc::CompletionQueue queue;
  const auto next = [&queue] {
    void* tag = nullptr;
    bool done = false;
    return queue.Next(&tag, &done) && done;
  };
  const auto call =
      stub.PrepareCall(&context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  call->StartCall(this);
  ASSERT_TRUE(next());
  grpc::Slice list_services(std::string("\x3a\x00", 2));  // field 7, an empty string
  call->Write(grpc::ByteBuffer(&list_services, 1), this);
  ASSERT_TRUE(next());
  grpc::ByteBuffer received;
  call->Read(&received, this);
  ASSERT_TRUE(next());
  grpc::Slice answer;
  ASSERT_TRUE(received.DumpToSingleSlice(&answer).ok());
  const std::string text(answer.begin(), answer.end());
  EXPECT_THAT(text, ::testing::HasSubstr(kService));
  EXPECT_THAT(text, ::testing::HasSubstr("grpc.health.v1.Health"));
  grpc::Status status;
  call->Finish(&status, this);
  context.TryCancel();
  next();
}

TEST_F(ServerTest, ATakenPortIsAnErrorNotASharedPort) {
  const std::string port = std::to_string(20000 + getpid() % 20000);
  pid_ = Spawn("127.0.0.1:" + port, "host=/nowhere-at-all dbname=x");
  channel_ = grpc::CreateChannel("127.0.0.1:" + port, grpc::InsecureChannelCredentials());
  ASSERT_TRUE(channel_->WaitForConnected(Soon(15)));
  const pid_t second = Spawn("127.0.0.1:" + port, "host=/nowhere-at-all dbname=x");
  int status = 0;
  ASSERT_EQ(waitpid(second, &status, 0), second);
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_EQ(LogLines("cannot listen").size(), 1u);
}

}  // namespace
}  // namespace sixpoint::runtime
