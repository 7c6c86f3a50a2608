#include "services/runtime/connection_acceptor.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "services/runtime/log.h"
#include "services/runtime/peer_address.h"

namespace sixpoint::runtime {
namespace {

using Clock = std::chrono::steady_clock;

// Where nothing can be accepted, and poll would say at once that something could be.
constexpr std::chrono::milliseconds kPause{50};
constexpr std::chrono::seconds kBetweenLogLines{60};
constexpr std::chrono::seconds kRefusedAfterClose{5};
const std::string& ThisComputer() {
  static const auto* const key = new std::string(PeerKey(std::string("ipv4:127.0.0.1:0")));
  return *key;
}
// Of a connection that is paused: more than the calls that may be open on one, less than a block of a scan.
constexpr int kMuch_bytes = 64 << 10;

// 0: no longer open.
ino_t InodeOf(int fd) {
  struct stat found {};
  return fstat(fd, &found) == 0 && S_ISSOCK(found.st_mode) ? found.st_ino : 0;
}

Descriptor OpenSpare() { return Descriptor(open("/dev/null", O_RDONLY | O_CLOEXEC)); }

}  // namespace

ConnectionLimits RaiseDescriptorLimit(ConnectionLimits wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  const int in_all = static_cast<int>(std::min<rlim_t>(limit.rlim_cur / 2, static_cast<rlim_t>(wanted.in_all)));
  // One peer alone never takes all.
  return {std::min(wanted.per_peer, (in_all + 1) / 2), in_all};
}

void OpenConnections::ForgetClosed(Connections* connections) {
  connections->erase(std::remove_if(connections->begin(), connections->end(),
                                    [](const Connection& one) { return InodeOf(one.fd) != one.inode; }),
                     connections->end());
}

int OpenConnections::CountAll() const {
  std::size_t count = 0;
  for (const auto& [peer, connections] : of_peer_) count += connections.size();
  return static_cast<int>(count);
}

bool OpenConnections::Add(const sockaddr_storage& peer, int fd) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (CountAll() >= limits_.in_all) {
    for (auto each = of_peer_.begin(); each != of_peer_.end();) {
      ForgetClosed(&each->second);
      each = each->second.empty() ? of_peer_.erase(each) : std::next(each);
    }
    if (CountAll() >= limits_.in_all) return false;
  }
  const std::string key = PeerKey(peer);
  if (const auto until = refused_until_.find(key); until != refused_until_.end()) {
    if (Clock::now() < until->second) return false;
    refused_until_.erase(until);
  }
  Connections& connections = of_peer_[key];
  if (static_cast<int>(connections.size()) >= limits_.per_peer) ForgetClosed(&connections);
  if (static_cast<int>(connections.size()) >= limits_.per_peer) return false;
  connections.push_back({GrpcName(peer), fd, InodeOf(fd)});
  return true;
}

// gRPC may close it meanwhile, and the number be another's: a duplicate stays what it is.
Descriptor OpenConnections::HeldOf(const Connection& one) {
  Descriptor held(fcntl(one.fd, F_DUPFD_CLOEXEC, 0));
  if (held.is_open() && InodeOf(held.get()) != one.inode) held.Reset();
  return held;
}

bool OpenConnections::SetPaused(const std::string& grpc_peer, bool is_paused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto of_peer = of_peer_.find(PeerKey(grpc_peer));
  if (of_peer == of_peer_.end()) return false;
  for (const Connection& one : of_peer->second) {
    if (one.name != grpc_peer) continue;
    const Descriptor held = HeldOf(one);
    const int least_bytes = is_paused ? kMuch_bytes : 1;
    if (held.is_open() && setsockopt(held.get(), SOL_SOCKET, SO_RCVLOWAT, &least_bytes, sizeof least_bytes) == 0)
      return true;
  }
  return false;
}

bool OpenConnections::Close(const std::string& grpc_peer) {
  const std::lock_guard<std::mutex> lock(mutex_);
  bool any = false;
  for (const auto& [key, connections] : of_peer_) {
    for (const Connection& one : connections) {
      if (one.name != grpc_peer) continue;
      const Descriptor held = HeldOf(one);
      if (!held.is_open()) continue;
      shutdown(held.get(), SHUT_RDWR);
      // What came already is no longer gRPC's to read.
      char bytes[65'536];
      while (recv(held.get(), bytes, sizeof bytes, MSG_DONTWAIT) > 0) continue;
      // On this computer everybody has one address: a gateway's, or the other services', is not closed for a stranger's sake.
      if (key != ThisComputer()) refused_until_[key] = Clock::now() + kRefusedAfterClose;
      any = true;
    }
  }
  return any;
}

ConnectionAcceptor::ConnectionAcceptor(std::vector<Descriptor> listening, OpenConnections* open, Taker taker)
    : listening_(std::move(listening)), open_(open), taker_(std::move(taker)), spare_(OpenSpare()), thread_([this] {
        Run();
      }) {}

ConnectionAcceptor::~ConnectionAcceptor() {
  stopped_ = true;
  for (const Descriptor& socket : listening_) shutdown(socket.get(), SHUT_RDWR);  // wakes poll
  thread_.join();
}

void ConnectionAcceptor::Run() {
  std::vector<pollfd> watched;
  for (const Descriptor& socket : listening_) watched.push_back({socket.get(), POLLIN, 0});
  while (!stopped_) {
    if (!spare_.is_open()) spare_ = OpenSpare();
    if (!spare_.is_open()) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    if (poll(watched.data(), watched.size(), -1) <= 0) continue;
    for (std::size_t i = 0; i < listening_.size() && !stopped_; ++i)
      if (watched[i].revents != 0) Accept(listening_[i]);
  }
}

void ConnectionAcceptor::Accept(const Descriptor& listening) {
  sockaddr_storage peer{};
  socklen_t length = sizeof peer;
  Descriptor accepted(
      accept4(listening.get(), reinterpret_cast<sockaddr*>(&peer), &length, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!accepted.is_open()) {
    if (errno == EMFILE || errno == ENFILE) RefuseWithSpare(listening);
    // The others are of one connection that came to nothing, or pass (memory): poll asks again.
    else if (errno == ENOBUFS || errno == ENOMEM)
      std::this_thread::sleep_for(kPause);
    return;
  }
  if (!open_->Add(peer, accepted.get()))
    return Refused("as many connections are open as may be, of the peer or in all");
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
  connection.listener_fd = listening.get();
  connection.fd = accepted.Release();
  taker_->HandleNewConnection(&connection);
}

void ConnectionAcceptor::RefuseWithSpare(const Descriptor& listening) {
  spare_.Reset();
  Descriptor refused(accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC));
  refused.Reset();
  spare_ = OpenSpare();
  Refused("no descriptor is free");
}

// A stranger cannot fill the log.
void ConnectionAcceptor::Refused(const char* why) {
  ++refused_count_;
  const Clock::time_point now = Clock::now();
  if (said_ != Clock::time_point() && now < said_ + kBetweenLogLines) return;
  said_ = now;
  Log(LogLevel::kWarning, "connection refused", {{"why", std::string(why)}, {"count", refused_count_}});
}

}  // namespace sixpoint::runtime
