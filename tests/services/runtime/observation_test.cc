// How a real server is seen from outside: who may look, what he sees, and what strangers at that port can do.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "services/runtime/credentials.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/migrate.h"
#include "tests/services/runtime/raw_connection.h"
#include "tests/support/https_get.h"
#include "tests/support/newest_denials.h"
#include "tests/support/plant_certificates.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::runtime {
namespace {

namespace fs = std::filesystem;
using identity::Role;
using sixpoint::testing::HttpsAnswer;
using sixpoint::testing::HttpsGet;
using sixpoint::testing::PlantCertificates;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using testing::RawConnection;
using testing::Speaks;
using ::testing::UnorderedElementsAre;

// One that was free a moment ago.
int FreePort() {
  const int handle = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(handle, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(getsockname(handle, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(handle);
  return ntohs(address.sin_port);
}

std::size_t SeriesCount(const std::string& exposition) {
  std::istringstream text(exposition);
  std::size_t count = 0;
  for (std::string line; std::getline(text, line);) count += !line.empty() && line[0] != '#';
  return count;
}
// Of the one series that is written so; -1: there is none.
double ValueIn(const std::string& exposition, const std::string& series) {
  const std::size_t line = ("\n" + exposition).find("\n" + series + " ");
  return line == std::string::npos ? -1 : std::stod(exposition.substr(line + series.size() + 1));
}

class ObservationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-seen-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    if (HasFailure()) std::printf("%s\n", Log().c_str());
    fs::remove_all(folder_);
  }
  void Start(const std::string& conninfo) {
    const char* bin = std::getenv("SIXPOINT_BIN_DIR");
    ASSERT_NE(bin, nullptr) << "SIXPOINT_BIN_DIR is not set, want the folder of the programs (ctest sets it)";
    const std::string program = std::string(bin) + "/runtime_test_server", log = folder_ / "log",
                      own = certificates_.Service("ingest"), revoked = certificates_.revoked_file(),
                      listen = "unix:" + (folder_ / "socket").string();
    pid_ = fork();
    if (pid_ == 0) {
      if (std::freopen(log.c_str(), "a", stderr) == nullptr) _exit(126);
      execl(program.c_str(), program.c_str(), "--listen", listen.c_str(), "--database", conninfo.c_str(), "--metrics",
            at_.c_str(), "--certificates", own.c_str(), "--revoked", revoked.c_str(), nullptr);
      _exit(127);
    }
    channel_ = grpc::CreateChannel(listen, ChannelCredentialsOf(jane_).value());
    ASSERT_TRUE(channel_->WaitForConnected(std::chrono::system_clock::now() + std::chrono::seconds(30))) << Log();
  }
  void StartReady() {
    database_ = std::make_unique<ThrowawayDatabase>();
    Start(sixpoint::testing::AsRole(database_->conninfo(), "ingest"));
    ASSERT_TRUE(Becomes(200));
  }
  std::string Log() const {
    std::ostringstream text;
    text << std::ifstream(folder_ / "log").rdbuf();
    return text.str();
  }
  HttpsAnswer Get(const std::string& path, const fs::path& credentials) const {
    return HttpsGet("https://" + at_ + path, credentials);
  }
  // /health/ready, asked by nobody.
  bool Becomes(long code) {
    for (const auto end = steady_clock::now() + std::chrono::seconds(40); steady_clock::now() < end;) {
      if (Get("/health/ready", nobody_).code == code) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }
  grpc::Status GetScan() const {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    ingest::v1::GetScanRequest request;
    request.set_name("scans/s1");
    ingest::v1::Scan scan;
    return ingest::v1::ScanService::NewStub(channel_)->GetScan(&context, request, &scan);
  }

  fs::path folder_;
  PlantCertificates certificates_;
  const fs::path jane_ = certificates_.User("jane", {Role::kEngineer}), nobody_ = certificates_.Nobody();
  const std::string at_ = "127.0.0.1:" + std::to_string(FreePort());
  std::unique_ptr<ThrowawayDatabase> database_;
  std::shared_ptr<grpc::Channel> channel_;
  pid_t pid_ = 0;
};

TEST_F(ObservationTest, WhoMayLookIsJudgedAtEachRequest) {
  StartReady();
  for (const Role role : {Role::kMesReader, Role::kEngineer, Role::kQuality, Role::kAdmin}) {
    const HttpsAnswer seen = Get("/metrics", certificates_.User("one", {role}));
    EXPECT_EQ(seen.code, 200) << identity::RoleText(role) << ": " << seen.error;
    EXPECT_THAT(seen.body, HasSubstr("sixpoint_build_info{area=\"ingest\""));
  }
  struct Refused {
    const char* who;
    fs::path credentials;
    long code;
    const char* reason;
  };
  // Another plant's user, who believes this plant's authority.
  PlantCertificates other;
  const fs::path foreign = other.User("jane", {Role::kAdmin});
  fs::copy_file(nobody_ / "authority.pem", foreign / "authority.pem", fs::copy_options::overwrite_existing);
  const fs::path expired = certificates_.Expired("late", {Role::kEngineer});
  const fs::path revoked = certificates_.User("gone", {Role::kEngineer});
  EXPECT_EQ(Get("/metrics", revoked).code, 200);
  certificates_.Revoke(revoked);
  const std::vector<Refused> all = {{"nobody", nobody_, 401, "CERTIFICATE_MISSING"},
                                    {"foreign", foreign, 401, "CERTIFICATE_FOREIGN"},
                                    {"expired", expired, 401, "CERTIFICATE_EXPIRED"},
                                    {"revoked", revoked, 401, "CERTIFICATE_REVOKED"},
                                    {"machine", certificates_.Machine("m1"), 403, "ROLE_MISSING"},
                                    {"service", certificates_.Service("plant"), 403, "ROLE_MISSING"}};
  for (const Refused& each : all) {
    const HttpsAnswer refused = Get("/metrics", each.credentials);
    EXPECT_EQ(refused.code, each.code) << each.who << ": " << refused.error;
    EXPECT_THAT(refused.body, HasSubstr(each.reason)) << each.who;
    EXPECT_EQ(refused.body.find("grpc_server"), std::string::npos) << each.who;
    // What stands at this port is no secret to a load balancer.
    EXPECT_EQ(Get("/health/live", each.credentials).code, 200) << each.who;
    EXPECT_EQ(Get("/health/ready", each.credentials).code, 200) << each.who;
  }
  const std::string seen = Get("/metrics", jane_).body;
  EXPECT_EQ(ValueIn(seen, "sixpoint_denials_total{reason=\"ROLE_MISSING\"}"), 2);
  EXPECT_EQ(ValueIn(seen, "sixpoint_denials_total{reason=\"CERTIFICATE_REVOKED\"}"), 1);
  // And kept, as a call's would be.
  const auto kept = [this] {
    auto transaction = database_->database()->Begin(sixpoint::testing::Soon());
    std::vector<std::string> texts;
    const auto rows = sixpoint::testing::NewestDenials(*transaction, 100);
    EXPECT_TRUE(rows.ok()) << rows.status();
    if (!rows.ok()) return texts;
    for (const storage::Denial& each : *rows) texts.push_back(each.method + " " + each.caller + " " + each.reason);
    return texts;
  };
  std::vector<std::string> denials;
  for (const auto end = steady_clock::now() + std::chrono::seconds(20); steady_clock::now() < end;) {
    denials = kept();
    if (denials.size() >= all.size()) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_THAT(denials, UnorderedElementsAre(
                           "GET /metrics  CERTIFICATE_MISSING", "GET /metrics  CERTIFICATE_FOREIGN",
                           "GET /metrics users/late CERTIFICATE_EXPIRED", "GET /metrics users/gone CERTIFICATE_REVOKED",
                           "GET /metrics machines/m1 ROLE_MISSING", "GET /metrics services/plant ROLE_MISSING"));
  EXPECT_EQ(Get("/nothing", jane_).code, 404);
  // Plain text is not spoken.
  EXPECT_EQ(HttpsGet("http://" + at_ + "/health/live", nobody_, 5).code, 0);
}

TEST_F(ObservationTest, ReadyFollowsDatabaseAndSchema) {
  ThrowawayDatabase database(ThrowawayDatabase::Schema::kEmpty);
  Start(sixpoint::testing::AsRole(database.conninfo(), "ingest"));
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_EQ(Get("/health/ready", nobody_).code, 503);  // reachable, but without a schema
  EXPECT_EQ(Get("/health/live", nobody_).code, 200);
  EXPECT_EQ(ValueIn(Get("/metrics", jane_).body, "sixpoint_ready"), 0);
  ASSERT_TRUE(storage::Migrate(database.conninfo(), ThrowawayDatabase::MigrationsFolder()).ok());
  EXPECT_TRUE(Becomes(200));
  EXPECT_EQ(ValueIn(Get("/metrics", jane_).body, "sixpoint_ready"), 1);
  ThrowawayDatabase::KillServer();
  EXPECT_TRUE(Becomes(503));
  EXPECT_EQ(Get("/health/live", nobody_).code, 200);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_GT(ValueIn(Get("/metrics", jane_).body, "sixpoint_database_silence_seconds"), 1);
  ThrowawayDatabase::StartServer();
  EXPECT_TRUE(Becomes(200));
  EXPECT_LT(ValueIn(Get("/metrics", jane_).body, "sixpoint_database_silence_seconds"), 10);
}

TEST_F(ObservationTest, ARenewedCertificateCountsWithoutARestart) {
  StartReady();
  const HttpsAnswer before = Get("/health/live", nobody_);
  ASSERT_FALSE(before.serial.empty());
  EXPECT_EQ(Get("/health/live", nobody_).serial, before.serial);
  const fs::path folder = certificates_.Service("ingest");  // of the same name once more: another one in its place
  const HttpsAnswer next = Get("/health/live", nobody_);
  EXPECT_EQ(next.code, 200) << next.error;
  EXPECT_NE(next.serial, before.serial);
  // One that cannot be used changes nothing.
  // Replaced whole, as everything of ours does: gRPC 1.51 ends the process where it reads an empty file.
  std::ofstream(folder / "beside") << "nothing";
  fs::rename(folder / "beside", folder / "identity.pem");
  const HttpsAnswer after = Get("/health/live", nobody_);
  EXPECT_EQ(after.code, 200) << after.error;
  EXPECT_EQ(after.serial, next.serial);
}

TEST_F(ObservationTest, CallsAreCountedExactly) {
  StartReady();
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([this] {
      for (int call = 0; call < 50; ++call) EXPECT_TRUE(GetScan().ok());
    });
  for (std::thread& thread : threads) thread.join();
  const std::string labels =
      "grpc_method=\"GetScan\",grpc_service=\"sixpoint.ingest.v1.ScanService\",grpc_type=\"unary\"}";
  // A call is over for its client a moment before it is for the server.
  std::string seen;
  for (const auto end = steady_clock::now() + std::chrono::seconds(20); steady_clock::now() < end;) {
    seen = Get("/metrics", jane_).body;
    if (ValueIn(seen, "sixpoint_calls_in_flight") == 0) break;
  }
  EXPECT_EQ(ValueIn(seen, "grpc_server_started_total{" + labels), 400);
  EXPECT_EQ(ValueIn(seen, "grpc_server_handled_total{grpc_code=\"OK\"," + labels), 400);
  EXPECT_EQ(ValueIn(seen, "grpc_server_handling_seconds_count{" + labels), 400);
  EXPECT_EQ(ValueIn(seen, "sixpoint_calls_in_flight"), 0);
}

// Ten thousand names by calls that are answered, and not one series for them.
TEST_F(ObservationTest, AStrangersMethodNamesAreNoSeries) {
  StartReady();
  EXPECT_TRUE(GetScan().ok());
  Get("/metrics", jane_);
  const std::size_t before = SeriesCount(Get("/metrics", jane_).body);
  constexpr int kCalls = 10'000, kAtOnce = 50;
  struct Call {
    grpc::ClientContext context;
    grpc::ByteBuffer answer;
    grpc::Status status;
    std::unique_ptr<grpc::GenericClientAsyncResponseReader> reader;
  };
  grpc::GenericStub stub(channel_);
  grpc::CompletionQueue queue;
  int begun = 0, refused = 0;
  const auto begin = [&] {
    auto* const call = new Call();
    const grpc::Slice empty("");
    const std::string id = std::to_string(begun++);
    const std::string name =
        begun % 2 == 0 ? "/sixpoint.ingest.v1.ScanService/Invented" + id : "/sixpoint." + id + "/" + id;
    call->context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    call->reader = stub.PrepareUnaryCall(&call->context, name, grpc::ByteBuffer(&empty, 1), &queue);
    call->reader->StartCall();
    call->reader->Finish(&call->answer, &call->status, call);
  };
  while (begun < kAtOnce) begin();
  void* tag = nullptr;
  for (bool done = false; refused < kCalls && queue.Next(&tag, &done); ++refused) {
    const std::unique_ptr<Call> call(static_cast<Call*>(tag));
    ASSERT_EQ(call->status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << call->status.error_message();
    if (begun < kCalls) begin();
  }
  EXPECT_EQ(SeriesCount(Get("/metrics", jane_).body), before);
}

// Strangers who hold all places, each in its own way, from one address and from a hundred.
TEST_F(ObservationTest, SlowStrangersDoNotStopWhoMayLook) {
  StartReady();
  std::deque<RawConnection> silent, idle, dripping;
  const auto source = [](int i) { return "127.0.1." + std::to_string(1 + i % 100); };
  for (int i = 0; i < 150; ++i) {
    silent.emplace_back(at_, source(i), Speaks::kNothing);
    if (i % 3 != 0) continue;
    idle.emplace_back(at_, source(i));
    dripping.emplace_back(at_, source(i));
    dripping.back().Send("GET /metrics HT");
  }
  std::atomic<bool> over{false};
  std::thread drips([&] {
    while (!over) {
      for (RawConnection& each : dripping) each.Send("X");
      for (int i = 0; i < 8; ++i) silent.emplace_back(at_, source(i), Speaks::kNothing);
      while (silent.size() > 400) silent.pop_front();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  std::chrono::duration<double> slowest{};
  for (int i = 0; i < 20; ++i) {
    const auto begin = steady_clock::now();
    EXPECT_EQ(Get("/metrics", jane_).code, 200) << i;
    EXPECT_TRUE(GetScan().ok());
    slowest = std::max<std::chrono::duration<double>>(slowest, steady_clock::now() - begin);
  }
  over = true;
  drips.join();
  std::printf("slowest scrape and call beside slow strangers: %.3f s\n", slowest.count());
  EXPECT_LT(slowest.count(), 10);  // a place is lost for 10 s at most, and none of them was waited for
  const std::string seen = Get("/metrics", jane_).body;
  EXPECT_GT(ValueIn(seen, "sixpoint_watchers_evicted_total"), 100);
  EXPECT_LT(ValueIn(seen, "process_open_fds"), 300);
}

TEST_F(ObservationTest, WhatIsNoRequestIsToldSo) {
  StartReady();
  RawConnection endless(at_);
  ASSERT_TRUE(endless.Send("GET /metrics HTTP/1.1\r\nX: " + std::string(9000, 'x')));
  EXPECT_TRUE(endless.IsClosedWithin(5));
  RawConnection nonsense(at_);
  ASSERT_TRUE(nonsense.Send("\x01\x02 nonsense\r\n\r\n"));
  EXPECT_TRUE(nonsense.IsClosedWithin(5));
  RawConnection post(at_);
  ASSERT_TRUE(post.Send("POST /metrics HTTP/1.1\r\n\r\n"));
  EXPECT_TRUE(post.IsClosedWithin(5));
  RawConnection slow(at_);
  ASSERT_TRUE(slow.Send("GET /health/live HTTP/1.1\r\n"));
  EXPECT_FALSE(slow.IsClosedWithin(2));
  EXPECT_TRUE(slow.IsClosedWithin(30));
  const std::string seen = Get("/metrics", jane_).body;
  EXPECT_EQ(ValueIn(seen, "sixpoint_watchers_answered_total{code=\"431\"}"), 1);
  EXPECT_EQ(ValueIn(seen, "sixpoint_watchers_answered_total{code=\"400\"}"), 1);
  EXPECT_EQ(ValueIn(seen, "sixpoint_watchers_answered_total{code=\"405\"}"), 1);
  EXPECT_EQ(ValueIn(seen, "sixpoint_watchers_late_total"), 1);
}

TEST_F(ObservationTest, IsWhatPrometheusReads) {
  if (std::system("command -v promtool >/dev/null") != 0) GTEST_SKIP() << "SKIPPED: no promtool";
  StartReady();
  EXPECT_TRUE(GetScan().ok());
  std::ofstream(folder_ / "metrics") << Get("/metrics", jane_).body;
  const std::string check =
      "promtool check metrics < " + (folder_ / "metrics").string() + " > " + (folder_ / "said").string() + " 2>&1";
  const int exit_code = std::system(check.c_str());
  std::ostringstream said;
  said << std::ifstream(folder_ / "said").rdbuf();
  EXPECT_EQ(exit_code, 0) << said.str();
}

}  // namespace
}  // namespace sixpoint::runtime
