// What HTTP/2, TLS and slowness can do to a real service, from a stranger and from somebody with a good certificate: its memory stays
// bounded, others are served meanwhile, and it is as before soon after. `bench/run door` runs the same for longer and judges the times.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <functional>
#include <thread>

#include "services/runtime/credentials.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/services/runtime/raw_connection.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

using runtime::testing::Answers;
using runtime::testing::CallHeaders;
using runtime::testing::Frame;
using runtime::testing::FrameOf;
using runtime::testing::Preface;
using runtime::testing::RawConnection;
using runtime::testing::Speaks;
using Clock = std::chrono::steady_clock;

constexpr double kMostGrowth_mb = 100;
constexpr int kEndHeaders = 4;

double AttackSeconds() {
  const char* given = std::getenv("SIXPOINT_ATTACK_S");
  return given == nullptr ? 1 : std::stod(given);
}

// One of them alone, for whoever looks into it.
bool IsWanted(const std::string& attack) {
  const char* const only = std::getenv("SIXPOINT_ATTACK");
  return only == nullptr || attack == only;
}

Clock::time_point In(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

double P99_ms(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(0.99 * static_cast<double>(values.size() - 1))];
}

// Whom the attacker is, and where.
struct Attacker {
  std::string address, identity;
  int source = 2;  // another in each attack: an address whose connection was ended waits for the next
  RawConnection Connect(Speaks speaks = Speaks::kTls) const { return Connect(speaks, source); }
  RawConnection Connect(Speaks speaks, int own_source) const {
    return RawConnection(address, "127.0.0." + std::to_string(own_source), speaks, identity);
  }
};

using Attack = std::function<void(const Attacker&, Clock::time_point end)>;

// The same bytes over and over, on connections that are opened anew when they are ended.
Attack Flood(const std::string& first, const std::string& again, Answers answers = Answers::kReadAway) {
  return [=](const Attacker& attacker, Clock::time_point end) {
    std::string burst;
    while (burst.size() < 60'000) burst += again;
    while (Clock::now() < end) {
      RawConnection connection = attacker.Connect();
      bool open = connection.Send(Preface() + first, answers);
      if (!open) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      while (open && Clock::now() < end) open = connection.Send(burst, answers);
    }
  };
}

void ResetRapidly(const Attacker& attacker, Clock::time_point end) {
  const std::string headers = CallHeaders("/sixpoint.plant.v1.PlantService/ListBlades");
  while (Clock::now() < end) {
    RawConnection connection = attacker.Connect();
    bool open = connection.Send(Preface());
    for (unsigned stream = 1; open && Clock::now() < end;) {
      std::string burst;
      for (int i = 0; i < 100; ++i, stream += 2)
        burst += FrameOf(Frame::kHeaders, kEndHeaders, stream, headers) +
                 FrameOf(Frame::kResetStream, 0, stream, std::string("\0\0\0\x08", 4));
      open = connection.Send(burst);
    }
  }
}

// Garbage on streams that there are not, and that there cannot be.
std::string OddWindows() {
  const std::string zero(4, '\0'), greatest("\x7f\xff\xff\xff", 4);
  return FrameOf(Frame::kWindowUpdate, 0, 0, greatest) + FrameOf(Frame::kWindowUpdate, 0, 1, greatest) +
         FrameOf(Frame::kWindowUpdate, 0, 1, zero) + FrameOf(Frame::kWindowUpdate, 0, 7, std::string("\0\0\0\1", 4));
}

void ShakeHands(const Attacker& attacker, Clock::time_point end) {
  while (Clock::now() < end) attacker.Connect();
}

void ShakeHandsInHalf(const Attacker& attacker, Clock::time_point end) {
  std::deque<RawConnection> open;
  const std::string begun("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11);  // a ClientHello of 512 bytes, its first
  while (Clock::now() < end) {
    open.push_back(attacker.Connect(Speaks::kNothing));
    open.back().SendBare(begun);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (open.size() > 500) open.pop_front();
  }
}

void Renegotiate(const Attacker& attacker, Clock::time_point end) {
  while (Clock::now() < end) {
    RawConnection connection = attacker.Connect();
    for (bool open = connection.Send(Preface()); open && Clock::now() < end;) open = connection.Renegotiate();
  }
}

struct NamedAttack {
  const char* name;
  Attack attack;
};

std::vector<NamedAttack> Attacks() {
  const std::string headers = CallHeaders("/sixpoint.plant.v1.PlantService/ListBlades");
  const std::string setting("\0\4\0\0\xff\xff", 6), eight(8, 'x'), five("\0\0\0\1\x10", 5);
  return {
      {"rapid_reset", ResetRapidly},
      {"continuation",
       Flood(FrameOf(Frame::kHeaders, 0, 1, headers), FrameOf(Frame::kContinuation, 0, 1, std::string(16'000, '\0')))},
      {"settings", Flood("", FrameOf(Frame::kSettings, 0, 0, setting))},
      {"settings_unread", Flood("", FrameOf(Frame::kSettings, 0, 0, setting), Answers::kLeft)},
      {"ping", Flood("", FrameOf(Frame::kPing, 0, 0, eight))},
      {"ping_unread", Flood("", FrameOf(Frame::kPing, 0, 0, eight), Answers::kLeft)},
      {"empty_data", Flood(FrameOf(Frame::kHeaders, kEndHeaders, 1, headers), FrameOf(Frame::kData, 0, 1, ""))},
      {"window_update", Flood(FrameOf(Frame::kHeaders, kEndHeaders, 1, headers), OddWindows())},
      {"priority", Flood("", FrameOf(Frame::kPriority, 0, 1, five) + FrameOf(Frame::kPriority, 0, 3, five))},
      {"push_and_unknown", Flood("", FrameOf(Frame::kUnknown, 0, 0, eight) + FrameOf(Frame::kUnknown, 7, 9, "") +
                                         FrameOf(Frame::kPushPromise, kEndHeaders, 1, five))},
      {"handshake", ShakeHands},
      {"handshake_half", ShakeHandsInHalf},
      {"renegotiation", Renegotiate},
  };
}

// Somebody who asks for a page of blades, on one connection from another address, again and again.
class HealthyClient {
 public:
  HealthyClient(const std::string& address, const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
    grpc::ChannelArguments of_its_own;
    of_its_own.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    of_its_own.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    of_its_own.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
    channel_ = grpc::CreateCustomChannel(address, credentials, of_its_own);
  }
  grpc::Status Ask(double seconds = 20) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() +
                         std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds)));
    context.set_wait_for_ready(true);
    plant::v1::ListBladesResponse response;
    return plant::v1::PlantService::NewStub(channel_)->ListBlades(&context, {}, &response);
  }
  std::vector<double> AskUntil(const std::function<bool()>& is_over) {
    std::vector<double> times_ms;
    while (!is_over()) {
      const auto begin = Clock::now();
      grpc::Status status = Ask();
      // Full is an answer too: who asks comes again, and its time counts until it is served.
      for (; status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED; status = Ask()) {
        ++refused_;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
      EXPECT_TRUE(status.ok()) << status.error_message();
      times_ms.push_back(1e3 * SecondsSince(begin));
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
    return times_ms;
  }
  int refused() const { return refused_; }

 private:
  int refused_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
};

class DoorAttacks : public ::testing::Test {
 protected:
  // A descriptor limit of the service; 0: ours.
  void Start(int descriptors = 0) {
    database_ = std::make_unique<ThrowawayDatabase>();
    address_ = "127.0.0.1:" + std::to_string(20'000 + getpid() % 20'000);
    std::vector<std::string> command = {PlantProcesses::Program("sixpoint-plant"),
                                        "--listen",
                                        address_,
                                        "--database",
                                        AsRole(database_->conninfo(), "plant"),
                                        "--certificates",
                                        certificates_.Service("plant"),
                                        "--revoked",
                                        certificates_.revoked_file(),
                                        "--workers",
                                        PlantProcesses::Program("")};
    if (descriptors > 0)
      command.insert(command.begin(), {"/usr/bin/prlimit", "--nofile=" + std::to_string(descriptors)});
    log_ = certificates_.folder() / "log";
    process_ = std::make_unique<Process>(command, log_);
    healthy_ = std::make_unique<HealthyClient>(address_, credentials_);
    for (const auto end = In(30); !healthy_->Ask().ok();) {
      ASSERT_LT(Clock::now(), end) << ReadFile(log_);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  double Memory_mb(const std::string& what) const {
    std::ifstream status("/proc/" + std::to_string(process_->pid()) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.rfind(what + ":", 0) == 0) return 1e-3 * std::stod(line.substr(what.size() + 1));
    ADD_FAILURE() << "no " << what;
    return 0;
  }
  // The greatest from now on.
  void ForgetPeak() const { std::ofstream("/proc/" + std::to_string(process_->pid()) + "/clear_refs") << 5; }

  // `attack` runs in four threads; other clients' times before and meanwhile, memory, and how long until a new client is served.
  void Run(const std::string& name, const Attacker& attacker, const Attack& attack) {
    SCOPED_TRACE(name);
    const auto alone_end = In(AttackSeconds());
    const double alone_ms = P99_ms(healthy_->AskUntil([&] { return Clock::now() > alone_end; }));
    ForgetPeak();
    const double before_mb = Memory_mb("VmRSS");
    const auto end = In(AttackSeconds());
    std::atomic<int> attacking{4};
    std::vector<std::thread> attackers;
    for (int i = 0; i < 4; ++i)
      attackers.emplace_back([&] {
        // They are other machines: what they take of these processors would be told as what they take of the service.
        setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
        attack(attacker, end);
        --attacking;
      });
    const double meanwhile_ms = P99_ms(healthy_->AskUntil([&] { return attacking == 0; }));
    for (std::thread& one : attackers) one.join();
    const auto over = Clock::now();
    HealthyClient next(address_, credentials_);
    const grpc::Status after = next.Ask(60);
    EXPECT_TRUE(after.ok()) << after.error_message();
    const double recovers_s = SecondsSince(over), growth_mb = Memory_mb("VmHWM") - before_mb;
    EXPECT_EQ(process_->Poll(), -1) << "it ended: " << ReadFile(log_);
    EXPECT_LT(growth_mb, kMostGrowth_mb);
    std::printf("%-36s growth %6.1f MB, p99 %7.1f ms, alone %6.1f ms, recovers in %5.2f s, refused %d\n", name.c_str(),
                growth_mb, meanwhile_ms, alone_ms, recovers_s, healthy_->refused());
    std::fflush(stdout);
    for (const auto& [what, value] : {std::pair<const char*, double>{"growth_mb", growth_mb},
                                      {"p99_ms", meanwhile_ms},
                                      {"alone_p99_ms", alone_ms},
                                      {"recovers_s", recovers_s}})
      RecordProperty(name + "_" + what, std::to_string(value));
  }

  std::unique_ptr<ThrowawayDatabase> database_;
  PlantCertificates certificates_;
  std::shared_ptr<grpc::ChannelCredentials> credentials_ =
      runtime::ChannelCredentialsOf(certificates_.User("jane", {identity::Role::kEngineer})).value();
  const std::string certified_ = certificates_.User("mallory", {identity::Role::kEngineer});
  std::string address_, log_;
  std::unique_ptr<Process> process_;
  std::unique_ptr<HealthyClient> healthy_;
};

TEST_F(DoorAttacks, FloodsOfAStranger) {
  Start();
  int source = 10;
  for (const NamedAttack& each : Attacks())
    if (IsWanted(each.name)) Run(std::string(each.name) + "_stranger", {address_, "", ++source}, each.attack);
}

TEST_F(DoorAttacks, FloodsWithAGoodCertificate) {
  Start();
  int source = 10;
  for (const NamedAttack& each : Attacks())
    if (IsWanted(each.name)) Run(std::string(each.name) + "_certified", {address_, certified_, ++source}, each.attack);
}

// As many connections as there are descriptors, from four addresses, held until the end.
TEST_F(DoorAttacks, ConnectionsBeyondDescriptors) {
  Start(256);
  for (const std::string& identity : {std::string(), certified_}) {
    std::atomic<int> source{1};
    Run(std::string("descriptors_") + (identity.empty() ? "stranger" : "certified"), {address_, identity},
        [&](const Attacker& attacker, Clock::time_point end) {
          const int own = ++source;
          std::vector<RawConnection> held;
          for (int i = 0; i < 150 && Clock::now() < end; ++i) {
            held.push_back(attacker.Connect(Speaks::kTls, own));
            if (held.back().connected()) held.back().Send(Preface());
          }
          std::this_thread::sleep_until(end);
        });
  }
}

// 500 connections, each slow in one of four ways, of somebody who may call.
TEST_F(DoorAttacks, FiveHundredSlowClients) {
  rlimit ours{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  if (ours.rlim_max < 1200) GTEST_SKIP() << "SKIPPED: at most " << ours.rlim_max << " descriptors, want 1200";
  ours.rlim_cur = ours.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &ours), 0);
  Start();
  const std::string headers = CallHeaders("/sixpoint.plant.v1.PlantService/ListBlades");
  const std::string call = FrameOf(Frame::kHeaders, kEndHeaders, 1, headers);
  const std::string no_window("\0\4\0\0\0\0", 6);  // the server may send no data
  std::atomic<int> threads{0}, open{0};
  Run("slow_clients", {address_, certified_}, [&](const Attacker& attacker, Clock::time_point end) {
    const int way = threads++;
    std::vector<RawConnection> held;
    std::size_t said = 0;
    for (int i = 0; i < 125; ++i) {
      held.push_back(attacker.Connect(Speaks::kTls, 2 + way));
      if (way == 1) held.back().Send(Preface() + call + FrameOf(Frame::kData, 0, 1, std::string("\0\0\0\1\0half", 9)));
      if (way == 2) held.back().Send(Preface() + call);
      if (way == 3) {
        std::string calls = Preface() + FrameOf(Frame::kSettings, 0, 0, no_window);
        for (unsigned stream = 1; stream < 60; stream += 2)
          calls += FrameOf(Frame::kHeaders, kEndHeaders, stream, headers) +
                   FrameOf(Frame::kData, 1, stream, std::string(5, '\0'));
        held.back().Send(calls, Answers::kLeft);
      }
    }
    open += static_cast<int>(held.size());
    // Of four threads the last one is here when all 500 are there.
    for (const auto last = std::max(end, In(AttackSeconds()));
         Clock::now() < last || (open < 500 && Clock::now() < end);) {
      if (way == 0 && said < Preface().size())
        for (RawConnection& one : held) one.Send(Preface().substr(said, 1));
      said += way == 0 ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(way == 0 ? 1000 : 50));
    }
  });
  EXPECT_EQ(open, 500);
}

}  // namespace
}  // namespace sixpoint::testing
