// Accepts connections for gRPC, within limits. gRPC 1.51 has none: a stranger opens as many as there are descriptors, and a
// server that has no descriptor left once never accepts again.
#pragma once

#include <grpcpp/grpcpp.h>
#include <sys/socket.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "services/runtime/listening_sockets.h"

namespace sixpoint::runtime {

struct ConnectionLimits {
  int per_peer = 256;  // one IPv4 address, one /64 of IPv6, or all of a unix socket
  int in_all = 1024;
};

// Lets this process have as many descriptors as it may, and leaves half of them for what is no connection.
ConnectionLimits RaiseDescriptorLimit(ConnectionLimits wanted);

// Which accepted connections are still there. gRPC closes them without a word, so they are looked at when they are too many.
// Thread-safe.
class OpenConnections {
 public:
  explicit OpenConnections(ConnectionLimits limits) : limits_(limits) {}
  // False: it is one too many, of its peer or of all.
  bool Add(const sockaddr_storage& peer, int fd);
  // Ends the connection of that peer, as grpc::ServerContext::peer() names it (of a unix socket all of them: they have one name), and
  // lets its address open none for some seconds. False: there is none.
  bool Close(const std::string& grpc_peer);
  // While it is paused, the kernel keeps what comes of that connection (of TCP), and tells gRPC of it once it is much. False: there is none.
  bool SetPaused(const std::string& grpc_peer, bool is_paused);

 private:
  struct Connection {
    std::string name;  // as gRPC has it
    int fd;
    ino_t inode;  // a number is soon given to another descriptor, the socket's inode is not
  };
  using Connections = std::vector<Connection>;
  static void ForgetClosed(Connections* connections);
  static Descriptor HeldOf(const Connection& one);
  int CountAll() const;

  const ConnectionLimits limits_;
  std::mutex mutex_;
  std::map<std::string, Connections> of_peer_;
  std::map<std::string, std::chrono::steady_clock::time_point> refused_until_;
};

// One thread. Whom it refuses sees its connection closed at once.
class ConnectionAcceptor {
 public:
  using Taker = std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor>;
  // The server behind `taker` runs already, and is shut down after this has ended.
  ConnectionAcceptor(std::vector<Descriptor> listening, OpenConnections* open, Taker taker);
  ~ConnectionAcceptor();
  ConnectionAcceptor(const ConnectionAcceptor&) = delete;
  ConnectionAcceptor& operator=(const ConnectionAcceptor&) = delete;

 private:
  void Run();
  void Accept(const Descriptor& listening);
  // With no descriptor left the next in line is accepted with the spare one and closed: else it would wait for ever.
  void RefuseWithSpare(const Descriptor& listening);
  void Refused(const char* why);

  std::vector<Descriptor> listening_;
  OpenConnections* const open_;
  const Taker taker_;
  Descriptor spare_;
  std::atomic<bool> stopped_{false};
  std::chrono::steady_clock::time_point said_{};
  long refused_count_ = 0;
  std::thread thread_;
};

}  // namespace sixpoint::runtime
