#include "services/runtime/flood_watch.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>
#include <time.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "services/runtime/log.h"

namespace sixpoint::runtime {
namespace {

// At the 15,000 streams a second that one thread of gRPC's reads, 150 calls, of 2 MB, come between two looks.
constexpr std::chrono::milliseconds kBetweenCounts{10};
// A flood costs its server time of its processors, and a look 0.25 ms of it: one that is idle is not looked at.
constexpr std::chrono::milliseconds kWorkBetweenLooks{5};
// Fewer new calls than this in all are no flood, and no connection is looked at.
constexpr std::int64_t kFewCalls = 500;
// Of one connection in a minute: it may have 16 open at once (call_gate.h), and a client gives up one now and then.
constexpr std::chrono::minutes kCounted{1};
constexpr std::int64_t kMostUnanswered = 500;
// In a flood, which many connections may share, little more than may be open at once.
constexpr std::int64_t kFlood = 500, kMostUnansweredInFlood = 100;

// Of all threads of this process.
std::chrono::nanoseconds ProcessorTime() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
}

// gRPC gives text that is ours to free.
nlohmann::json Parsed(char* text) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(text, &gpr_free);
  return text == nullptr ? nlohmann::json() : nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
}

// Proto's JSON writes 64-bit integers as texts, and leaves out what is 0.
std::int64_t Count(const nlohmann::json& message, const char* name) {
  const auto found = message.find(name);
  return found == message.end() ? 0 : std::stoll(found->get<std::string>());
}

struct Socket {
  std::int64_t id;
  std::string peer;  // as grpc::ServerContext::peer() names it
  std::int64_t
      unanswered;  // gRPC counts alike what is not answered yet, what was given up, and what was given up and is still in line
};

// All connections of the server.
std::vector<Socket> SocketsOf(std::int64_t server_id) {
  std::vector<Socket> found;
  nlohmann::json sockets;
  std::int64_t next_id = 0;
  do {
    sockets = Parsed(grpc_channelz_get_server_sockets(server_id, next_id, 0));
    if (!sockets.contains("socketRef")) return found;
    for (const nlohmann::json& ref : sockets["socketRef"]) {
      const std::int64_t id = Count(ref, "socketId");
      next_id = id + 1;
      const nlohmann::json socket = Parsed(grpc_channelz_get_socket(id));
      if (!socket.contains("socket")) continue;
      const nlohmann::json& data = socket["socket"].at("data");
      const std::string name = socket["socket"].at("ref").at("name");  // "chttp2 ipv4:127.0.0.1:40000"
      found.push_back(
          {id, name.substr(name.rfind(' ') + 1), Count(data, "streamsStarted") - Count(data, "streamsSucceeded")});
    }
  } while (!sockets.value("end", false));
  return found;
}

}  // namespace

FloodWatch::FloodWatch(OpenConnections* connections) : connections_(connections), thread_([this] { Run(); }) {}

FloodWatch::~FloodWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  stopping_.notify_all();
  thread_.join();
}

void FloodWatch::Run() {
  std::unique_lock<std::mutex> lock(mutex_);
  std::chrono::nanoseconds looked_at{};
  while (!stopping_.wait_for(lock, kBetweenCounts, [this] { return stopped_; })) {
    if (ProcessorTime() < looked_at + kWorkBetweenLooks) continue;
    Look();
    looked_at = ProcessorTime();
  }
}

void FloodWatch::Look() {
  const nlohmann::json servers = Parsed(grpc_channelz_get_servers(0));
  if (!servers.contains("server")) return;
  const nlohmann::json& server = servers["server"].at(0);
  const nlohmann::json& counts = server.at("data");
  const std::int64_t calls = Count(counts, "callsStarted");
  const auto now = std::chrono::steady_clock::now();
  const bool counts_anew = now >= counted_anew_ + kCounted;
  const bool many = calls >= calls_looked_at_ + kFewCalls;
  if (!many && !counts_anew) return;
  const std::vector<Socket> sockets = SocketsOf(Count(server.at("ref"), "serverId"));
  if (many) {
    calls_looked_at_ = calls;
    const std::int64_t open = calls - Count(counts, "callsSucceeded") - Count(counts, "callsFailed");
    const std::int64_t most = open > kFlood ? kMostUnansweredInFlood : kMostUnanswered;
    for (const Socket& socket : sockets) {
      const auto before = unanswered_before_.find(socket.id);
      if (socket.unanswered - (before == unanswered_before_.end() ? 0 : before->second) > most &&
          connections_->Close(socket.peer))
        Log(LogLevel::kWarning, "connection ended: its calls were given up unanswered", {{"peer", socket.peer}});
    }
  }
  if (!counts_anew) return;
  counted_anew_ = now;
  unanswered_before_.clear();
  for (const Socket& socket : sockets) unanswered_before_[socket.id] = socket.unanswered;
}

}  // namespace sixpoint::runtime
